#pragma once

#include <kmax/command.hpp>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host_tools/device/link.hpp"

namespace kmax::library {

/// A command of the command line with --json, on the device at `address`, which `open` opens. Errors: those
/// of the command, not translated; Interrupted after Ctrl-C.
CommandResult run_command_on(const std::vector<std::string>& arguments, const std::string& address,
                             const std::function<std::unique_ptr<device::Link>()>& open);

}  // namespace kmax::library
