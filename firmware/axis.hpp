#pragma once

#include <atomic>
#include <cstdint>

#include "control/count_extender.hpp"
#include "control/haptic_loop.hpp"
#include "firmware/fault.hpp"
#include "firmware/motor_control.hpp"

namespace kmax::firmware {

/// What the tick of one axis works by; made in the main loop, handed over whole.
struct AxisSetting {
  control::HapticLoop<float>::Coefficients haptic{};
  MotorControl::Coefficients motor{};
  float supply_voltage_min = 0.0f, supply_voltage_max = 0.0f;  ///< V
  std::int32_t encoder_offset = 0;                             ///< counts
  std::int32_t encoder_direction = 1;                          ///< +1 or -1
  std::uint32_t generation = 0;  ///< differs from the last one: estimators start afresh
};

/// What the tick of one axis tells the main loop.
struct AxisReport {
  control::HapticLoop<float>::Output haptic{};
  MotorControl::Output motor{};
  std::int64_t counted = 0;  ///< the encoder's extended count, before offset and direction
  std::uint32_t tick = 0;
  std::uint32_t generation = 0;  ///< of the setting it was computed with
  std::uint32_t armed_samples = 0, limited_samples = 0;
  Fault fault = Fault::none;      ///< kept until the axis has been disabled
  Fault condition = Fault::none;  ///< of the board: what would keep the axis from being driven now
  float fault_value = 0.0f;
  bool enabled = false;      ///< as the main loop had asked
  bool count_valid = false;  ///< the encoder's last count
};

/// One axis in the tick: from encoder counter to force and on to the motor's duty, with the trips that must
/// act at once.
///
/// A trip removes the force in the tick that finds it and stays until enabled has been seen false: the main
/// loop disables the axis when it reads the fault, so force never comes back by itself.
class Axis {
 public:
  struct Input {
    std::uint32_t count;  ///< free-running, wraps at 2^32
    bool count_valid;
    Fault condition = Fault::none;  ///< what the board has found wrong with power stage or lines
    MotorControl::Measured motor{};
  };
  struct Output {
    float force;             ///< N along +x; 0 unless enabled
    float tangential_force;  ///< N, to be made by the other axis
    float background_force;  ///< N, the field's share of the force while enabled, outwards
    bool enabled;            ///< false: the bridge must be off
    MotorControl::Output motor{};
  };

  /// Defined apart, so that it is one function in the image whose arguments and result a test can follow.
  /// The result is valid until the next call.
  const Output& ISR_tick(const AxisSetting& setting, const Input& input, bool enable, float external_force,
                         std::uint32_t tick);

  /// A fault found outside: no force from the next ISR_tick() on, until the axis has been disabled.
  void ISR_trip(Fault fault) {
    if (trip_ == Fault::none) trip(fault, 0.0f);
  }

  /// Where an encoder count is on the handle's axis, counts.
  static constexpr std::int64_t position_of(std::int64_t counted, const AxisSetting& setting) {
    const std::int64_t moved = counted - setting.encoder_offset;
    return setting.encoder_direction < 0 ? -moved : moved;
  }

  /// Of the last tick: a fault, an enable, a validity or a condition has changed. The main loop must not act
  /// on what was before.
  bool ISR_changed() const { return changed_; }
  const control::HapticLoop<float>::Output& ISR_haptic() const { return loop_.output(); }
  void ISR_fill(AxisReport& report) const;
  AxisReport ISR_report() const {
    AxisReport report;
    ISR_fill(report);
    return report;
  }

 private:
  static constexpr std::uint32_t enabled_bit = 1U << 16, count_valid_bit = 1U << 17;

  /// All that the main loop must hear of at once, in one word, since comparing words is what the tick can
  /// afford.
  static constexpr std::uint32_t state_word(Fault trip, Fault condition, bool enabled, bool count_valid) {
    return static_cast<std::uint32_t>(trip) | static_cast<std::uint32_t>(condition) << 8 |
           (enabled ? enabled_bit : 0U) | (count_valid ? count_valid_bit : 0U);
  }

  void trip(Fault fault, float value) {
    trip_ = fault;
    trip_value_ = value;
  }

  void count_samples(const control::HapticLoop<float>::Output& out, bool enable);

  control::CountExtender<std::uint32_t> extender_;
  control::HapticLoop<float> loop_;
  MotorControl motor_;
  Output output_{};
  std::int64_t counted_ = 0;
  std::uint32_t tick_ = 0, generation_ = 0;
  std::uint32_t armed_samples_ = 0, limited_samples_ = 0;
  float trip_value_ = 0.0f;
  Fault trip_ = Fault::none;
  std::uint32_t state_ = 0;  ///< of the last tick, see state_word
  bool changed_ = false;
  bool started_ = false, was_counting_ = false;
};

}  // namespace kmax::firmware
