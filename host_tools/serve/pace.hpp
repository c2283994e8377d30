#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace kmax::serve {

/// How far simulated time may go to keep up with the real clock, which is the caller's.
///
/// Whoever is held up catches up as long as it is less than 50 ms behind; beyond, the simulated time stands
/// still for the rest and that is counted.
class Pace {
 public:
  using Time = std::chrono::nanoseconds;

  /// `say` (may be empty) gets a sentence once, when the simulated time has gone at less than 80 % of the
  /// real time for 5 s. A single hold-up, such as a computer that slept, is no slow machine: it counts as
  /// half a second at most.
  explicit Pace(std::function<void(const std::string&)> say = {}) : say_(std::move(say)) {}

  /// So much real time has passed, >= 0.
  void passed(Time real);
  /// Simulated time that is to be run, 0 to 50 ms.
  Time due() const { return due_; }
  /// So much of it has been run, at most due().
  void ran(Time simulated) { due_ -= simulated; }
  /// Simulated time is being held, as by a reset: nothing is due.
  void hold() { due_ = {}; }

  /// Real time that was given up because this machine was too slow or held up, s.
  double behind_s() const { return std::chrono::duration<double>(given_up_).count(); }

 private:
  void watch(Time real, Time given_up);

  std::function<void(const std::string&)> say_;
  Time due_{}, given_up_{};
  Time watched_{}, given_up_meanwhile_{};
};

}  // namespace kmax::serve
