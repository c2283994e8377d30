#pragma once

#include <chrono>
#include <ostream>
#include <string>

namespace kmax::base {

/// One line that says how far something is, on the messages' stream: rewritten in place on a terminal, cut to
/// its width, at most five times a second; elsewhere a line every two seconds.
class Progress {
 public:
  explicit Progress(std::ostream& messages);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(const std::string& text);

  /// Before anything else is written to the terminal: blanks the line.
  void make_room();
  /// The same of the one that is shown there now, if any: whoever writes may not know of it.
  static void make_room_on_terminal() {
    if (on_terminal_ != nullptr) on_terminal_->make_room();
  }

 private:
  std::ostream& messages_;
  bool terminal_;
  std::chrono::steady_clock::time_point last_{};
  bool shown_ = false;
  inline static Progress* on_terminal_ = nullptr;  ///< a process has one terminal
};

}  // namespace kmax::base
