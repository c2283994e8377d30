#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace kmax::cli {

/// What may stand in the place of the last of `words`, which may be empty or begun: commands, options,
/// parameters and their choices, scenes, serial ports. `words`: the arguments without the program's name. A
/// candidate that ends with '=' wants a value behind it. Nothing where a shell's own completion of files is
/// as good. Opens no device.
std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace kmax::cli
