#pragma once

#include <chrono>
#include <cstddef>
#include <ostream>
#include <string>

namespace kmax::cli {

/// One line that says how far something is, on the messages' stream: rewritten in place on a terminal, at
/// most five times a second; elsewhere a line every two seconds.
class Progress {
 public:
  explicit Progress(std::ostream& messages);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(const std::string& text);

  /// Before another message on the same stream: blanks the line.
  void make_room();

 private:
  std::ostream& messages_;
  bool terminal_;
  std::chrono::steady_clock::time_point last_{};
  std::size_t width_ = 0;
};

}  // namespace kmax::cli
