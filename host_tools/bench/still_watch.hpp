#pragma once
/// Whether an encoder stands for longer than a handle that is moved by the motor ever does.

#include <chrono>
#include <cmath>

namespace kmax::bench {

/// How long an encoder may count nothing, s. 0: for ever.
struct StillLimits {
  double from_start = 0.0;    ///< while it has not counted since the excitation's start
  double after_motion = 0.0;  ///< once it has: a free handle that has begun to swing goes on

  bool any() const { return from_start > 0.0 || after_motion > 0.0; }
};

class StillWatch {
 public:
  using Time = std::chrono::microseconds;

  /// Watches nothing.
  StillWatch() = default;
  StillWatch(const StillLimits& limits, double count, Time now)
      : limits_(limits), start_count_(count), count_(count), since_(now) {}

  bool active() const { return limits_.any(); }

  /// A look at the encoder, `velocity` in m/s. Whether it has stood for longer than allowed.
  bool stands(double count, double velocity, Time now) {
    if (std::abs(count - start_count_) >= clear_motion) moved_ = true;
    if (std::abs(count - count_) >= fewest_counts || std::abs(velocity) > slowest) {
      count_ = count;
      since_ = now;
    }
    const double limit = moved_ ? limits_.after_motion : limits_.from_start;
    return limit > 0.0 && std::chrono::duration<double>(now - since_).count() > limit;
  }

 private:
  static constexpr double fewest_counts = 2.0, clear_motion = 10.0;
  static constexpr double slowest = 0.002;  // m/s

  StillLimits limits_{};
  double start_count_ = 0.0, count_ = 0.0;
  Time since_{};
  bool moved_ = false;
};

}  // namespace kmax::bench
