#include "host_tools/calibration/motion_step.hpp"

#include "host_tools/calibration/compensation_step.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/calibration/mechanical_excitation.hpp"
#include "host_tools/calibration/motion_fit.hpp"
#include "host_tools/calibration/repeated_value.hpp"
#include "host_tools/calibration/shaking.hpp"

namespace kmax::calibration {

namespace {
constexpr std::size_t samples = 4000;
constexpr int waves = 24;  // half periods in a record
constexpr double stroke_share = 0.25;

struct Motion {
  std::vector<double> force, position;
};

Motion motion_of(const Recording& seen, const MotorKnowledge& known) {
  Motion motion;
  for (const double current : seen.of("current")) motion.force.push_back(known.force_per_ampere() * current);
  for (const double count : seen.of("count")) motion.position.push_back(known.count_length() * count);
  return motion;
}

[[noreturn]] void fail(const MotionFit& fit) {
  const std::string words = to_string(fit.finding);
  switch (fit.finding.cause) {
    case MotionCause::no_motion:
      throw StepFailed({"motor_blocked", words, "free the handle, or raise --current"});
    case MotionCause::reversed:
      throw StepFailed({"direction_wrong", words, "calibrate the encoder first: --steps encoder"});
    default:
      throw StepFailed(
          {"motion_not_resolved", words, "nobody may hold the handle; raise --current or --travel"});
  }
}

// One record for each half period (ticks), fitted together.
MotionFit fit_of(const MotorKnowledge& known, const std::vector<Shaking*>& shakings,
                 const std::vector<int>& half_periods) {
  const int longest = *std::max_element(half_periods.begin(), half_periods.end());
  const int interval = std::max(1, waves * longest / static_cast<int>(samples));
  std::vector<Motion> motions;
  for (std::size_t i = 0; i < shakings.size(); ++i) {
    shakings[i]->set_half_period(half_periods[i]);
    motions.push_back(
        motion_of(shakings[i]->record({"voltage", "current", "count"}, samples, interval), known));
  }
  std::vector<MotionRecord> records;
  for (const Motion& motion : motions) records.push_back({motion.force, motion.position});
  MotionFitConfig config;
  config.interval = interval * known.tick;
  config.count_length = known.count_length();
  config.transmission = known.transmission;
  const MotionFit fit = fit_motion(records, config);
  if (!fit.finding.is_none()) fail(fit);
  return fit;
}
}  // namespace

void MotionStep::run(Bench& bench, MotorKnowledge& known, StepReport& report) {
  Shaking strong(bench, known, known.current, stroke_share * bench.travel());
  strong.prepare();
  const double rough = fit_of(known, {&strong}, {strong.half_period()}).friction.value;
  const double wanted = motion_force_ratio * std::max(rough, 0.0) / known.force_per_ampere();
  Shaking gentle(bench, known, std::clamp(wanted, 0.15 * known.current, known.current),
                 stroke_share * bench.travel());
  gentle.prepare();
  const int slow = gentle.half_period();
  const int fast = std::max(20, static_cast<int>(slow * motion_second_period));
  std::vector<Estimate> mass, damping, friction;
  for (int i = 0; i < bench.settings().repetitions; ++i) {
    bench.tell(fmt::format("motion: {} of {}", i + 1, bench.settings().repetitions));
    const MotionFit fit = fit_of(known, {&strong, &gentle, &gentle}, {strong.half_period(), slow, fast});
    mass.push_back(fit.mass);
    damping.push_back(fit.damping);
    friction.push_back(fit.friction);
  }
  report.values.push_back(repeated_value("device.mass", mass, "kg", known.mass));
  report.values.push_back(repeated_value("friction", friction, "N", std::nullopt));
  report.values.push_back(repeated_value("damping", damping, "N s/m", std::nullopt));
  constexpr double fine_friction = 0.02;  // N, nothing that a hand feels
  require_repeatable(report.values[0], 0.0, "motion_not_resolved");
  require_repeatable(report.values[1], fine_friction, "motion_not_resolved");
  known.mass = report.values[0].value;
  known.mass_known = true;
  known.friction = report.values[1].value;
  bench.set_result({fmt::format("device.mass={:.9g}", known.mass),
                    fmt::format("guard.friction={:.9g}", std::max(known.friction, 0.0)),
                    fmt::format("guard.damping={:.9g}", std::max(report.values[2].value, 0.0))});
  // A bound from before must not be beyond the friction that was found now.
  const double allowed = compensation_share * std::max(known.friction, 0.0);
  if (known.compensation_limit > allowed && !bench.settings().has(StepSet::compensation))
    bench.set_result_at_end({fmt::format("compensation.limit={:.9g}", allowed)});
}

}  // namespace kmax::calibration
