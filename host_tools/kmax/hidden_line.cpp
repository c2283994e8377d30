#include "host_tools/kmax/hidden_line.hpp"

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>

#include "host_tools/base/interruption.hpp"

namespace kmax::cli {

namespace {
/// While it exists, the terminal does not show what is typed.
class EchoOff {
 public:
  EchoOff() {
    if (tcgetattr(STDIN_FILENO, &before_) != 0) return;
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

// Byte by byte: what a buffer took of the next line would be lost.
std::string line_of_input(const Interruption& interruption) {
  std::string line;
  for (;;) {
    if (interruption.requested()) throw std::runtime_error("interrupted; nothing was changed");
    // A read that waits would keep Ctrl-C from being seen.
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, 100) <= 0) continue;
    char byte = 0;
    const ssize_t got = read(STDIN_FILENO, &byte, 1);
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (got <= 0 && line.empty())
      throw UsageError("standard input ended before a code came; type it, or name a file with --code-file");
    if (got <= 0 || byte == '\n') return line;
    line += byte;
  }
}
}  // namespace

bool input_is_terminal() {
  return isatty(STDIN_FILENO) == 1;
}

std::string hidden_line(Context& context, const std::string& prompt) {
  const Interruption interruption;
  if (!input_is_terminal()) return line_of_input(interruption);
  std::string line;
  context.messages() << "kmax: " << prompt << ": " << std::flush;
  {
    const EchoOff echo_off;
    line = line_of_input(interruption);
  }
  context.messages() << std::endl;  // the one that was typed did not show
  return line;
}

}  // namespace kmax::cli
