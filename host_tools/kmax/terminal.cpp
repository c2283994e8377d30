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

/// While it exists, the terminal does not show what is typed.
class EchoOff {
 public:
  EchoOff() {
    if (!input_is_terminal() || tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios quiet = before_;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    changed_ = tcsetattr(STDIN_FILENO, TCSADRAIN, &quiet) == 0;
  }
  ~EchoOff() {
    if (changed_) tcsetattr(STDIN_FILENO, TCSADRAIN, &before_);
  }
  EchoOff(const EchoOff&) = delete;
  EchoOff& operator=(const EchoOff&) = delete;

 private:
  termios before_{};
  bool changed_ = false;
};
}  // namespace

void TerminalPrompter::ask(const std::string& what_to_do) {
  context_.note(fmt::format("{}, then press Enter", what_to_do));
  if (!next_line(check_)) throw bench::Interrupted(fmt::format("nobody answered: {}", advice_));
}

bool input_is_terminal() {
  return isatty(STDIN_FILENO) == 1;
}

std::string hidden_line(Context& context, const std::string& prompt) {
  const Interruption interruption;
  const bool typed = input_is_terminal();
  if (typed) context.messages() << "kmax: " << prompt << ": " << std::flush;
  std::optional<std::string> line;
  {
    const EchoOff echo_off;
    line = next_line([&interruption] {
      if (interruption.requested()) throw std::runtime_error("interrupted; nothing was changed");
    });
  }
  if (!line)
    throw UsageError("standard input ended before a code came; type it, or name a file with --code-file");
  if (typed) context.messages() << std::endl;  // the one that was typed did not show
  return *line;
}

}  // namespace kmax::cli
