#include "host_tools/simulated_board/scene_parameters.hpp"

#include <fmt/format.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/parameter.hpp"

namespace kmax::simulated_board {

namespace {

std::string text_of(const simulation::ParameterValue& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::string>) {
          return v;
        } else {
          return fmt::format("{}", v);
        }
      },
      value);
}

device::Assignment assignment_of(const std::string& name, const simulation::ParameterValue& value) {
  const device::Parameter parameter = device::resolve(name);
  if (!parameter.writable())
    throw base::ValueError(fmt::format("{} can only be read; leave it out of the scene", name));
  if (parameter == device::Parameter::of<"store.command">() ||
      parameter == device::Parameter::of<"log.command">() ||
      parameter == device::Parameter::of<"lock.code">() || parameter == device::Parameter::of<"lock.key">())
    throw base::ValueError(fmt::format("{} is a command, not a value; leave it out of the scene", name));
  return {parameter, device::parse_value(parameter, text_of(value))};
}

void replace_or_add(std::vector<device::Assignment>& all, const device::Assignment& one) {
  for (device::Assignment& present : all) {
    if (present.parameter == one.parameter) {
      present = one;
      return;
    }
  }
  all.push_back(one);
}

template <firmware::FixedName name>
device::Assignment hardware(std::size_t axis, double number) {
  constexpr std::size_t entry = firmware::entry_of<name>();
  return {device::Parameter(entry, axis), firmware::raw_from_number(firmware::entry_at(entry).type, number)};
}

using Assignments = std::vector<device::Assignment>;

void identify_dc(Assignments& all, std::size_t axis, const simulation::BrushedDcMotorConfig& motor,
                 double leg_resistance) {
  all.push_back(hardware<"motor.resistance">(axis, motor.resistance + 2.0 * leg_resistance));
  all.push_back(hardware<"motor.inductance">(axis, motor.inductance));
  all.push_back(hardware<"motor.torque_constant">(axis, motor.torque_constant));
}

void identify_pmsm(Assignments& all, std::size_t axis, const simulation::SynchronousMotorConfig& motor,
                   double leg_resistance) {
  all.push_back(hardware<"motor.resistance">(axis, motor.resistance + leg_resistance));
  all.push_back(hardware<"motor.inductance">(axis, motor.inductance_d));
  all.push_back(hardware<"motor.inductance_q">(axis, motor.inductance_q));
  all.push_back(hardware<"motor.torque_constant">(axis, motor.torque_constant));
  all.push_back(hardware<"motor.pole_pairs">(axis, motor.pole_pairs));
  all.push_back(hardware<"motor.electrical_offset">(axis, motor.electrical_offset));
  all.push_back(hardware<"motor.commutation_known">(axis, 1));
}

constexpr std::size_t transaction_entry = firmware::entry_of<"transaction.control">();

}  // namespace

std::optional<std::string> check_parameter(const std::string& name, const simulation::ParameterValue& value) {
  try {
    assignment_of(name, value);
    return std::nullopt;
  } catch (const base::ValueError& error) {
    return error.what();
  }
}

std::vector<device::Assignment> hardware_assignments_of(const simulation::Scene& scene) {
  std::vector<device::Assignment> all;
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis) {
    const simulation::SceneAxis& named = scene.axes[axis];
    all.push_back(hardware<"encoder.counts_per_turn">(axis, named.encoder.counts_per_turn));
    all.push_back(hardware<"device.transmission">(axis, named.encoder.transmission));
    if (scene.identified) all.push_back(hardware<"device.mass">(axis, named.device.mass));
    if (!named.motor) continue;
    const bool brushed = std::holds_alternative<simulation::BrushedDcMotorConfig>(*named.motor);
    const bool serial = named.encoder.kind == simulation::EncoderKind::as5047p;
    all.push_back(hardware<"motor.kind">(axis, brushed ? 0 : 1));
    all.push_back(hardware<"encoder.kind">(
        axis, static_cast<int>(serial ? firmware::EncoderKind::as5047p : firmware::EncoderKind::quadrature)));
  }
  if (!scene.identified) return all;
  for (const device::Assignment& one : identified_assignments_of(scene)) all.push_back(one);
  return all;
}

std::vector<device::Assignment> identified_assignments_of(const simulation::Scene& scene) {
  std::vector<device::Assignment> all;
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis) {
    const simulation::SceneAxis& named = scene.axes[axis];
    if (!named.motor) continue;
    const double leg = named.inverter.on_resistance;
    if (const auto* dc = std::get_if<simulation::BrushedDcMotorConfig>(&*named.motor)) {
      identify_dc(all, axis, *dc, leg);
    } else {
      identify_pmsm(all, axis, std::get<simulation::SynchronousMotorConfig>(*named.motor), leg);
    }
    all.push_back(hardware<"encoder.direction">(axis, named.encoder.reversed ? -1 : 1));
    all.push_back(hardware<"motor.calibrated">(axis, 1));
  }
  return all;
}

std::vector<device::Assignment> own_assignments_of(const simulation::Scene& scene) {
  std::vector<device::Assignment> all;
  for (const simulation::SceneParameter& parameter : scene.parameters)
    replace_or_add(all, assignment_of(parameter.name, parameter.value));
  return all;
}

std::vector<device::Assignment> assignments_of(const simulation::Scene& scene) {
  std::vector<device::Assignment> all = hardware_assignments_of(scene);
  for (const device::Assignment& one : own_assignments_of(scene)) replace_or_add(all, one);
  return all;
}

void preset(firmware::Application& application, const std::vector<device::Assignment>& assignments) {
  const auto refuse = [](firmware::Refusal refusal, std::uint16_t address) {
    const auto owner = device::owner_of_holding_register(address);
    throw simulation::SceneError(fmt::format("[parameters] {}: {}", owner ? owner->name() : "of the scene",
                                             firmware::to_string(refusal)));
  };
  application.preset(transaction_entry, 0, 1);
  for (const device::Assignment& assignment : assignments) {
    const auto result =
        application.preset(assignment.parameter.entry(), assignment.parameter.axis(), assignment.raw);
    if (result.refusal == firmware::Refusal::none) continue;
    application.preset(transaction_entry, 0, 0);
    refuse(result.refusal, result.address);
  }
  const auto result = application.preset(transaction_entry, 0, 2);
  if (result.refusal != firmware::Refusal::none) refuse(result.refusal, result.address);
}

}  // namespace kmax::simulated_board
