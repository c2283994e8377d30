#include "host_tools/simulation/scene_parts.hpp"

#include <fmt/format.h>

namespace kmax::simulation {

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
