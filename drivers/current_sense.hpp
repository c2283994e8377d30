#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/analog_converter.hpp"

// Phase current from the code of a shunt amplifier: low-side shunt, amplifier with a mid-point output,
// converter with the same reference. Arithmetic alone; who converts is not its business.
//
// Sign: the amplifier's output is reference/2 - gain (V_SN - V_SP) with SP at the power ground and SN at the
// FET (DRV8301 data sheet, current sense amplifiers; ODrive v3.5 schematic). Current that leaves the board
// into the motor comes up from ground through the shunt, so a code above the mid-point is positive current
// into the motor.
//
//   current = (code - offset) * reference / (4096 * gain * shunt)
//
// The offset may be 4 mV at the amplifier's input (DRV8301; a guess, its data sheet was not at hand; ODrive
// accepts 3 mV) and drifts with the temperature, so it is measured (OffsetCalibration) and then tracked.
//
// Range and resolution with 0.5 mOhm and 3.3 V, amplifier used within +-1.35 V of its middle:
//   gain 10: +-270 A, 161 mA per code    gain 40: +-67.5 A, 40.3 mA per code
//   gain 20: +-135 A, 80.6 mA per code   gain 80: +-33.75 A, 20.1 mA per code

namespace kmax::drivers {

enum class CurrentSenseGain : std::uint8_t { x10, x20, x40, x80 };

constexpr float gain_factor(CurrentSenseGain gain) {
  return static_cast<float>(10U << static_cast<unsigned>(gain));
}

struct CurrentSenseConfig {
  float shunt_ohm;  // above 0
  CurrentSenseGain gain;
};

class CurrentSense {
 public:
  static constexpr float middle_code = 2048.0F;
  static constexpr float reference_volt =
      static_cast<float>(converter_reference);  ///< of the converter and of the amplifier

  /// Two divisions: not for the interrupt path.
  constexpr explicit CurrentSense(const CurrentSenseConfig& config)
      : amperes_per_code_(reference_volt / static_cast<float>(converter_codes) /
                          (gain_factor(config.gain) * config.shunt_ohm)) {}

  /// The code at zero current, from OffsetCalibration.
  constexpr void set_offset(float code) { offset_ = origin_ = code; }
  /// Once a millisecond, with a code that no current made. `after`: calls since driving began or ended, which
  /// moves an amplifier's zero at once: a mean of what has come since, and from the 252nd on a time constant
  /// of 0.26 s, for what the temperature does. 16 codes at most are taken for real, each time and until the
  /// 252nd call all together, 0.16 mV at a gain of 80: a few codes of something else do no harm, and what is
  /// no zero is left for those to see who judge the currents.
  constexpr void track_offset(std::uint32_t code, unsigned after) {
    constexpr float most = 16.0F;
    constexpr unsigned first = 4, last = 256;
    constexpr auto bounded = [](float value, float middle) {
      const float high = middle + most, low = middle - most;
      return value > high ? high : value < low ? low : value;
    };
    if (after == 0) origin_ = offset_;
    const bool settles = after < last - first;
    const float off = bounded(static_cast<float>(code) - offset_, 0.0F);
    offset_ += off / static_cast<float>(settles ? after + first : last);
    if (settles) offset_ = bounded(offset_, origin_);
  }
  constexpr float offset() const { return offset_; }
  /// The same in A.
  constexpr float offset_amperes() const { return (offset_ - middle_code) * amperes_per_code_; }

  /// A, positive into the motor. One conversion, one subtraction, one multiplication.
  constexpr float ISR_amperes(std::uint32_t code) const {
    return (static_cast<float>(code) - offset_) * amperes_per_code_;
  }

  /// The true current may be anything beyond what the code says: treat it as over-current. A code below the
  /// lowest wraps, so one comparison is enough.
  constexpr bool ISR_saturated(std::uint32_t code) const {
    return code - lowest_linear_code > highest_linear_code - lowest_linear_code;
  }

  /// The largest current that reads without saturation in both directions, A.
  constexpr float range() const {
    const float up = (static_cast<float>(highest_linear_code) - offset_) * amperes_per_code_;
    const float down = (offset_ - static_cast<float>(lowest_linear_code)) * amperes_per_code_;
    return up < down ? up : down;
  }

 private:
  /// Codes outside say nothing about the current any more: the amplifier is linear from 0.3 V to 3.0 V.
  static constexpr std::uint32_t lowest_linear_code = 373, highest_linear_code = 3723;

