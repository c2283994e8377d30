#pragma once
// Where the gain of F_MC = 2 N comes from: the four causes (the hand stiffens, the field reaches out, its
// force is a preload, the force limit is met sooner) switched off one by one, and the length of the field.

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

namespace kmax::experiment {

// What is looked for here lies far below the 1 N/mm that other searches begin with: a field that no hand
// answers is unstable there already.
inline constexpr double cause_first_stiffness = 100.0;  // N/m; the run's own first stiffness is not used

struct CauseResult {
  CauseCondition condition;
  double mean = 0.0;             // N/m
  double saturated_share = 0.0;  // largest, simulated_touch.hpp
  CountedEnds ends{};
};

// `set`: calibrated. One result per cause_conditions().
std::vector<CauseResult> run_cause_study(const SubjectSet& set, const StiffnessRun& run);

struct FieldLengthResult {
  double magnetic_length;  // m, x_0
  double slope;            // N/m, 2 F_MC / x_0 just outside the wall
  double mean;             // N/m
  CountedEnds ends{};
};

// The field alone, F_MC = 2 N, the hand unchanged, for several lengths.
std::vector<FieldLengthResult> run_field_lengths(const SubjectSet& set, const std::vector<double>& lengths,
                                                 const StiffnessRun& run);

}  // namespace kmax::experiment
