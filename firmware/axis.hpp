#pragma once

#include <atomic>
#include <cstdint>

#include "control/count_extender.hpp"
#include "control/haptic_loop.hpp"
#include "firmware/fault.hpp"

namespace kmax::firmware {

/// What the tick of one axis works by; made in the main loop, handed over whole.
struct AxisSetting {
  control::HapticLoop<float>::Coefficients haptic{};
  std::int32_t encoder_offset = 0;     ///< counts
  std::int32_t encoder_direction = 1;  ///< +1 or -1
  std::uint32_t generation = 0;        ///< differs from the last one: estimators start afresh
};

/// What the tick of one axis tells the main loop.
struct AxisReport {
  control::HapticLoop<float>::Output haptic{};
  std::int64_t counted = 0;  ///< the encoder's extended count, before offset and direction
  std::uint32_t tick = 0;
  std::uint32_t generation = 0;  ///< of the setting it was computed with
  std::uint32_t armed_samples = 0, limited_samples = 0;
  Fault fault = Fault::none;  ///< kept until the axis has been disabled
  float fault_value = 0.0f;
  bool enabled = false;      ///< as the main loop had asked
  bool count_valid = false;  ///< the encoder's last count
};

/// One axis in the tick: from encoder counter to force, with the trips that must act at once.
///
/// A trip removes the force in the tick that finds it and stays until enabled has been seen false: the main
/// loop disables the axis when it reads the fault, so force never comes back by itself.
class Axis {
 public:
  struct Input {
    std::uint32_t count;  ///< free-running, wraps at 2^32
    bool count_valid;
  };
  struct Output {
    float force;             ///< N along +x; 0 unless enabled
    float tangential_force;  ///< N, to be made by the other axis
    float background_force;  ///< N, the field's share of the force while enabled, outwards
    bool enabled;
  };

  Output ISR_tick(const AxisSetting& setting, const Input& input, bool enable, float external_force,
                  std::uint32_t tick) {
    if (!enable) trip_ = Fault::none;
    if (input.count_valid && !started_) {
      // What the counter held before its first valid count means nothing, and neither does the jump to it.
      extender_.reset(input.count);
      loop_.reset();
      started_ = true;
    }
    if (input.count_valid) report_.counted = extender_.update(input.count);
    if (generation_ != setting.generation) {
      generation_ = setting.generation;
      loop_.reset();
    }
    const bool was_enabled = enable && trip_ == Fault::none;
    const std::int64_t position = position_of(report_.counted, setting);
    const auto& out = loop_.tick(setting.haptic, position, was_enabled && input.count_valid, external_force);
    if (was_enabled) {
      if (!input.count_valid) {
        trip(Fault::encoder, 0.0f);
      } else if (out.not_finite) {
        trip(Fault::not_finite, out.velocity);
      } else if (out.over_speed) {
        trip(Fault::over_speed, out.velocity);
      }
    }
    count_samples(out, enable);
    report_.haptic = out;
    report_.tick = tick;
    report_.generation = generation_;
    report_.fault = trip_;
    report_.fault_value = trip_value_;
    report_.enabled = enable;
    report_.count_valid = input.count_valid;
    const bool driving = was_enabled && trip_ == Fault::none;
    if (!driving) return {0.0f, 0.0f, 0.0f, false};
    return {out.force, out.tangential_force, out.magnetic_force, true};
  }

  /// A fault found outside: no force from the next ISR_tick() on, until the axis has been disabled.
  void ISR_trip(Fault fault) {
    if (trip_ == Fault::none) trip(fault, 0.0f);
  }

  /// Where an encoder count is on the handle's axis, counts.
  static constexpr std::int64_t position_of(std::int64_t counted, const AxisSetting& setting) {
    const std::int64_t moved = counted - setting.encoder_offset;
    return setting.encoder_direction < 0 ? -moved : moved;
  }

  /// Valid until the next tick; interrupt context.
  const AxisReport& ISR_report() const { return report_; }

 private:
  void trip(Fault fault, float value) {
    trip_ = fault;
    trip_value_ = value;
  }

  void count_samples(const control::HapticLoop<float>::Output& out, bool enable) {
    if (!enable) {
      was_counting_ = false;
      return;
    }
    if (!was_counting_) {
      report_.armed_samples = report_.limited_samples = 0;
      was_counting_ = true;
    }
    if (!out.new_sample) return;
    ++report_.armed_samples;
    if (out.limited) ++report_.limited_samples;
  }

  control::CountExtender<std::uint32_t> extender_;
  control::HapticLoop<float> loop_;
  AxisReport report_;
  std::uint32_t generation_ = 0;
  float trip_value_ = 0.0f;
  Fault trip_ = Fault::none;
  bool started_ = false, was_counting_ = false;
};

}  // namespace kmax::firmware
