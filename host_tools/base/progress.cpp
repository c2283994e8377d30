#include "host_tools/base/progress.hpp"

#include <unistd.h>

#include <iostream>

namespace kmax::cli {

Progress::Progress(std::ostream& messages)
    : messages_(messages), terminal_(&messages == &std::cerr && isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  make_room();
}

void Progress::make_room() {
  if (width_ > 0) messages_ << '\r' << std::string(width_, ' ') << '\r' << std::flush;
  width_ = 0;
}

void Progress::show(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < (terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(2000))) return;
  last_ = now;
  if (!terminal_) {
    messages_ << "kmax: " << text << std::endl;
    return;
  }
  const std::string blank(width_ > text.size() ? width_ - text.size() : 0, ' ');
  messages_ << '\r' << text << blank << std::flush;
  width_ = text.size();
}

}  // namespace kmax::cli
