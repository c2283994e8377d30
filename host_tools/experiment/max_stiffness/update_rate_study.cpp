#include "host_tools/experiment/max_stiffness/update_rate_study.hpp"

#include <fmt/format.h>

#include <string_view>

namespace kmax::experiment {
namespace {

using control::VelocityEstimatorKind;

std::string_view to_string(VelocityEstimatorKind kind) {
  switch (kind) {
    case VelocityEstimatorKind::difference:
      return "difference";
    case VelocityEstimatorKind::low_pass:
      return "low_pass";
    case VelocityEstimatorKind::foaw:
      return "foaw";
    case VelocityEstimatorKind::foaw_end_fit:
      return "foaw_end_fit";
    case VelocityEstimatorKind::tracking:
      return "tracking";
  }
  return "";
}

TouchSetup setup_of(const RateCase& setting, const RateStudySettings& settings) {
  TouchSetup setup;
  setup.device = settings.device;
  setup.device.force_limit = 0.0;
  setup.device.delay = setting.delay_samples / setting.rate + setting.delay;
  setup.person = settings.person;
  setup.wall = touched_wall(setting.rate, setting.count_length, 0.0);
  setup.wall.wall.kind = control::WallKind::plain;
  setup.wall.wall.damping = static_cast<float>(setting.wall_damping);
  setup.wall.velocity.kind = setting.estimator;
  return setup;
}

}  // namespace

std::vector<double> study_rates() {
  return {500.0, 1000.0, 2000.0, 5000.0, 10000.0, 20000.0};
}

std::string name_of(const RateCase& setting) {
  if (setting.wall_damping > 0.0)
    return fmt::format("damping {:g} N s/m, {}", setting.wall_damping, to_string(setting.estimator));
  if (setting.delay_samples > 0.0) return fmt::format("{:g} sample of delay", setting.delay_samples);
  if (setting.delay > 0.0) return fmt::format("{:g} ms of delay", setting.delay * 1e3);
  return "no damping";
}

std::vector<RateCase> rate_cases(double count_length, RateMeasure measure) {
  std::vector<RateCase> cases;
  for (const double rate : study_rates()) {
    RateCase setting{.rate = rate, .count_length = count_length, .measure = measure};
    cases.push_back(setting);
    setting.delay_samples = 1.0;
    cases.push_back(setting);
    setting.delay_samples = 0.0;
    setting.delay = 0.5e-3;
    cases.push_back(setting);
    setting.delay = 0.0;
    setting.wall_damping = 2.0;
    for (const VelocityEstimatorKind kind :
         {VelocityEstimatorKind::difference, VelocityEstimatorKind::low_pass, VelocityEstimatorKind::foaw,
          VelocityEstimatorKind::foaw_end_fit, VelocityEstimatorKind::tracking}) {
      setting.estimator = kind;
      cases.push_back(setting);
    }
  }
  return cases;
}

std::vector<RateResult> run_rate_study(const std::vector<RateCase>& cases,
                                       const RateStudySettings& settings) {
  // Every encoder has a threshold of its own, which is the protocol's: one run for each case, one job in it.
  return collect_jobs<RateResult>(
      cases.size(), settings.run.threads,
      [&](std::size_t index) {
        const RateCase& setting = cases[index];
        StiffnessRun run;
        run.protocol = settings.run.protocol;
        if (setting.measure == RateMeasure::moves) {
          run.protocol.threshold = 3.0 * setting.count_length;
        } else {
          run.protocol.force_threshold = 1.0;
        }
        run.steps = {.first = 100.0, .step = 10.0, .growth = 0.03, .last = 1e6};
        run.journal = settings.run.journal;
        const StiffnessJob job{
            fmt::format("rate {:g} Hz, count {:g} m, {}, measure {}", setting.rate, setting.count_length,
                        name_of(setting), static_cast<int>(setting.measure)),
            setup_of(setting, settings)};
        return RateResult{setting, run_stiffness_jobs({job}, run).front()};
      },
      settings.run.progress);
}

}  // namespace kmax::experiment
