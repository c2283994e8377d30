#pragma once

#include <string>
#include <vector>

#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

/// The whole program behind main(): parses the arguments (without the program's name), runs the command,
/// turns what is thrown into a message and an exit code.
int run(std::vector<std::string> arguments, Context& context);

}  // namespace kmax::cli
