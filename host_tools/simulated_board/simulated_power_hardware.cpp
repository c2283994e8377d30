#include "host_tools/simulated_board/simulated_power_hardware.hpp"

#include <limits>

#include "drivers/ntc_thermistor.hpp"
#include "host_tools/simulated_board/converter_code.hpp"

namespace kmax::simulated_board {

namespace {
using Channel = simulation::CurrentSensor::Channel;
using board::odrive_v3::OffsetProgress;

constexpr drivers::NtcThermistor thermistor{};
constexpr double lowest_gate_driver_supply = 5.9;  // V; DRV8301 data sheet, PVDD under-voltage
}  // namespace

SimulatedPowerHardware::SimulatedPowerHardware(simulation::SceneDrives& drives)
    : drives_(drives),
      divider_({.ratio = static_cast<float>(drives.supply().config().divider_ratio)}),
      supply_code_(converter_code(drives.supply().pin_voltage())) {}

firmware::MotorControl::Measured SimulatedPowerHardware::measured(std::size_t index) {
  Sensors& axis = axes_[index];
  simulation::MotorDrive& drive = drives_.drive(index);
  axis.code_b = converter_code(drive.current_pin(Channel::b, true));
  axis.code_c = converter_code(drive.current_pin(Channel::c, true));
  supply_code_ = converter_code(drives_.supply().pin_voltage());
  if (calibrating_) {
    axis.offset_b.ISR_add(axis.code_b);
    axis.offset_c.ISR_add(axis.code_c);
  }
  firmware::MotorControl::Measured measured{};
  measured.present = true;
  measured.supply_voltage = supply_voltage();
  measured.current_b = axis.sense_b.ISR_amperes(axis.code_b);
  measured.current_c = axis.sense_c.ISR_amperes(axis.code_c);
  return measured;
}

bool SimulatedPowerHardware::currents_saturated(std::size_t index) const {
  const Sensors& axis = axes_[index];
  return axis.sense_b.ISR_saturated(axis.code_b) || axis.sense_c.ISR_saturated(axis.code_c);
}

float SimulatedPowerHardware::temperature(std::size_t axis) const {
  const auto reading = thermistor.ISR_read(converter_code(drives_.temperature(axis).pin_voltage()));
  return reading.state == drivers::NtcState::ok ? reading.celsius : std::numeric_limits<float>::quiet_NaN();
}

bool SimulatedPowerHardware::supply_suffices() const {
  return drives_.supply().voltage() >= lowest_gate_driver_supply;
}

bool SimulatedPowerHardware::configure_gate_driver(std::size_t axis) {
  configured_gain_ = gain_;
  if (drives_.has(axis))
    drives_.drive(axis).current_sensor().set_gain(static_cast<double>(drivers::gain_factor(gain_)));
  return supply_suffices();
}

void SimulatedPowerHardware::restart_offset_calibration() {
  for (Sensors& axis : axes_) {
    axis.sense_b = axis.sense_c = drivers::CurrentSense{{.gain = gain_}};
    axis.offset_b.restart();
    axis.offset_c.restart();
  }
  calibrating_ = true;
}

OffsetProgress SimulatedPowerHardware::offset_progress() {
  using drivers::OffsetResult;
  bool refused = false;
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    if (!drives_.has(axis)) continue;
    for (const auto* offset : {&axes_[axis].offset_b, &axes_[axis].offset_c}) {
      if (offset->result() == OffsetResult::running) return OffsetProgress::running;
      refused = refused || offset->result() != OffsetResult::accepted;
    }
  }
  calibrating_ = false;
  if (refused) return OffsetProgress::refused;
  for (Sensors& axis : axes_) {
    axis.sense_b.set_offset(axis.offset_b.offset());
    axis.sense_c.set_offset(axis.offset_c.offset());
  }
  return OffsetProgress::accepted;
}

}  // namespace kmax::simulated_board
