// What is made of a scene's parts.
#include <fmt/format.h>

#include <stdexcept>

#include "host_tools/simulation/noise_generator.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

CoupledHandle SceneAxis::make_handle(const IntegratorConfig& integrator) const {
  const auto make = [this] {
    if (!person) return CoupledHandle(device, start);
    if (motion) return CoupledHandle(device, *person, *motion, start);
    IntendedMotionConfig stay;
    stay.start_position = start.position;
    stay.wall_position = start.position;
    return CoupledHandle(device, *person, stay, start);
  };
  CoupledHandle handle = make();
  if (integrator.kind != IntegratorKind::exact) handle.set_integrator(integrator);
  return handle;
}

MotorDrive SceneAxis::make_drive(std::uint64_t seed, const IntegratorConfig& integrator) const {
  if (!motor) throw std::logic_error("make_drive: this axis of the scene has no [motor]");
  SceneAxis unlimited = *this;
  unlimited.device.force_limit = 0.0;
  return MotorDrive({*motor, inverter, current_sensor, encoder, seed}, unlimited.make_handle(integrator));
}

std::uint64_t Scene::seed_of(std::size_t axis) const {
  NoiseGenerator seeds(seed);
  std::uint64_t own = seeds.bits();
  for (std::size_t n = 0; n < axis; ++n) own = seeds.bits();
  return own;
}

std::string to_string(const IntegratorConfig& integrator) {
  const std::string_view name = integrator_names[static_cast<std::size_t>(integrator.kind)];
  switch (integrator.kind) {
    case IntegratorKind::exact:
      break;
    case IntegratorKind::semi_implicit_euler:
    case IntegratorKind::rk4:
      return fmt::format("{}, {} substeps per 2 ms", name, integrator.substeps);
    case IntegratorKind::adaptive:
      return fmt::format("{}, tolerance {}", name, integrator.tolerance);
  }
  return std::string(name);
}

std::vector<std::string> integrated_parts(const SceneAxis& axis) {
  std::vector<std::string> parts;
  if (axis.motor) {
    const bool brushed = std::holds_alternative<BrushedDcMotorConfig>(*axis.motor);
    parts.emplace_back(brushed ? "DC motor" : "synchronous motor");
    parts.emplace_back("inverter");
    parts.emplace_back("supply");
  }
  parts.emplace_back("device");
  if (axis.device.delay > 0.0) parts.push_back(fmt::format("delay of {} ms", axis.device.delay * 1e3));
  if (axis.device.structure) parts.emplace_back("structure");
  if (axis.person) parts.emplace_back("hand and arm");
  if (axis.person && axis.person->activation_gain > 0.0) parts.emplace_back("activation");
  if (axis.encoder.edge_noise > 0.0) parts.emplace_back("encoder noise");
  if (axis.encoder.dropout_probability > 0.0) parts.emplace_back("encoder dropouts");
  return parts;
}

}  // namespace kmax::simulation
