#pragma once
// What would make the adaptive wall reach the 8.02 N/mm of paper 1, Fig. 8, which this model does not
// predict: its largest stiffness by approach speed and mode, and the constant F_MC that gives that stiffness.

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

namespace kmax::experiment {

struct ApproachResult {
  double approach_speed;        // m/s, the only one of the touches
  double constant;              // N/m, F_MC = 2 N constant, at the same speed
  std::vector<double> by_mode;  // N/m: instant, latched, peak_hold
  double held;                  // N/m: peak_hold whose hold time is far longer than the touch
  double
      coefficient_at_contact;  // N, mean over the people, of the wall that is held, at its largest stiffness
  // Of these means, in the same order.
  CountedEnds constant_ends{};
  std::vector<CountedEnds> by_mode_ends{};
  CountedEnds held_ends{};
};

std::vector<ApproachResult> run_approaches(const SubjectSet& set, const std::vector<double>& speeds,
                                           const StiffnessRun& run);

struct NeededCoefficient {
  double coefficient = 0.0;     // N, constant
  double mean = 0.0;            // N/m, what it gives: as near to the target as steps of the mean allow
  double approach_speed = 0.0;  // m/s, at which eq. 7 commands that much
};

// Searched between 0 and 4 N, all touches of the run's protocol.
NeededCoefficient coefficient_for(const SubjectSet& set, double target, const StiffnessRun& run);

}  // namespace kmax::experiment
