#pragma once

#include <string>

#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

/// A line that nobody shall see: from standard input, where a terminal is told not to show what is typed and
/// `prompt` is shown on the messages' stream; from anything else it is read without a word. Errors:
/// std::runtime_error when it is interrupted; UsageError when standard input ends before a line.
std::string hidden_line(Context& context, const std::string& prompt);

/// Whether somebody types.
bool input_is_terminal();

}  // namespace kmax::cli
