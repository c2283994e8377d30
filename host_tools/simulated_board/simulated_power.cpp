#include "host_tools/simulated_board/simulated_power.hpp"

namespace kmax::simulated_board {

void SimulatedPower::press_emergency_stop(bool pressed) {
  power_.hardware().press_emergency_stop(pressed);
  if (pressed) power_.ISR_emergency_stop();
}

void SimulatedPower::set_gate_driver_fault(bool fault) {
  power_.hardware().set_gate_driver_fault(fault);
  watch_gate_drivers();
}

// The line's falling edge, also when the supply of the gate drivers falls away.
void SimulatedPower::watch_gate_drivers() {
  const bool low = power_.hardware().fault_line_low();
  if (low && !fault_line_was_low_) power_.ISR_fault_line();
  fault_line_was_low_ = low;
}

firmware::AxisInput SimulatedPower::sample(std::size_t axis) {
  const firmware::AxisInput input = power_.ISR_measure(axis);
  supply_voltage_ = input.motor.supply_voltage;
  return input;
}

void SimulatedPower::drive(std::size_t axis, const firmware::AxisOutput& output) {
  power_.ISR_drive(axis, output, supply_voltage_);
}

void SimulatedPower::advance(double duration) {
  const auto half = [&] {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (has(axis)) drives_.set_bridge(axis, power_.hardware().simulated_bridge(axis).command());
    }
    drives_.advance(0.5 * duration);
  };
  half();
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    power_.hardware().simulated_bridge(axis).update();
  half();
  watch_gate_drivers();
}

}  // namespace kmax::simulated_board
