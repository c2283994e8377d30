#include "host_tools/kmax/terminal.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <optional>

#include "host_tools/base/interruption.hpp"

namespace kmax::cli {

namespace {
/// The next line, or what stands before the end of standard input; nothing: that has ended. `check`:
/// TerminalPrompter's. Byte by byte, past the buffers of std::cin: what they held would be an answer that
/// poll() does not see, and what they took of the next line lost.
std::optional<std::string> next_line(const std::function<void()>& check) {
  std::string line;
  for (;;) {
    check();
    // A read that waits would keep Ctrl-C from being seen.
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, 100) <= 0) continue;
    char byte = 0;
    const ssize_t got = read(STDIN_FILENO, &byte, 1);
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (got <= 0 && line.empty()) return std::nullopt;
    if (got <= 0 || byte == '\n') return line;
    line += byte;
  }
}

}  // namespace

/// While it exists, the terminal on standard input works without these flags of termios(3), local modes.
class TerminalMode {
 public:
  explicit TerminalMode(tcflag_t without) {
    if (!input_is_terminal()) return;
    // In the background a change would stop the program (SIGTTOU). -1: not the terminal that controls it.
    if (const pid_t foreground = tcgetpgrp(STDIN_FILENO); foreground != -1 && foreground != getpgrp()) return;
    if (tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios changed = before_;
    changed.c_lflag &= ~without;
    changed_ = tcsetattr(STDIN_FILENO, TCSADRAIN, &changed) == 0;
  }
  ~TerminalMode() {
    if (changed_) tcsetattr(STDIN_FILENO, TCSADRAIN, &before_);
  }
  TerminalMode(const TerminalMode&) = delete;
  TerminalMode& operator=(const TerminalMode&) = delete;

  bool changed() const { return changed_; }

 private:
  termios before_{};
  bool changed_ = false;
};

PressedKeys::PressedKeys() : mode_(std::make_unique<TerminalMode>(ICANON | ECHO)) {}
PressedKeys::~PressedKeys() = default;

bool PressedKeys::pressed(char key) {
  if (!mode_->changed()) return false;
  bool found = false;
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; poll(&input, 1, 0) > 0;) {
    char byte = 0;
    if (read(STDIN_FILENO, &byte, 1) != 1) break;
    found = found || byte == key;
  }
  return found;
}

void TerminalPrompter::ask(const std::string& what_to_do) {
  context_.note(fmt::format("{}, then press Enter", what_to_do));
  if (!next_line(check_)) throw bench::Interrupted(fmt::format("nobody answered: {}", advice_));
}

bool input_is_terminal() {
  return isatty(STDIN_FILENO) == 1;
}

std::string hidden_line(Context& context, const std::string& prompt) {
  const base::Interruption interruption;
  const bool typed = input_is_terminal();
  if (typed) context.messages() << "kmax: " << prompt << ": " << std::flush;
  // The end of the line, which did not show.
  const auto end_line = [&] {
    if (typed) context.messages() << std::endl;
  };
  std::optional<std::string> line;
  try {
    const TerminalMode echo_off(ECHO);
    line = next_line([&interruption] {
      if (interruption.requested()) throw std::runtime_error("interrupted; nothing was changed");
    });
  } catch (const std::exception&) {
    end_line();
    throw;
  }
  end_line();
  if (!line)
    throw UsageError("standard input ended before a code came; type it, or name a file with --code-file");
  return *line;
}

}  // namespace kmax::cli
