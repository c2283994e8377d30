#include "host_tools/base/progress.hpp"

#include <algorithm>

#include "host_tools/base/terminal_text.hpp"

namespace kmax::base {

Progress::Progress(std::ostream& messages)
    : messages_(messages), terminal_(terminal_behind(messages).has_value()) {}

Progress::~Progress() {
  make_room();
}

void Progress::make_room() {
  if (shown_) messages_ << "\r\x1b[K" << std::flush;  // ECMA-48 EL
  shown_ = false;
  if (on_terminal_ == this) on_terminal_ = nullptr;
}

void Progress::show(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < (terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(2000))) return;
  last_ = now;
  if (!terminal_) {
    messages_ << "kmax: " << text << std::endl;
    return;
  }
  // Asked each time, since the terminal may have been resized. The last column stays free: some wrap there.
  const TerminalSize size = terminal_behind(messages_).value_or(TerminalSize{});
  messages_ << '\r' << beginning(text, size.columns - 1) << "\x1b[K" << std::flush;
  shown_ = true;
  on_terminal_ = this;
}

}  // namespace kmax::base
