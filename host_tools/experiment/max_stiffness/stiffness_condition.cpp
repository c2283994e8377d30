#include "host_tools/experiment/max_stiffness/stiffness_condition.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {

void StiffnessCondition::apply(TouchSetup& setup) const {
  auto& law = setup.wall.wall;
  law.kind = adaptive                     ? control::WallKind::adaptive
             : magnetic_coefficient > 0.0 ? control::WallKind::magnetic
                                          : control::WallKind::plain;
  law.magnetic_coefficient = static_cast<float>(magnetic_coefficient);
  law.adaptive.mode = mode;
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
    condition.adaptive = true;
    condition.mode = mode;
    condition.paper = printed(0.0, true);
    conditions.push_back(condition);
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
  if (!condition.adaptive) setup.wall.velocity.kind = control::VelocityEstimatorKind::difference;
  condition.apply(setup);
  return setup;
}

void CauseCondition::apply(TouchSetup& setup) const {
  constexpr double force = 2.0;  // N: the F_MC whose effect is taken apart
  auto& wall = setup.wall;
  wall.wall.kind = field ? control::WallKind::magnetic : control::WallKind::plain;
  wall.wall.magnetic_coefficient = static_cast<float>(force);
  wall.wall.magnetic_length = static_cast<float>(magnetic_length);
  if (preload) {
    wall.interference.mode = control::InterferenceMode::perpendicular;
    wall.interference.background_force = static_cast<float>(force);
    wall.interference.force = 0.0F;
  }
  if (!stiffens) setup.person.activation_gain = 0.0;
  setup.person.grip_stiffness *= grip_factor;
  setup.person.grip_damping *= grip_factor;
  setup.person.arm_stiffness *= arm_factor;
  setup.person.arm_damping *= arm_factor;
}

std::vector<CauseCondition> cause_conditions(double grown) {
  constexpr double no_length = 1e-9;  // m
  return {
      {"plain wall", "none of them"},
      {"field, hand unchanged", "the field in front of the wall and its preload", true},
      {"preload, hand unchanged", "2 N everywhere, no slope in front of the wall", false, 1e-3, true},
      {"2 N inside only, hand unchanged", "the force steps at the surface", true, no_length},
      {"grip stiffer, no field", fmt::format("k1 and b1 times {:.3g}", grown), false, 1e-3, false, false,
       grown},
      {"arm stiffer, no field", fmt::format("k2 and b2 times {:.3g}", grown), false, 1e-3, false, false, 1.0,
       grown},
      {"grip and arm stiffer, no field", fmt::format("all four times {:.3g}", grown), false, 1e-3, false,
       false, grown, grown},
      {"preload, hand stiffens", "2 N everywhere, and the hand answers", false, 1e-3, true, true},
      {"2 N inside only, hand stiffens", "the step at the surface, and the hand answers", true, no_length,
       false, true},
      {"field, hand stiffens", "all of them", true, 1e-3, false, true},
  };
}

}  // namespace kmax::experiment
