#pragma once

#include <kmax/export.hpp>

#include <string>
#include <utility>
#include <vector>

namespace kmax {

/// How a command ended that gives a verdict.
struct CommandResult {
  bool verdict = true;     ///< false: it ran, and its answer is "no"
  std::string document{};  ///< JSON, as `kmax ... --json` prints it
};

/// Runs a command of the command line in this process, without a device or on a simulated one of its own:
/// {"experiment", "jitter", "--touches", "3"}, {"describe", "--format", "json"}. What it says on the way goes
/// to standard error. Ctrl-C is caught meanwhile and becomes Interrupted. One at a time.
/// Errors: as Device; Interrupted.
KMAX_API CommandResult run_command(const std::vector<std::string>& arguments);

}  // namespace kmax
