#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "board/odrive_v3/power_stage.hpp"
#include "drivers/current_sense.hpp"
#include "drivers/supply_divider.hpp"
#include "firmware/application.hpp"
#include "host_tools/simulation/scene_drives.hpp"

namespace kmax::simulated_board {

/// What an ODrive v3.6 has between a scene's motors and its processor: shunt amplifiers and divider behind
/// 12-bit converters, gate drivers, and the lines that stop everything
/// (board::odrive_v3::PowerStageHardware).
class SimulatedPowerHardware {
 public:
  explicit SimulatedPowerHardware(simulation::SceneDrives& drives);

  /// Converts the currents of an axis that has a motor, and the supply; once in a tick.
  firmware::MotorControl::Measured measured(std::size_t axis);
  /// By the codes taken last.
  bool currents_saturated(std::size_t axis) const;
  bool supply_saturated() const { return divider_.ISR_saturated(supply_code_); }
  float supply_voltage() const { return divider_.ISR_volts(supply_code_); }
  /// degC; not a number when the sensor is broken.
  float temperature(std::size_t axis) const;

  /// The largest current that must be read, A. The amplifiers take a new gain when they are configured anew.
  void set_range(float largest_current) { gain_ = drivers::gain_for_current(largest_current); }
  drivers::CurrentSenseGain gain() const { return gain_; }
  bool gain_has_changed() const { return configured_gain_ != gain_; }

  void press_emergency_stop(bool pressed) { emergency_stop_pressed_ = pressed; }
  void set_gate_driver_fault(bool fault) { gate_driver_fault_ = fault; }

  // PowerStageHardware. The level of EN_GATE has no model of its own: while it is low no axis is armed.
  void set_gate_enable(bool) {}
  /// A fault, or a supply below what the gate drivers need.
  bool fault_line_low() const { return gate_driver_fault_ || !supply_suffices(); }
  bool emergency_stop_open() const { return emergency_stop_pressed_; }
  bool configure_gate_driver(std::size_t axis);
  void restart_offset_calibration();
  board::odrive_v3::OffsetProgress offset_progress();

 private:
  struct Sensors {
    drivers::CurrentSense sense_b{}, sense_c{};
    drivers::OffsetCalibration offset_b{}, offset_c{};
    std::uint16_t code_b = 2048, code_c = 2048;
  };

  bool supply_suffices() const;

  simulation::SceneDrives& drives_;
  std::array<Sensors, firmware::axis_count> axes_;
  drivers::SupplyDivider divider_;
  std::uint16_t supply_code_;
  drivers::CurrentSenseGain gain_ = drivers::CurrentSenseGain::x80, configured_gain_ = gain_;
  bool calibrating_ = false, emergency_stop_pressed_ = false, gate_driver_fault_ = false;
};
static_assert(board::odrive_v3::PowerStageHardware<SimulatedPowerHardware>);

}  // namespace kmax::simulated_board
