#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "board/power/power.hpp"
#include "drivers/drv8301_registers.hpp"
#include "drivers/stm32f4/current_sampling.hpp"
#include "host_tools/simulated_board/simulated_bridge.hpp"
#include "host_tools/simulation/scene_drives.hpp"

namespace kmax::simulated_board {

/// The AS5047P of a scene, whichever axis it is mounted on (as board::SerialEncoder). Its angle is that of
/// the tick itself, and its count begins within one turn; a chip that is not there does not answer.
class SimulatedSerialEncoder {
 public:
  struct Sample {
    std::uint32_t count = 0;
    bool valid = false;
    std::uint32_t reference_generation = 0;
  };

  explicit SimulatedSerialEncoder(const simulation::SceneDrives& drives) : drives_(drives) {}

  void ISR_select() {}
  static constexpr bool ISR_selected() { return false; }
  void ISR_begin() {}
  Sample ISR_take();
  bool under_way() const { return false; }
  void ISR_abandon() {}
  void restart() {}
  void restart_without_turns();

 private:
  const simulation::SceneDrives& drives_;
  Sample sample_;
  bool started_ = false;
  std::int64_t turns_before_ = 0;
};

/// What an ODrive v3.6 has between a scene's motors and its processor: bridges, encoder inputs, shunt
/// amplifiers and divider behind 12-bit converters, gate drivers, and the lines that stop everything
/// (board::MotorHardware).
///
/// Quadrature lines that are pulled up stand still and look valid, unless the index line tells
/// (drivers::QuadratureIndexWatch). They are counted in 32 bits, since a scene's handle may start anywhere.
class SimulatedPowerHardware {
 public:
  static constexpr const board::BoardDescription& description = board::odrive_v3::description;

  /// Codes of an axis' last conversion.
  struct Sample {
    static constexpr bool valid = true;
    static constexpr std::uint8_t slow_age = 0;
    std::uint16_t phase_b = 2048, phase_c = 2048, supply = 0;
  };

  explicit SimulatedPowerHardware(simulation::SceneDrives& drives);

  void press_emergency_stop(bool pressed) { emergency_stop_pressed_ = pressed; }
  void set_gate_driver_fault(bool fault) { gate_driver_fault_ = fault; }
  SimulatedBridge& simulated_bridge(std::size_t axis) { return bridges_[axis]; }

  // board::DriveHardware.
  bool has(std::size_t axis) const { return drives_.has(axis); }
  drivers::stm32f4::ThreePhasePwm<>& bridge(std::size_t axis) { return bridges_[axis].pwm(); }
  /// Converts the currents of an axis that has a motor, and the supply; once in a tick.
  const Sample& ISR_sample(std::size_t axis);
  drivers::stm32f4::ZeroCurrentCodes zero_current(std::size_t axis);
  std::uint32_t ISR_counter(std::size_t axis) const;
  bool ISR_index_line(std::size_t axis) const;
  SimulatedSerialEncoder& serial_encoder() { return serial_encoder_; }
  void set_brake(bool on);
  std::uint16_t supply_code() const { return supply_code_; }
  std::uint16_t temperature_code(std::size_t axis) const;
  static constexpr std::uint32_t missed_ticks() { return 0; }

  // board::MotorHardware. Of EN_GATE only its rise has a model: while it is low no axis is armed.
  void set_gate_enable(bool high);
  /// A fault, a supply below what the gate drivers need, or one of them that has not started.
  bool fault_line_low() const { return gate_driver_fault_ || !supply_suffices() || !all_started(); }
  bool emergency_stop_open() const { return emergency_stop_pressed_; }
  board::GateDriverAnswer configure_gate_driver(std::size_t axis, drivers::CurrentSenseGain gain);
  /// Of a planted fault it knows no phase.
  std::uint16_t read_gate_driver_faults(std::size_t axis) const;

 private:
  bool answers(std::size_t axis) const;
  bool supply_suffices() const;
  bool all_started() const { return std::all_of(started_.begin(), started_.end(), std::identity{}); }

  simulation::SceneDrives& drives_;
  std::array<SimulatedBridge, firmware::axis_count> bridges_;
  std::array<Sample, firmware::axis_count> samples_;
  SimulatedSerialEncoder serial_encoder_{drives_};
  std::uint16_t supply_code_;
  bool emergency_stop_pressed_ = false, gate_driver_fault_ = false, gate_enabled_ = false;
  std::array<bool, firmware::axis_count> started_;
};

}  // namespace kmax::simulated_board
