#pragma once
// How much the study of the largest stiffness hangs on what nobody knows: the people that were drawn, how
// they touch, what counts as unstable, the device's mass, damping and delay, the integrator. Each variation
// is run with the calibrated numbers left as they are, and if wanted with both fitted again to the same two
// targets: what the two fits then predict differently is what the targets do not identify.

#include "host_tools/experiment/max_stiffness/operator_calibration.hpp"

namespace kmax::experiment {

struct StudyVariation {
  std::string name;
  std::string group;  // what is varied
  bool refit = false;
  SubjectSet set;
  TouchProtocol protocol;
  simulation::IntegratorConfig integrator{};
};

// All but the draws, from a calibrated set.
std::vector<StudyVariation> assumption_variations(const SubjectSet& set, const TouchProtocol& protocol);
// Other people: the seeds 1 .. `draws`, each fitted again.
std::vector<StudyVariation> draw_variations(const SubjectSet& set, const TouchProtocol& protocol,
                                            std::size_t draws);

struct VariationResult {
  StudyVariation variation;
  double friction = 0.0, activation_gain = 0.0;
  std::vector<double> means;  // N/m, in the order of stiffness_conditions()
  // Of a variation that was fitted again: did the fit reach its two targets (operator_calibration.hpp)? One
  // that did not says nothing about what the targets leave open.
  bool plain_met = true, magnetic_met = true;
  bool met() const { return plain_met && magnetic_met; }
  std::vector<CountedEnds> ends{};  // of the means, in their order
};

// One job each, in the run's threads and journal; protocol and integrator are the variations' own.
std::vector<VariationResult> run_variations(const std::vector<StudyVariation>& variations,
                                            const CalibrationSettings& calibration, const StiffnessRun& run);

// What holds in how many of the results, as sentences with their counts. Results whose fit missed count
// neither way.
struct VariationFinding {
  std::string claim;
  std::size_t holds = 0, of = 0;
  std::size_t missed = 0;  // left out
};
std::vector<VariationFinding> findings_of(const std::vector<VariationResult>& results);

}  // namespace kmax::experiment
