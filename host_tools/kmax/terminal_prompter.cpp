#include "host_tools/kmax/terminal_prompter.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>

namespace kmax::cli {

// Byte by byte, past the buffers of std::cin: what they held would be an answer that poll() does not see.
void TerminalPrompter::ask(const std::string& what_to_do) {
  context_.note(fmt::format("{}, then press Enter", what_to_do));
  bool begun = false;
  for (;;) {
    check_();
    // A read that waits would keep Ctrl-C from being seen.
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, 100) <= 0) continue;
    char byte = 0;
    const ssize_t got = read(STDIN_FILENO, &byte, 1);
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    // A last line without its end is an answer too.
    if (got <= 0 && begun) return;
    if (got <= 0) throw bench::Interrupted(fmt::format("nobody answered: {}", advice_));
    if (byte == '\n') return;
    begun = true;
  }
}

}  // namespace kmax::cli
