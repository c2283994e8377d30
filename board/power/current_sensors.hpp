#pragma once

#include <cstdint>
#include <limits>

#include "board/power/power_stage.hpp"
#include "drivers/current_sense.hpp"

namespace kmax::board {

/// The two current sensors of an axis: their offsets, calibrated with the bridge off and tracked from then
/// on, and the currents of the last tick.
///
/// Contexts: ISR_ functions the tick, all others the main loop; restart_calibration() and take_calibration()
/// while ISR_calibrate() is not called.
class CurrentSensors {
 public:
  constexpr explicit CurrentSensors(float shunt_ohm)
      : sense_b_({shunt_ohm, drivers::CurrentSenseGain::x80}), sense_c_(sense_b_), shunt_ohm_(shunt_ohm) {}

  bool ISR_saturated(std::uint32_t code_b, std::uint32_t code_c) const {
    return sense_b_.ISR_saturated(code_b) || sense_c_.ISR_saturated(code_c);
  }
  float ISR_amperes_b(std::uint32_t code) const { return sense_b_.ISR_amperes(code); }
  float ISR_amperes_c(std::uint32_t code) const { return sense_c_.ISR_amperes(code); }
  /// A sample that is valid counts in the calibration.
  void ISR_calibrate(bool valid, std::uint32_t code_b, std::uint32_t code_c) {
    if (!valid) return;
    offset_b_.ISR_add(code_b);
    offset_c_.ISR_add(code_c);
  }

  void restart_calibration(drivers::CurrentSenseGain gain) {
    sense_b_ = sense_c_ = drivers::CurrentSense{{.shunt_ohm = shunt_ohm_, .gain = gain}};
    for (auto* offset : {&offset_b_, &offset_c_}) offset->restart(drivers::offset_window(gain));
  }
  OffsetProgress calibration_progress() const {
    const auto b = offset_b_.result(), c = offset_c_.result();
    using enum drivers::OffsetResult;
    if (b == running || c == running) return OffsetProgress::running;
    return b == accepted && c == accepted ? OffsetProgress::accepted : OffsetProgress::refused;
  }
  void take_calibration() {
    sense_b_.set_offset(offset_b_.offset());
    sense_c_.set_offset(offset_c_.offset());
  }
  /// Once a millisecond, with codes that no current made. False: an offset has left its window.
  /// `driven`: the bridge is on, which moves the offsets at once.
  bool track_offsets(std::uint32_t code_b, std::uint32_t code_c, drivers::CurrentSenseGain gain,
                     bool driven) {
    if (driven != tracked_driven_) tracked_for_ = 0;
    tracked_driven_ = driven;
    sense_b_.track_offset(code_b, tracked_for_);
    sense_c_.track_offset(code_c, tracked_for_);
    if (tracked_for_ < std::numeric_limits<std::uint16_t>::max()) ++tracked_for_;
    const auto window = static_cast<float>(drivers::offset_window(gain));
    const auto within = [window](const drivers::CurrentSense& sense) {
      const float off = sense.offset() - drivers::CurrentSense::middle_code;
      return off <= window && off >= -window;
    };
    return within(sense_b_) && within(sense_c_);
  }
  /// A, what is taken off.
  float offset_b() const { return sense_b_.offset_amperes(); }
  float offset_c() const { return sense_c_.offset_amperes(); }

 private:
  drivers::CurrentSense sense_b_, sense_c_;
  drivers::OffsetCalibration offset_b_{}, offset_c_{};
  bool tracked_driven_ = false;
  std::uint16_t tracked_for_ = 0;  ///< ms since driving began or ended
  float shunt_ohm_;
};

}  // namespace kmax::board
