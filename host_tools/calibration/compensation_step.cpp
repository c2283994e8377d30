#include "host_tools/calibration/compensation_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "host_tools/calibration/centring.hpp"
#include "host_tools/calibration/cogging_fit.hpp"
#include "host_tools/calibration/trip_diagnosis.hpp"

namespace kmax::calibration {

namespace {
// Slow and stiff: a handle that swings against the cogging, rather than being led over it, shows too little
// of it, or the opposite. With 6 kN/m and 0.1 kg that begins at 40 Hz; 4 mm/s over a cogging of 0.75 mm is 5
// Hz.
constexpr double sweep_speed = 0.004;  // m/s
constexpr double stiffness = 6000.0;   // N/m
constexpr double sweep_share = 0.7;    // of the travel, to each side
constexpr std::size_t samples = 4000;

struct Sweep {
  std::vector<double> force, angle;
  double interval = 0.0;
};

ExcitationPlan moved_by(double stroke, const MotorKnowledge& known) {
  ExcitationPlan spring;
  spring.kind = "position";
  spring.stiffness = stiffness;
  // Three quarters of critical.
  spring.damping = 1.5 * std::sqrt(spring.stiffness * known.mass);
  spring.speed = sweep_speed;
  spring.stroke = stroke;
  spring.duration = std::abs(stroke) / sweep_speed + 2.0;
  return spring;
}

// By way of the middle, from where all of the travel can be used.
void go_back(Bench& bench, const MotorKnowledge& known, double displacement) {
  centre_handle(bench, known);
  bench.disarm();
  const ExcitationPlan there = moved_by(displacement - bench.displacement(), known);
  require_no_trip(bench.record(there, {{"count"}, 10, 10, there.duration - 1.0}));
}

// `from`: m, where the handle stands.
Sweep sweep(Bench& bench, const MotorKnowledge& known, double from, double stroke) {
  const double time = std::abs(stroke) / sweep_speed;
  const int interval = std::max(1, static_cast<int>(time / known.tick / static_cast<double>(samples)));
  bool cut_off = false;
  const Recording seen = bench.repeat([&] {
    if (std::exchange(cut_off, true)) go_back(bench, known, from);
    return bench.record(moved_by(stroke, known), {{"current", "count"}, samples, interval, 0.0});
  });
  require_no_trip(seen);
  Sweep result;
  result.interval = seen.interval;
  for (const double current : seen.of("current")) result.force.push_back(known.force_per_ampere() * current);
  for (const double count : seen.of("count"))
    result.angle.push_back(2.0 * std::numbers::pi * count / known.counts_per_turn);
  return result;
}
}  // namespace

void CompensationStep::run(Bench& bench, MotorKnowledge& known, StepReport& report) {
  bench.repeat([&] { centre_handle(bench, known); });
  bench.disarm();
  const double reach = sweep_share * bench.travel();
  bench.tell("compensation: moving to one side");
  const double middle = bench.displacement();
  sweep(bench, known, middle, -reach - middle);
  std::vector<Sweep> sweeps;
  for (int i = 0; i < bench.settings().repetitions; ++i) {
    for (const double from : {-reach, reach}) {
      bench.tell(
          fmt::format("compensation: sweep {} of {}", sweeps.size() + 1, 2 * bench.settings().repetitions));
      sweeps.push_back(sweep(bench, known, from, -2.0 * from));
    }
  }
  const double end = bench.displacement();
  sweep(bench, known, end, -end);
  std::vector<CoggingSweep> views;
  for (const Sweep& one : sweeps) views.push_back({one.force, one.angle});
  CoggingFitConfig config;
  config.interval = sweeps.front().interval;
  config.counts_per_turn = known.counts_per_turn;
  const CoggingFit fit = fit_cogging(views, config);
  // A short travel shows no cogging; friction and the constant force are valid all the same.
  if (!fit.finding.is_none() && fit.finding.cause != CoggingCause::range_too_short)
    throw StepFailed({"compensation_not_resolved", to_string(fit.finding), "allow more --travel"});
  const auto add = [&](const char* name, const Estimate& estimate) {
    report.values.push_back({fmt::format("compensation.{}", name), estimate.known() ? estimate.value : 0.0,
                             estimate.known() ? estimate.standard_error : 0.0, std::string(estimate.unit),
                             // The bound is 0 in the device meanwhile.
                             std::string_view(name) == "limit"
                                 ? known.compensation_limit
                                 : bench.number(fmt::format("compensation.{}", name))});
  };
  const double friction = std::max(fit.friction.value, 0.0);
  const double found_before =
      bench.number("guard.friction");  // by the motion step, which is the better judge
  const double counted_on = found_before > 0.0 ? std::min(found_before, friction) : friction;
  add("friction", {friction, fit.friction.standard_error, "N"});
  add("limit", {compensation_share * counted_on, compensation_share * fit.friction.standard_error, "N"});
  add("cogging_periods", {static_cast<double>(fit.cogging_periods), 0.0, ""});
  add("cogging_cosine_1", fit.cogging_cosine_1);
  add("cogging_sine_1", fit.cogging_sine_1);
  add("cogging_cosine_2", fit.cogging_cosine_2);
  add("cogging_sine_2", fit.cogging_sine_2);
  add("gravity_constant", fit.gravity_constant);
  add("gravity_cosine", fit.gravity_cosine);
  add("gravity_sine", fit.gravity_sine);
  std::vector<std::string> results;
  for (const IdentifiedValue& value : report.values)
    results.push_back(fmt::format("{}={:.9g}", value.name, value.value));
  if (!(found_before > 0.0)) results.push_back(fmt::format("guard.friction={:.9g}", friction));
  bench.set_result_at_end(results);
}

}  // namespace kmax::calibration
