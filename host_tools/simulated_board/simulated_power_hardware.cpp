#include "host_tools/simulated_board/simulated_power_hardware.hpp"

#include "drivers/as5047p_frames.hpp"
#include "host_tools/simulation/converter_code.hpp"

namespace kmax::simulated_board {

using Channel = simulation::CurrentSensor::Channel;

SimulatedSerialEncoder::Sample SimulatedSerialEncoder::ISR_take() {
  sample_.valid = false;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (!drives_.has(axis) || drives_.encoder_kind(axis) != simulation::EncoderKind::as5047p) continue;
    if (!drives_.drive(axis).encoder().plugged()) continue;
    const std::int64_t angle = drives_.serial_angle(axis);
    if (!started_) {
      started_ = true;
      constexpr auto turn = static_cast<std::int64_t>(drivers::as5047p::counts_per_turn);
      turns_before_ = angle - (angle % turn + turn) % turn;
    }
    sample_.count = static_cast<std::uint32_t>(angle - turns_before_);
    sample_.valid = true;
  }
  return sample_;
}

void SimulatedSerialEncoder::restart_without_turns() {
  if (started_) ++sample_.reference_generation;
  started_ = false;
}

SimulatedPowerHardware::SimulatedPowerHardware(simulation::SceneDrives& drives)
    : drives_(drives), supply_code_(simulation::converter_code(drives.supply().pin_voltage())) {
  started_.fill(true);
}

const SimulatedPowerHardware::Sample& SimulatedPowerHardware::ISR_sample(std::size_t axis) {
  simulation::MotorDrive& drive = drives_.drive(axis);
  supply_code_ = simulation::converter_code(drives_.supply().pin_voltage());
  samples_[axis].phase_b = simulation::converter_code(drive.current_pin(Channel::b));
  samples_[axis].phase_c = simulation::converter_code(drive.current_pin(Channel::c));
  samples_[axis].supply = supply_code_;
  return samples_[axis];
}

drivers::stm32f4::ZeroCurrentCodes SimulatedPowerHardware::zero_current(std::size_t axis) {
  constexpr auto half = simulation::CurrentSensor::Half::high_sides;
  simulation::MotorDrive& drive = drives_.drive(axis);
  return {simulation::converter_code(drive.current_pin(Channel::b, half)),
          simulation::converter_code(drive.current_pin(Channel::c, half))};
}

std::uint32_t SimulatedPowerHardware::ISR_counter(std::size_t axis) const {
  if (drives_.encoder_kind(axis) == simulation::EncoderKind::as5047p) return 0;
  return static_cast<std::uint32_t>(drives_.drive(axis).encoder().edges());
}

bool SimulatedPowerHardware::ISR_index_line(std::size_t axis) const {
  // What is not there is pulled up.
  return drives_.encoder_kind(axis) == simulation::EncoderKind::as5047p ||
         drives_.drive(axis).encoder().lines().z;
}

void SimulatedPowerHardware::set_brake(bool on) {
  drives_.supply().set_brake(on ? description.brake_pulse * description.pwm_hz() : 0.0);
}

std::uint16_t SimulatedPowerHardware::temperature_code(std::size_t axis) const {
  return simulation::converter_code(drives_.temperature(axis).pin_voltage());
}

bool SimulatedPowerHardware::supply_suffices() const {
  return drives_.supply().voltage() >= description.gate_driver_supply_minimum;
}

void SimulatedPowerHardware::set_gate_enable(bool high) {
  for (std::size_t axis = 0; high && !gate_enabled_ && axis < started_.size(); ++axis)
    started_[axis] = drives_.gate_driver_starts(axis);
  gate_enabled_ = high;
}

bool SimulatedPowerHardware::answers(std::size_t axis) const {
  return supply_suffices() && started_[axis] &&
         !drives_.planted(axis, simulation::Defect::gate_driver_missing);
}

std::uint16_t SimulatedPowerHardware::read_gate_driver_faults(std::size_t axis) const {
  using enum drivers::Drv8301Fault;
  if (!answers(axis)) return static_cast<std::uint16_t>(no_answer);
  return gate_driver_fault_ ? static_cast<std::uint16_t>(fault) : std::uint16_t{0};
}

board::GateDriverAnswer SimulatedPowerHardware::configure_gate_driver(std::size_t axis,
                                                                      drivers::CurrentSenseGain gain) {
  using enum board::GateDriverAnswer;
  if (!answers(axis)) return silent;
  if (drives_.has(axis))
    drives_.drive(axis).current_sensor().set_gain(static_cast<double>(drivers::gain_factor(gain)));
  return accepted;
}

}  // namespace kmax::simulated_board
