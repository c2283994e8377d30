#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

// Runs other programs: by argument vector, never through a shell.

namespace kmax::flash {

/// The program could not be started.
class ProgramError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// First executable file of this name on PATH.
std::optional<std::filesystem::path> find_program(const std::string& name);

/// As a person would type it in a shell.
std::string command_text(std::span<const std::string> arguments);

struct ProgramLimits {
  std::chrono::milliseconds at_most{300'000};
  /// What the program gets after SIGINT before SIGTERM, and after that before SIGKILL.
  std::chrono::milliseconds grace{3'000};
};

enum class ProgramEnd : std::uint8_t { exited, killed_by_signal, interrupted, timed_out };

struct ProgramResult {
  ProgramEnd end = ProgramEnd::exited;
  int code = 0;  ///< exit code or signal
  bool succeeded() const { return end == ProgramEnd::exited && code == 0; }
};

/// Runs `arguments[0]`, a path, in `folder`, with nothing on its input, and appends what it writes to `log`.
///
/// The program has a process group of its own: Ctrl-C reaches this program only, which says so by `stop`
/// and then the other one is ended in order, SIGINT first. Whatever happens, it is gone on return.
ProgramResult run_program(std::span<const std::string> arguments, const std::filesystem::path& folder,
                          const std::filesystem::path& log, const std::function<bool()>& stop,
                          const ProgramLimits& limits = {});

}  // namespace kmax::flash
