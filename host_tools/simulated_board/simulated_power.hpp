#pragma once

#include <cstddef>
#include <cstdint>

#include "host_tools/simulated_board/simulated_power_hardware.hpp"

namespace kmax::simulated_board {

/// The axes of a scene that have motors, behind a board's power stage: the board's own code (board::Power) in
/// virtual time.
///
/// Order of a tick: sample() of each axis sees the moment of the conversion; drive() takes the tick's result;
/// advance() lets the old duties act for half the time, and the new ones for the other half. What takes
/// microseconds on the board (conversion, computing, the two axes one after the other) takes no time here,
/// and both axes are sampled together. A bridge that must not drive is off at once.
///
/// The power stage is ready 73 ms after the start, and again that long after a change of current.limit that
/// needs another amplifier gain.
class SimulatedPower {
 public:
  explicit SimulatedPower(const simulation::Scene& scene)
      : drives_(scene), power_(static_cast<float>(drives_.supply().config().divider_ratio), drives_) {}

  bool has(std::size_t axis) const { return drives_.has(axis); }
  /// What is plugged in: motors, handles, supply, temperatures, and their defects.
  simulation::SceneDrives& drives() { return drives_; }
  const simulation::SceneDrives& drives() const { return drives_; }

  /// V, that of the board whose supply this is; 0: of none that is known.
  float supply_ceiling() const {
    const auto variant = drives_.variant();
    return variant ? board::odrive_v3::supply_ceiling(*variant) : 0.0f;
  }

  /// Pressed, it counts until it is released and no axis is armed.
  void press_emergency_stop(bool pressed);
  /// nFAULT of the gate drivers, held low until it is taken away.
  void set_gate_driver_fault(bool fault);
  /// The break input of an axis' timer: the bridge is off, and nobody says why.
  void break_bridge(std::size_t axis) { power_.hardware().bridge(axis).disarm(); }

  /// Of an axis that has a motor, once in a tick.
  firmware::AxisInput sample(std::size_t axis);
  void drive(std::size_t axis, const firmware::AxisOutput& output);
  void set_background_force(std::size_t axis, float force) {
    drives_.drive(axis).set_background_force(static_cast<double>(force));
  }
  void advance(double duration);

  firmware::BoardReadings readings() const { return power_.readings(); }
  /// The main loop.
  void poll(const firmware::Application& application, std::uint32_t now_us) {
    power_.poll(application, now_us);
  }

  drivers::CurrentSenseGain gain() const { return power_.drives().gain(); }

 private:
  void watch_gate_drivers();

  simulation::SceneDrives drives_;
  board::Power<SimulatedPowerHardware> power_;
  float supply_voltage_ = 0.0f;  ///< V, of the last sample
  bool fault_line_was_low_ = false;
};

}  // namespace kmax::simulated_board
