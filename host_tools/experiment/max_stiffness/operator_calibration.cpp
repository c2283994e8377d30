#include "host_tools/experiment/max_stiffness/operator_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

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
      const std::size_t searches = settings.likely_friction > 0.0 || settings.likely_gain > 0.0 ? 4 : 2;
      run_.progress = [this, searches, report = run.progress](std::size_t, std::size_t) {
        report(result.steps.size(), searches * static_cast<std::size_t>(settings_.most_steps));
      };
    }
  }

  double mean(double friction, double gain, bool magnetic) {
    const SubjectSet set = with(set_, friction, gain);
    const StiffnessCondition condition = constant_field(magnetic ? 2.0 : 0.0);
    std::vector<StiffnessJob> jobs;
    for (std::size_t i = 0; i < set.subjects.size(); ++i) {
      jobs.push_back({"", touch_setup(set.device, set.subjects[i].person, condition),
                      at_low_.empty() ? 0.0 : at_low_[i].stiffness});
      run_.changes.apply(jobs.back().setup);
    }
    found_ = run_stiffness_jobs(jobs, run_);
    for (const MaxStiffness& person : found_) result.simulated_time += person.simulated_time;
    result.steps.push_back({friction, gain, magnetic, mean_stiffness(found_)});
    return result.steps.back().stiffness;
  }

  /// The value in [0, most] whose stiffness comes nearest to the target, and that; `likely`: as in the
  /// settings.
  template <typename Measure>
  std::pair<double, double> search(double most, double likely, double target, const Measure& measure) {
    if (!(likely > 0.0 && likely < most)) return interval_search(most, std::nullopt, target, measure);
    const auto rough = interval_search(most, Start{likely, 1.25, true}, target, measure);
    if (rough.first == 0.0) return rough;
    return interval_search(most, Start{rough.first, 1.02, false}, target, measure);
  }

  OperatorCalibration result;

 private:
  struct Start {
    double value;
    double factor;  ///< between it and the next; squared for each one after, until both ends are known
    bool rough;     ///< each person begins where they were at the lower end
  };

  template <typename Measure>
  std::pair<double, double> interval_search(double most, std::optional<Start> start, double target,
                                            const Measure& measure) {
    double low = 0.0, high = most, best = most, nearest = HUGE_VAL, stiffness = 0.0;
    bool low_known = !start, high_known = !start;
    at_low_.clear();
    for (int step = 0; step < settings_.most_steps; ++step) {
      double value = 0.5 * (low + high);
      if (!low_known && !high_known) {
        value = start->value;
      } else if (!high_known) {
        value = std::min(start->factor * low, most);
        start->factor *= start->factor;
      } else if (!low_known) {
        // If even 0 gives too much, the target is out of reach, which is asked after two steps.
        value = start->rough && step > 2 ? 0.0 : high / start->factor;
        start->factor *= start->factor;
      }
      const double found = measure(value);
      if (std::abs(found - target) < nearest) {
        nearest = std::abs(found - target);
        best = value;
        stiffness = found;
      }
      const bool out_of_reach = found < target ? value == most : value == 0.0;
      if (nearest <= settings_.tolerance || out_of_reach) break;
      (found < target ? low : high) = value;
      (found < target ? low_known : high_known) = true;
      if (start && start->rough && found < target) at_low_ = found_;
    }
    at_low_.clear();
    return {best, stiffness};
  }

  SubjectSet set_;
  const CalibrationSettings& settings_;
  StiffnessRun run_;
  // In the order of the people: of the last mean, and at the interval's lower end; empty: not begun from
  // there.
  std::vector<MaxStiffness> found_, at_low_;
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
    std::tie(friction, plain) =
        fit.search(settings.friction_most, settings.likely_friction, settings.plain_target,
                   [&](double value) { return fit.mean(value, 0.0, false); });
  } else {
    plain = fit.mean(friction, 0.0, false);
  }
  const auto [gain, magnetic] =
      fit.search(settings.gain_most, settings.likely_gain, settings.magnetic_target,
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
