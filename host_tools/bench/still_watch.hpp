#pragma once
/// Whether an encoder stands for longer than a handle that is moved by the motor ever does.

#include <algorithm>
#include <chrono>
#include <cmath>

namespace kmax::bench {

/// How long an encoder may count nothing, s. 0: for ever.
struct StillLimits {
  double from_start = 0.0;  ///< while it has not counted since the excitation's start
  double after_motion =
      0.0;               ///< once it has moved by `motion`: a free handle that has begun to swing goes on
  double motion = 10.0;  ///< counts; what a handle slides by into a detent, and stays there, is less

  bool any() const { return from_start > 0.0 || after_motion > 0.0; }
};

class StillWatch {
 public:
  using Time = std::chrono::microseconds;

  /// Watches nothing.
  StillWatch() = default;
  StillWatch(const StillLimits& limits, double count, Time now)
      : limits_(limits), start_count_(count), lowest_(count), highest_(count), since_(now) {}

  bool active() const { return limits_.any(); }

  /// A look at the encoder, `velocity` in m/s. Whether it has stood for longer than allowed, by four looks at
  /// least.
  bool stands(double count, double velocity, Time now) {
    if (std::abs(count - start_count_) >= limits_.motion) moved_ = true;
    ++looks_;
    lowest_ = std::min(lowest_, count);
    highest_ = std::max(highest_, count);
    if (highest_ - lowest_ >= fewest_counts || std::abs(velocity) > slowest) {
      lowest_ = highest_ = count;
      since_ = now;
      looks_ = 0;
    }
    const double limit = moved_ ? limits_.after_motion : limits_.from_start;
    return limit > 0.0 && looks_ >= fewest_looks &&
           std::chrono::duration<double>(now - since_).count() > limit;
  }

  /// The last look has found a handle standing that should swing: it may have met it where it turns back. To
  /// be looked at again soon, at times that keep step with no swing.
  bool doubtful() const { return moved_ && limits_.after_motion > 0.0 && looks_ > 0; }

 private:
  static constexpr double fewest_counts = 2.0;
  static constexpr double slowest = 0.002;  // m/s
  static constexpr int fewest_looks = 4;

  StillLimits limits_{};
  double start_count_ = 0.0;
  double lowest_ = 0.0, highest_ = 0.0;  // counts since the last motion
  Time since_{};
  int looks_ = 0;  // that have found it standing, one after the other
  bool moved_ = false;
};

}  // namespace kmax::bench
