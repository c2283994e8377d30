#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "board/odrive_v3/power_stage.hpp"
#include "control/brake_chopper.hpp"
#include "firmware/application.hpp"
#include "host_tools/simulated_board/simulated_bridge.hpp"
#include "host_tools/simulated_board/simulated_counter.hpp"
#include "host_tools/simulated_board/simulated_power_hardware.hpp"
#include "host_tools/simulation/scene_drives.hpp"

namespace kmax::simulated_board {

/// The axes of a scene that have motors, behind a board's power stage: what board/odrive_v3/drives_tick.cpp
/// does in the interrupt, in virtual time and with the same drivers.
///
/// Order of a tick: sample() of each axis sees the moment of the conversion; drive() takes the tick's result;
/// advance() lets the old duties act for half the time, and the new ones for the
/// other half. What takes microseconds on the board (conversion, computing, the two axes one after the other)
/// takes no time here, and both axes are sampled together. A bridge that must not drive is off at once.
///
/// The power stage is ready 73 ms after the start, and again that long after a change of current.limit that
/// needs another amplifier gain.
class SimulatedPower {
 public:
  explicit SimulatedPower(const simulation::Scene& scene) : drives_(scene) {}
  SimulatedPower(const SimulatedPower&) = delete;
  SimulatedPower& operator=(const SimulatedPower&) = delete;

  bool has(std::size_t axis) const { return drives_.has(axis); }
  /// What is plugged in: motors, handles, supply, temperatures, and their defects.
  simulation::SceneDrives& drives() { return drives_; }
  const simulation::SceneDrives& drives() const { return drives_; }

  /// Pressed, it counts until it is released and no axis is armed.
  void press_emergency_stop(bool pressed);
  /// nFAULT of the gate drivers, held low until it is taken away.
  void set_gate_driver_fault(bool fault);

  /// Of an axis that has a motor, once in a tick.
  firmware::AxisInput sample(std::size_t axis);
  void drive(std::size_t axis, const firmware::AxisOutput& output);
  void set_background_force(std::size_t axis, float force) {
    drives_.drive(axis).set_background_force(static_cast<double>(force));
  }
  void advance(double duration);

  firmware::BoardReadings readings() const;
  /// The main loop: takes over parameters while nothing is armed, and leads through the power-up sequence.
  void poll(const firmware::Application& application, std::uint32_t now_us);

  drivers::CurrentSenseGain gain() const { return hardware_.gain(); }

 private:
  struct Axis {
    SimulatedBridge bridge;
    SimulatedCounter counter;
    bool driving = false;
  };

  firmware::Fault condition(std::size_t axis) const;
  void apply(const firmware::ParameterValues& values);
  void watch_gate_drivers();
  void disarm_all();
  void brake();

  simulation::SceneDrives drives_;
  SimulatedPowerHardware hardware_{drives_};
  board::odrive_v3::PowerStage<SimulatedPowerHardware> stage_{hardware_};
  std::array<Axis, firmware::axis_count> axes_;
  control::BrakeChopper chopper_;
  control::BrakeChopper::Coefficients brake_{};
  std::uint32_t braking_for_ = 0;
  bool fault_line_was_low_ = false;
  bool applied_ = false;
  std::uint32_t applied_changes_ = 0;
};

}  // namespace kmax::simulated_board
