#pragma once

namespace kmax::base {

/// While one exists, Ctrl-C (SIGINT), SIGTERM and SIGHUP do not end the program: they are remembered, so
/// that a command can leave the device in order. One at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  bool requested() const;

  /// Of the one that exists, or that existed last.
  static bool last_was_requested();
};

}  // namespace kmax::base
