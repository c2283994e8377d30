#include "host_tools/kmax/terminal_prompter.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <iostream>
#include <stdexcept>

namespace kmax::cli {

void TerminalPrompter::ask(const std::string& what_to_do) {
  context_.note(fmt::format("{}, then press Enter", what_to_do));
  // A read that waits would keep Ctrl-C from being seen.
  pollfd input{STDIN_FILENO, POLLIN, 0};
  while (std::cin.rdbuf()->in_avail() <= 0) {
    if (poll(&input, 1, 100) > 0) break;
    check_();
  }
  std::string line;
  if (!std::getline(std::cin, line))
    throw std::runtime_error(
        "nobody answered: somebody must be at the terminal, or --no-prompt be given for a simulated person");
}

}  // namespace kmax::cli
