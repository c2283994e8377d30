#pragma once

#include <cstdint>

namespace kmax::drivers {

/// What is to be done once in an interval, by a main loop that comes by more often.
///
/// Due at the first call, unless the clock is within an interval of its wrap, and then once in each interval,
/// counted from the call that was due before: a loop that comes by a little less often than the interval
/// leaves none out. One that comes late by a whole interval counts from then on.
///
/// `now_us`: microseconds, wraps at 2^32; call it at least once an hour. Cost: a load, a subtraction and a
/// compare. Main loop only.
class PeriodicTimer {
 public:
  explicit constexpr PeriodicTimer(std::uint32_t interval_us)
      : interval_us_(interval_us), last_us_(0U - interval_us) {}

  bool due(std::uint32_t now_us) {
    const std::uint32_t elapsed_us = now_us - last_us_;
    if (elapsed_us < interval_us_) return false;
    last_us_ = elapsed_us < 2 * interval_us_ ? last_us_ + interval_us_ : now_us;
    return true;
  }

 private:
  std::uint32_t interval_us_, last_us_;
};

}  // namespace kmax::drivers
