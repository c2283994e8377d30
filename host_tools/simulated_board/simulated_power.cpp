#include "host_tools/simulated_board/simulated_power.hpp"

namespace kmax::simulated_board {

using firmware::Fault;

void SimulatedPower::press_emergency_stop(bool pressed) {
  hardware_.press_emergency_stop(pressed);
  if (!pressed) return;
  disarm_all();
  stage_.ISR_emergency_stop();
}

void SimulatedPower::set_gate_driver_fault(bool fault) {
  hardware_.set_gate_driver_fault(fault);
  watch_gate_drivers();
}

// The line's falling edge, also when the supply of the gate drivers falls away.
void SimulatedPower::watch_gate_drivers() {
  const bool low = hardware_.fault_line_low();
  if (low && !fault_line_was_low_) {
    disarm_all();
    stage_.ISR_fault_line();
  }
  fault_line_was_low_ = low;
}

void SimulatedPower::disarm_all() {
  for (Axis& axis : axes_) axis.bridge.disarm();
}

firmware::AxisInput SimulatedPower::sample(std::size_t axis) {
  firmware::AxisInput input{};
  const auto reading = axes_[axis].counter.read(drives_, axis, axes_[axis].driving);
  input.count = reading.count;
  input.count_valid = reading.valid;
  input.referenced = reading.referenced;
  input.reference_generation = reading.reference_generation;
  input.motor = hardware_.measured(axis);
  input.condition = condition(axis);
  return input;
}

Fault SimulatedPower::condition(std::size_t axis) const {
  if (const Fault condition = stage_.ISR_condition(); condition != Fault::none) return condition;
  if (hardware_.supply_saturated()) return Fault::over_voltage;
  return axes_[axis].driving && hardware_.currents_saturated(axis) ? Fault::current_sense : Fault::none;
}

void SimulatedPower::drive(std::size_t index, const firmware::AxisOutput& output) {
  Axis& axis = axes_[index];
  if (!output.enabled || !axis.bridge.set_duty(output.motor)) {
    axis.bridge.disarm();
    axis.driving = false;
    // The next arming begins without voltage.
    axis.bridge.set_no_voltage();
  } else if (!axis.driving && stage_.ISR_condition() == Fault::none) {
    axis.bridge.arm();
    axis.driving = true;
  }
}

void SimulatedPower::advance(double duration) {
  brake();
  const auto half = [&] {
    for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
      if (has(axis)) drives_.set_bridge(axis, axes_[axis].bridge.command());
    }
    drives_.advance(0.5 * duration);
  };
  half();
  for (Axis& axis : axes_) axis.bridge.update();
  half();
  watch_gate_drivers();
}

// As in the board's tick of axis 0: motors brake while they are driven and a moment after.
void SimulatedPower::brake() {
  constexpr std::uint32_t ticks_after_driving = firmware::tick_rate_hz / 5;
  if (axes_[0].driving || axes_[1].driving) {
    braking_for_ = ticks_after_driving;
  } else if (braking_for_ != 0) {
    --braking_for_;
  }
  const bool wanted = chopper_.update(brake_, hardware_.supply_voltage());
  drives_.supply().set_brake(wanted && braking_for_ != 0 ? 1.0 : 0.0);
}

firmware::BoardReadings SimulatedPower::readings() const {
  firmware::BoardReadings readings;
  for (std::size_t axis = 0; axis < axes_.size(); ++axis)
    readings.power_stage_temperature[axis] = hardware_.temperature(axis);
  readings.has_power_stage = true;
  readings.supply_voltage = hardware_.supply_voltage();
  return readings;
}

void SimulatedPower::apply(const firmware::ParameterValues& values) {
  float largest_current = 0.0f;
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    const float trip = firmware::over_current_factor * values.real<"current.limit">(axis);
    if (trip > largest_current) largest_current = trip;
    axes_[axis].bridge.choose_legs(values.choice<firmware::MotorKind, "motor.kind">(axis));
    axes_[axis].counter.configure(values, axis);
  }
  hardware_.set_range(largest_current);
  brake_ = control::BrakeChopper::prepare({.on_voltage = values.real<"supply.brake_voltage">()});
}

void SimulatedPower::poll(const firmware::Application& application, std::uint32_t now_us) {
  const bool armed = application.any_armed();
  if (!armed) {
    if (!applied_ || application.parameter_changes() != applied_changes_) {
      applied_ = true;
      applied_changes_ = application.parameter_changes();
      apply(application.values());
    }
    if (stage_.ready() && hardware_.gain_has_changed()) stage_.restart(now_us);
  }
  stage_.poll(now_us, armed);
}

}  // namespace kmax::simulated_board
