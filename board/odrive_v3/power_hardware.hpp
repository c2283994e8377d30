#pragma once

#include "board/odrive_v3/drives.hpp"
#include "board/odrive_v3/gate_drivers.hpp"
#include "board/odrive_v3/pins.hpp"
#include "board/odrive_v3/power_stage.hpp"

namespace kmax::board::odrive_v3 {

/// The lines and chips behind the power stage's sequence (PowerStageHardware).
class PowerHardware {
 public:
  PowerHardware(Drives& drives, ChipBus& bus) : drives_(drives), gate_drivers_(bus) {}

  void set_gate_enable(bool level) { pin(pins::gate_enable).write(level); }
  bool fault_line_low() const { return !pin(pins::gate_driver_fault).read(); }
  /// The contact to ground is closed while all is well; an open line is pulled up.
  bool emergency_stop_open() const { return pin(pins::emergency_stop).read(); }

  bool configure_gate_driver(std::size_t axis) {
    configured_gain_ = drives_.gain();
    return gate_drivers_.configure(axis, configured_gain_);
  }
  void restart_offset_calibration() { drives_.restart_offset_calibration(); }
  OffsetProgress offset_progress() { return drives_.offset_progress(); }

  bool gain_has_changed() const { return configured_gain_ != drives_.gain(); }
  void show_healthy(bool healthy) { pin(pins::healthy).write(healthy); }

 private:
  static drivers::stm32f4::GpioPin<> pin(PinLocation location) {
    return {drivers::stm32f4::gpio(location.port), location.number};
  }

  Drives& drives_;
  GateDrivers gate_drivers_;
  drivers::CurrentSenseGain configured_gain_ = drivers::CurrentSenseGain::x80;
};
static_assert(PowerStageHardware<PowerHardware>);

}  // namespace kmax::board::odrive_v3
