#pragma once
// Fits two numbers of the model to two numbers of paper 1: the device's Coulomb friction to the plain wall's
// largest stiffness, 3.58 N/mm, and the activation gain gamma to that of F_MC = 2 N, 8.41 N/mm (means of
// twelve people, section 4.2). What comes out at these two conditions afterwards is calibration. What comes
// out at any other is prediction.
//
// The friction is found first: the plain wall has no field, so gamma has no part in it. Both are found by
// halving an interval, since the mean stiffness rises with either, if only roughly: it moves in steps of
// 100 N/m divided by the number of people, and up and down by hundreds of N/m between values that lie close
// together. The value nearest to the target is kept.

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

namespace kmax::experiment {

struct CalibrationSettings {
  double plain_target;     // N/m
  double magnetic_target;  // N/m, at F_MC = 2 N
  double tolerance = 4.0;  // N/m: near enough
  int most_steps = 14;     // of each search
  bool fit_friction = true;
  double friction_most = 1.0;  // N; searched from 0
  double gain_most = 8.0;      // 1/N
  // Where they are likely to be, N and 1/N; 0: not known. From there the interval's ends are sought in
  // growing steps, since far above, where halving from 0 to the most begins, walls stay stable for long. The
  // search is made twice, each in `most_steps` at most. The first is rough: each person's stiffness is
  // searched from what it was at the interval's lower end. The second begins at the value found and searches
  // each from the run's first stiffness.
  double likely_friction = 0.0, likely_gain = 0.0;
};

CalibrationSettings paper_targets();

struct CalibrationStep {
  double friction, activation_gain;  // N, 1/N
  bool magnetic;                     // which of the two walls
  double stiffness;                  // N/m, mean
};

struct OperatorCalibration {
  SubjectSet set;  // with what was found, and what to, whether it was met or not
  double friction = 0.0, activation_gain = 0.0;
  double plain = 0.0, magnetic = 0.0;            // N/m, means at the end
  bool plain_met = false, magnetic_met = false;  // within the tolerance of the study: 100 and 150 N/m
  std::vector<CalibrationStep> steps;
  double simulated_time = 0.0;  // s
};

// How far off the target a mean may be and still count as met: the bounds that the study sets itself, N/m.
inline constexpr double plain_tolerance = 100.0;
inline constexpr double magnetic_tolerance = 150.0;

// `set`: whose friction and gains are replaced. Progress counts means, of the most that can be needed. Throws
// std::invalid_argument, and what the run's progress throws.
OperatorCalibration calibrate_operator(const SubjectSet& set, const CalibrationSettings& settings,
                                       const StiffnessRun& run);

}  // namespace kmax::experiment
