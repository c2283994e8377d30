#include "host_tools/experiment/max_stiffness/operator_calibration.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {
namespace {

SubjectSet with(const SubjectSet& set, double friction, double gain) {
  SubjectSet changed = set;
  changed.device.friction = friction;
  for (Subject& subject : changed.subjects) subject.person.activation_gain = gain;
  return changed;
}

StiffnessCondition constant_field(double coefficient) {
  for (const StiffnessCondition& condition : stiffness_conditions()) {
    if (!condition.adaptive() && condition.magnetic_coefficient == coefficient) return condition;
  }
  throw std::logic_error("no such condition");
}

class Fit {
 public:
  Fit(const SubjectSet& set, const CalibrationSettings& settings, const StiffnessRun& run)
      : set_(set), settings_(settings), run_(run) {
    // Every step has other numbers: a journal of the run knows none of them.
    run_.journal = nullptr;
    if (run.progress) {
      run_.progress = [this, report = run.progress](std::size_t, std::size_t) {
        report(result.steps.size(), 2 * static_cast<std::size_t>(settings_.most_steps));
      };
    }
  }

  double mean(double friction, double gain, bool magnetic) {
    const MaxStiffnessStudy study =
        run_max_stiffness_study(with(set_, friction, gain), {constant_field(magnetic ? 2.0 : 0.0)}, run_);
    const double stiffness = study.conditions.front().mean();
    result.simulated_time += study.simulated_time;
    result.steps.push_back({friction, gain, magnetic, stiffness});
    return stiffness;
  }

  /// The value in [0, most] whose stiffness comes nearest to the target.
  template <typename Measure>
  std::pair<double, double> search(double most, double target, const Measure& measure) {
    double low = 0.0, high = most, best = most, nearest = HUGE_VAL, stiffness = 0.0;
    for (int step = 0; step < settings_.most_steps; ++step) {
      const double middle = 0.5 * (low + high);
      const double found = measure(middle);
      if (std::abs(found - target) < nearest) {
        nearest = std::abs(found - target);
        best = middle;
        stiffness = found;
      }
      if (nearest <= settings_.tolerance) break;
      (found < target ? low : high) = middle;
    }
    return {best, stiffness};
  }

  OperatorCalibration result;

 private:
  SubjectSet set_;
  const CalibrationSettings& settings_;
  StiffnessRun run_;
};

}  // namespace

CalibrationSettings paper_targets() {
  CalibrationSettings settings{};
  for (const paper::MaxStiffness& number : paper::max_stiffness) {
    if (number.adaptive) continue;
    (number.magnetic_coefficient == 0.0 ? settings.plain_target : settings.magnetic_target) =
        number.stiffness;
  }
  return settings;
}

OperatorCalibration calibrate_operator(const SubjectSet& set, const CalibrationSettings& settings,
                                       const StiffnessRun& run) {
  if (set.subjects.empty()) throw std::invalid_argument("nobody to calibrate: the subject set is empty");
  Fit fit(set, settings, run);
  double friction = set.device.friction;
  double plain = 0.0;
  if (settings.fit_friction) {
    std::tie(friction, plain) = fit.search(settings.friction_most, settings.plain_target,
                                           [&](double value) { return fit.mean(value, 0.0, false); });
  } else {
    plain = fit.mean(friction, 0.0, false);
  }
  const auto [gain, magnetic] =
      fit.search(settings.gain_most, settings.magnetic_target,
                 [&, force = friction](double value) { return fit.mean(force, value, true); });
  OperatorCalibration result = std::move(fit.result);
  result.friction = friction;
  result.activation_gain = gain;
  result.plain = plain;
  result.magnetic = magnetic;
  result.plain_met = std::abs(plain - settings.plain_target) <= plain_tolerance;
  result.magnetic_met = std::abs(magnetic - settings.magnetic_target) <= magnetic_tolerance;
  result.set = with(set, friction, gain);
  result.set.fitted = Fitted{settings.plain_target, settings.magnetic_target, set.device.force_limit};
  return result;
}

}  // namespace kmax::experiment
