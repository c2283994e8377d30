#include "host_tools/experiment/max_stiffness/stiffness_condition.hpp"

#include <fmt/format.h>

#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {

void StiffnessCondition::apply(TouchSetup& setup) const {
  auto& wall = setup.wall.wall;
  const bool fieldless = law == control::WallKind::magnetic && magnetic_coefficient == 0.0;
  wall.kind = fieldless ? control::WallKind::plain : law;
  wall.magnetic_coefficient = static_cast<float>(magnetic_coefficient);
  wall.adaptive.mode = mode;
  if (velocity_scale != 1.0)
    wall.adaptive.velocity_max =
        static_cast<float>(control::AdaptiveCoefficientConfig<double>().velocity_max / velocity_scale);
}

std::vector<StiffnessCondition> stiffness_conditions() {
  const auto printed = [](double coefficient, bool adaptive) -> std::optional<double> {
    for (const paper::MaxStiffness& number : paper::max_stiffness) {
      if (number.adaptive == adaptive && (adaptive || number.magnetic_coefficient == coefficient))
        return number.stiffness;
    }
    return std::nullopt;
  };
  std::vector<StiffnessCondition> conditions;
  for (const double coefficient : paper::magnetic_coefficients) {
    StiffnessCondition condition;
    condition.name = fmt::format("F_MC = {:g} N", coefficient);
    condition.magnetic_coefficient = coefficient;
    condition.paper = printed(coefficient, false);
    conditions.push_back(condition);
  }
  using control::AdaptiveMode;
  for (const auto& [mode, name] : {std::pair{AdaptiveMode::instant, "adaptive, instant"},
                                   std::pair{AdaptiveMode::latched, "adaptive, latched"},
                                   std::pair{AdaptiveMode::peak_hold, "adaptive, peak_hold"}}) {
    StiffnessCondition condition;
    condition.name = name;
    condition.law = control::WallKind::adaptive;
    condition.mode = mode;
    condition.paper = printed(0.0, true);
    conditions.push_back(condition);
  }
  return conditions;
}

std::vector<StiffnessCondition> rescaled_conditions() {
  constexpr double half_width = 0.075;  // m, of CHAI3D's model of the Touch
  std::vector<StiffnessCondition> conditions = stiffness_conditions();
  std::erase_if(conditions, [](const StiffnessCondition& condition) { return !condition.adaptive(); });
  for (StiffnessCondition& condition : conditions) {
    condition.velocity_scale = 1.0 / half_width;
    condition.name += fmt::format(", V x {:.1f}", condition.velocity_scale);
  }
  return conditions;
}

TouchSetup touch_setup(const simulation::DeviceModel& device, const simulation::OperatorModel& person,
                       const StiffnessCondition& condition) {
  TouchSetup setup;
  setup.device = device;
  setup.person = person;
  setup.wall = touched_wall(paper::update_rate, paper::touch_resolution, device.force_limit);
  // The estimator is the firmware's default where a velocity counts. Constant walls ask for none, and FOAW
  // costs more than all the rest of the tick.
  if (!control::follows_velocity(condition.law))
    setup.wall.velocity.kind = control::VelocityEstimatorKind::difference;
  condition.apply(setup);
  return setup;
}

}  // namespace kmax::experiment
