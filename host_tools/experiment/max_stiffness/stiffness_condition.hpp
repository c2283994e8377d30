#pragma once
// The walls whose largest stable stiffness paper 1 measured (Figs. 6 and 8), and the variations that take its
// effect apart.

#include <optional>
#include <string>
#include <vector>

#include "host_tools/experiment/people/subject_set.hpp"
#include "host_tools/experiment/simulated_touch.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

struct StiffnessCondition {
  std::string name;
  double magnetic_coefficient = 0.0;  // N, of the constant field; 0 for the adaptive wall
  bool adaptive = false;
  control::AdaptiveMode mode = control::AdaptiveMode::instant;
  std::optional<double> paper;  // N/m
  // Whether the model was fitted to this very number, or it follows without another fit. That hangs on the
  // people: run_max_stiffness_study() sets it in its results.
  report::Origin origin = report::Origin::predicted;

  void apply(TouchSetup& setup) const;
};

// Fig. 6: F_MC = 0, 0.5, 1, 1.5 and 2 N; Fig. 8: the adaptive wall in each way its coefficient can follow the
// velocity, since the paper does not say which it used.
std::vector<StiffnessCondition> stiffness_conditions();

// 500 Hz and 0.055 mm (paper 1, section 4); the force is clipped where the device's is.
TouchSetup touch_setup(const simulation::DeviceModel& device, const simulation::OperatorModel& person,
                       const StiffnessCondition& condition);

// One of the four things that change when a field of F_MC = 2 N is added to a wall: the hand stiffens, the
// field reaches out in front of the wall, its force is there as a preload, and a force limit is met sooner.
// Each condition leaves some of them out. The fourth, the force limit, is the device's.
struct CauseCondition {
  std::string name;
  std::string what;               // is left
  bool field = false;             // paper 1, eqs. 5 and 6
  double magnetic_length = 1e-3;  // m; nearly 0: the field's force inside the wall only
  bool preload = false;           // F_MC everywhere instead of the field
  bool stiffens = false;          // the hand, with what is commanded
  double grip_factor = 1.0;       // of k1 and b1, from the beginning
  double arm_factor = 1.0;        // of k2 and b2
  void apply(TouchSetup& setup) const;
};

// `grown`: 1 + gamma 2 N, what a hand grows by that has got used to 2 N.
std::vector<CauseCondition> cause_conditions(double grown);

}  // namespace kmax::experiment
