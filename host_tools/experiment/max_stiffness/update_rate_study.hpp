#pragma once
// The largest stiffness of one device by the rate of its haptic loop, the resolution of its encoder and the
// velocity estimator that its virtual damping works with. One named person; the force is not clipped.
//
// What counts as unstable decides these numbers more than anything else, so there are two measures:
//   moves  more than three counts of the encoder peak to peak. A wall whose force swings by many newtons from
//          one count to the next passes.
//   feels  more than 1 N of force peak to peak. One count of a wall of 1 N / count length is 1 N, so nothing
//   can
//          be found above that: 18 N/mm with 0.055 mm, 182 N/mm with 5.5 um, whatever the rate.
//
// The stiffness rises by 3 % a step: that is the resolution of the result.

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

namespace kmax::experiment {

enum class RateMeasure : std::uint8_t { moves, feels };

struct RateCase {
  double rate = 500.0;          // Hz
  double count_length = 55e-6;  // m
  double wall_damping = 0.0;    // N s/m
  control::VelocityEstimatorKind estimator = control::VelocityEstimatorKind::difference;
  double delay_samples = 0.0;  // from the sample to its force
  double delay = 0.0;          // s, added to it
  RateMeasure measure = RateMeasure::moves;
};

struct RateResult {
  RateCase setting;
  MaxStiffness found;
};

struct RateStudySettings {
  simulation::DeviceModel device;  // its force limit and delay are not used
  simulation::OperatorModel person;
  StiffnessRun run;  // its steps and threshold are not used
};

std::vector<double> study_rates();  // Hz, 500 to 20,000

std::vector<RateResult> run_rate_study(const std::vector<RateCase>& cases, const RateStudySettings& settings);

// Every rate with: no damping; a delay of one sample; a delay of 0.5 ms; damping of 2 N s/m with each
// estimator. For one encoder and one measure.
std::vector<RateCase> rate_cases(double count_length, RateMeasure measure);

std::string name_of(const RateCase& setting);  // without rate and encoder

}  // namespace kmax::experiment
