#include "host_tools/experiment/max_stiffness/adaptive_gap.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace kmax::experiment {
namespace {

using control::AdaptiveMode;

StiffnessCondition constant(double coefficient) {
  StiffnessCondition condition;
  condition.name = fmt::format("F_MC = {:g} N", coefficient);
  condition.magnetic_coefficient = coefficient;
  return condition;
}

StiffnessCondition adaptive(AdaptiveMode mode) {
  StiffnessCondition condition;
  condition.adaptive = true;
  condition.mode = mode;
  return condition;
}

double mean_of(const SubjectSet& set, const StiffnessRun& run, const std::string& name,
               const StiffnessCondition& condition, CountedEnds* ends = nullptr, double hold_time = 0.0) {
  std::vector<StiffnessJob> jobs;
  for (const Subject& subject : set.subjects) {
    StiffnessJob job{fmt::format("gap: {}, {}, limit {:g} N", name, subject.name, set.device.force_limit),
                     touch_setup(set.device, subject.person, condition)};
    if (hold_time > 0.0) job.setup.wall.wall.adaptive.hold_time = static_cast<float>(hold_time);
    jobs.push_back(std::move(job));
  }
  const std::vector<MaxStiffness> found = run_stiffness_jobs(jobs, run);
  if (ends != nullptr) *ends = counted_ends(found);
  return mean_stiffness(found);
}

/// F_MC at the moment of contact, mean over the people.
double coefficient_at_contact(const SubjectSet& set, double speed, double stiffness) {
  double sum = 0.0;
  for (const Subject& subject : set.subjects) {
    TouchSetup setup = touch_setup(set.device, subject.person, adaptive(AdaptiveMode::latched));
    setup.motion.approach_speed = speed;
    setup.wall.wall.stiffness = static_cast<float>(stiffness);
    sum += simulate_touch(setup).coefficient_at_contact;
  }
  return sum / static_cast<double>(set.subjects.size());
}

}  // namespace

std::vector<ApproachResult> run_approaches(const SubjectSet& set, const std::vector<double>& speeds,
                                           const StiffnessRun& run) {
  constexpr double for_ever = 1000.0;  // s
  std::vector<ApproachResult> results;
  for (const double speed : speeds) {
    StiffnessRun single = run;
    single.protocol.approach_speeds = {speed};
    ApproachResult result{};
    result.approach_speed = speed;
    const std::string at = fmt::format(" at {:g} m/s", speed);
    result.constant = mean_of(set, single, "2 N" + at, constant(2.0), &result.constant_ends);
    for (const AdaptiveMode mode : {AdaptiveMode::instant, AdaptiveMode::latched, AdaptiveMode::peak_hold}) {
      result.by_mode.push_back(mean_of(set, single, fmt::format("mode {}{}", static_cast<int>(mode), at),
                                       adaptive(mode), &result.by_mode_ends.emplace_back()));
    }
    result.held =
        mean_of(set, single, "held" + at, adaptive(AdaptiveMode::peak_hold), &result.held_ends, for_ever);
    result.coefficient_at_contact = coefficient_at_contact(set, speed, result.held);
    results.push_back(std::move(result));
  }
  return results;
}

NeededCoefficient coefficient_for(const SubjectSet& set, double target, const StiffnessRun& run) {
  NeededCoefficient best;
  double low = 0.0, high = 4.0, nearest = HUGE_VAL;
  for (int step = 0; step < 10; ++step) {
    const double middle = 0.5 * (low + high);
    const double mean = mean_of(set, run, fmt::format("constant {} N", middle), constant(middle));
    if (std::abs(mean - target) < nearest) {
      nearest = std::abs(mean - target);
      best.coefficient = middle;
      best.mean = mean;
    }
    (mean < target ? low : high) = middle;
  }
  // Eq. 7: F_MC = gain V / V_max + offset.
  const control::AdaptiveCoefficientConfig<double> law;
  best.approach_speed = (best.coefficient - law.offset) / law.gain * law.velocity_max;
  return best;
}

}  // namespace kmax::experiment
