#include "host_tools/selftest/axis_facts.hpp"

#include <fmt/format.h>

#include "firmware/drive/motor_control.hpp"

namespace kmax::selftest {

using firmware::MotorKind;

AxisFacts read_facts(device::Device& device, std::size_t axis) {
  const auto number = [&](const char* name) {
    return device.read_number(fmt::format("axis{}.{}", axis, name));
  };
  AxisFacts facts;
  facts.synchronous =
      device.read(device::Parameter::of<"motor.kind">(axis)) == static_cast<std::uint32_t>(MotorKind::pmsm);
  facts.resistance = number("motor.resistance");
  facts.inductance = number("motor.inductance");
  facts.torque_constant = number("motor.torque_constant");
  facts.pole_pairs = static_cast<int>(number("motor.pole_pairs"));
  facts.electrical_offset = number("motor.electrical_offset");
  facts.calibrated = number("motor.calibrated") != 0.0;
  facts.commutation_known = number("measured.commutation_known") != 0.0;
  facts.current_limit = number("current.limit");
  facts.mass = number("device.mass");
  facts.transmission = number("device.transmission");
  facts.counts_per_turn = number("encoder.counts_per_turn");
  facts.count_length = number("measured.count_length");
  facts.tick = 1.0 / device.read_number("info.tick_rate");
  facts.supply_min = device.read_number("supply.voltage_min");
  facts.supply_max = device.read_number("supply.voltage_max");
  facts.temperature_limit = number("temperature.limit");
  return facts;
}

}  // namespace kmax::selftest
