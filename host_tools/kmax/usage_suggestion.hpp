#pragma once

#include <CLI/App.hpp>

#include <string>
#include <vector>

namespace kmax::cli {

/// An option that stands before its command, "kmax --axis 0 get": where it belongs, as a whole message; empty
/// if there is none.
std::string misplaced_option_text(const CLI::App& app, const std::vector<std::string>& arguments);

/// An option that the program does not have where no command is named: a whole message; empty if there is
/// none.
std::string unknown_option_text(const CLI::App& app, const std::vector<std::string>& arguments);

/// "; did you mean --picture?" for an option that the command does not have, or for a value that is not one
/// of an option's; empty if nothing is close.
std::string usage_suggestion(const CLI::App& app, const CLI::ParseError& error,
                             const std::vector<std::string>& arguments);

}  // namespace kmax::cli