  float amperes_per_code_;
  float offset_ = middle_code;
  float origin_ = middle_code;  ///< the offset when driving last began or ended
};

namespace detail {
/// By gain, as CurrentSenseGain counts them; made by the compiler.
inline constexpr std::size_t gains = 4;
inline constexpr auto offset_window = [] {
  constexpr float input_offset_volt = 0.004F,
                  codes_per_volt = static_cast<float>(converter_codes) / CurrentSense::reference_volt;
  std::array<std::uint16_t, gains> codes{};
  for (unsigned gain = 0; gain < gains; ++gain) {
    const float off = input_offset_volt * gain_factor(static_cast<CurrentSenseGain>(gain)) * codes_per_volt;
    codes[gain] = static_cast<std::uint16_t>(off + 15.5F);
  }
  return codes;
}();
}  // namespace detail

/// How far the code at zero current may lie from the middle: 4 mV at the amplifier's input, and 15 codes that
/// the middle of the reference and the converter may be off by. 64, 114, 213 and 412 codes.
constexpr std::uint16_t offset_window(CurrentSenseGain gain) {
  return detail::offset_window[static_cast<std::size_t>(gain)];
}

/// The largest gain, and so the finest step, with which this current (A) is read without saturation, whatever
/// the offset; x10 when none is. Divides: not for the interrupt path.
constexpr CurrentSenseGain gain_for_current(float largest_current, float shunt_ohm) {
  const auto reads = [=](CurrentSenseGain gain) {
    CurrentSense sense{{.shunt_ohm = shunt_ohm, .gain = gain}};
    sense.set_offset(CurrentSense::middle_code + static_cast<float>(offset_window(gain)));
    return sense.range() >= largest_current;
  };
  using enum CurrentSenseGain;
  return reads(x80) ? x80 : reads(x40) ? x40 : reads(x20) ? x20 : x10;
}

struct OffsetCalibrationConfig {
  std::uint8_t log2_samples = 10;  // 1024 samples: 51 ms at 20 kHz; 0 to 16
  std::uint16_t window = offset_window(CurrentSenseGain::x40);
  // Largest minus smallest code: more means that current flowed, or that the input is open.
  std::uint16_t largest_spread = 64;
};

enum class OffsetResult : std::uint8_t {
  running,               // samples are still missing
  accepted,              // offset() holds
  offset_out_of_window,  // mean too far from the mid-point: amplifier, wiring or reference
  spread_too_large,      // the current was not zero all the time
};

/// Mean of 2^n codes while no current can flow: bridge off and motor at rest, or all low sides on. One per
/// phase.
class OffsetCalibration {
 public:
  constexpr explicit OffsetCalibration(const OffsetCalibrationConfig& config = {}) : config_(config) {
    if (config_.log2_samples > 16) config_.log2_samples = 16;  // the sum of 2^16 codes has 28 bits
    // 2^-n exactly, without a division at run time.
    scale_ = 1.0F;
    for (unsigned i = 0; i < config_.log2_samples; ++i) scale_ *= 0.5F;
    restart();
  }

  constexpr void restart() {
    sum_ = 0;
    remaining_ = 1U << config_.log2_samples;
    smallest_ = 0xFFFF;
    largest_ = 0;
    result_ = OffsetResult::running;
  }

  constexpr void restart(std::uint16_t window) {
    config_.window = window;
    restart();
  }

  /// Once per sample of the phase; without effect when the result stands.
  constexpr OffsetResult ISR_add(std::uint32_t code) {
    if (result_ != OffsetResult::running) return result_;
    sum_ += code;
    if (code < smallest_) smallest_ = code;
    if (code > largest_) largest_ = code;
    if (--remaining_ == 0) result_ = judge();
    return result_;
  }

  constexpr OffsetResult result() const { return result_; }
  /// Mean code; also after a refusal, to be shown. 0 while running.
  constexpr float offset() const {
    return result_ == OffsetResult::running ? 0.0F : static_cast<float>(sum_) * scale_;
  }
  constexpr std::uint32_t spread() const { return largest_ < smallest_ ? 0 : largest_ - smallest_; }

 private:
  constexpr OffsetResult judge() const {
    // Spread first: a mean of changing currents is no offset, wherever it lies.
    if (largest_ - smallest_ > config_.largest_spread) return OffsetResult::spread_too_large;
    const float distance = static_cast<float>(sum_) * scale_ - CurrentSense::middle_code;
    const auto window = static_cast<float>(config_.window);
    return distance > window || distance < -window ? OffsetResult::offset_out_of_window
                                                   : OffsetResult::accepted;
  }

  OffsetCalibrationConfig config_;
  float scale_ = 1.0F;
  std::uint32_t sum_ = 0;
  std::uint32_t remaining_ = 0;
  std::uint32_t smallest_ = 0xFFFF;
  std::uint32_t largest_ = 0;
  OffsetResult result_ = OffsetResult::running;
};

}  // namespace kmax::drivers
