#pragma once
// The walls whose largest stable stiffness paper 1 measured (Figs. 6 and 8).

#include <optional>
#include <string>
#include <vector>

#include "host_tools/experiment/people/subject_set.hpp"
#include "host_tools/experiment/simulated_touch.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

struct StiffnessCondition {
  std::string name;
  control::WallKind law = control::WallKind::magnetic;
  double magnetic_coefficient = 0.0;  // N, of the constant field; 0 for the adaptive wall
  control::AdaptiveMode mode = control::AdaptiveMode::instant;
  double velocity_scale = 1.0;  // what V of eq. 7 is counted as, in m/s: V_max is that much smaller
  std::optional<double> paper;  // N/m
  // Whether the model was fitted to this very number, or it follows without another fit. That hangs on the
  // people: run_max_stiffness_study() sets it in its results.
  report::Origin origin = report::Origin::predicted;

  bool adaptive() const { return law == control::WallKind::adaptive; }
  void apply(TouchSetup& setup) const;
};

// Fig. 6: F_MC = 0, 0.5, 1, 1.5 and 2 N; Fig. 8: the adaptive wall in each way its coefficient can follow the
// velocity, since the paper does not say which it used.
std::vector<StiffnessCondition> stiffness_conditions();

// The adaptive ones with V counted in half widths of the Touch's workspace, of 0.075 m, instead of metres:
// the hypothesis of docs/experiments/max_stiffness.md on the paper's 8.02 N/mm.
std::vector<StiffnessCondition> rescaled_conditions();

// 500 Hz and 0.055 mm (paper 1, section 4); the force is clipped where the device's is.
TouchSetup touch_setup(const simulation::DeviceModel& device, const simulation::OperatorModel& person,
                       const StiffnessCondition& condition);

}  // namespace kmax::experiment
