#pragma once

#include <atomic>
#include <cstdint>

#include "control/brake_chopper.hpp"
#include "firmware/application.hpp"

namespace kmax::board {

/// When the brake resistor is on. ISR_ functions: the first axis' tick.
class BrakeResistor {
 public:
  /// Motors brake while they are driven and a moment after; a supply that is too high for longer is not
  /// theirs.
  static constexpr std::uint32_t ticks_after_driving = firmware::tick_rate_hz / 5;

  bool ISR_on() const { return on_; }
  bool ISR_update(const control::BrakeChopper::Coefficients& coefficients, float supply_voltage,
                  bool driving) {
    if (driving) {
      may_brake_for_ = ticks_after_driving;
    } else if (may_brake_for_ != 0) {
      --may_brake_for_;
    }
    const bool wanted = chopper_.update(coefficients, supply_voltage);
    return on_ = wanted && may_brake_for_ != 0 && !inhibited_.load(std::memory_order_relaxed);
  }
  /// Main loop.
  void inhibit(bool inhibited) { inhibited_.store(inhibited, std::memory_order_relaxed); }

 private:
  control::BrakeChopper chopper_;
  std::atomic<bool> inhibited_{false};
  bool on_ = false;
  std::uint32_t may_brake_for_ = 0;
};

}  // namespace kmax::board
