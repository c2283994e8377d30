// What the motor does to the handle: torque constant, mass and friction, cogging.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "host_tools/calibration/back_emf_fit.hpp"
#include "host_tools/calibration/cogging_fit.hpp"
#include "host_tools/calibration/motion_fit.hpp"
#include "host_tools/calibration/shaking.hpp"

namespace kmax::calibration {

namespace {
constexpr double stroke_share = 0.25;  // of the travel, peak to peak

BackEmfConfig back_emf_config(const MotorKnowledge& known) {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  BackEmfConfig config;
  config.tick = known.tick;
  config.synchronous = !known.brushed();
  config.pole_pairs = known.brushed() ? 1 : known.pole_pairs;
  config.inductance = known.inductance_q > 0.0 ? known.inductance_q : known.inductance;
  config.inductance_d = known.inductance;
  config.resistance = known.resistance;
  config.resistance_error = known.resistance_error > 0.0 ? known.resistance_error : unknown;
  const double volts = known.supply * known.electronics->pwm_hz();
  config.dead_time_voltage = volts * known.dead_time;
  config.dead_time_voltage_error = known.dead_time_error > 0.0 ? volts * known.dead_time_error : unknown;
  config.dead_time_current = known.dead_time_band();
  config.counts_per_turn = known.counts_per_turn;
  return config;
}

[[noreturn]] void fail(const BackEmfFit& fit) {
  const std::string words = to_string(fit.finding);
  switch (fit.finding.cause) {
    case BackEmfCause::no_motion:
      throw StepFailed({"motor_blocked", words, "free the handle, or raise --current"});
    case BackEmfCause::reversed:
      throw StepFailed({"direction_wrong", words, "calibrate the encoder first: --steps encoder"});
    case BackEmfCause::no_voltage:
      throw StepFailed({"encoder_without_motor", words,
                        "the encoder turns and the motor does not: check the coupling between them"});
    default:
      throw StepFailed({"torque_constant_not_resolved", words, "raise --current or --travel"});
  }
}
}  // namespace

void find_torque_constant(Calibration& run) {
  Bench& bench = run.bench;
  MotorKnowledge& known = run.known;
  StepReport& report = run.report;
  Shaking shaking(bench, known, known.current, stroke_share * bench.travel());
  shaking.prepare();
  const double radian_per_count = 2.0 * std::numbers::pi / known.counts_per_turn;
  std::vector<Estimate> constants;
  for (int i = 0; i < run.settings.repetitions; ++i) {
    bench.progress(fmt::format("torque constant: {} of {}", i + 1, run.settings.repetitions));
    std::vector<std::string> channels = {"voltage", "current", "count"};
    if (!known.brushed()) channels.push_back("electrical_angle");
    const Waveforms seen = shaking.record(channels, 2000, 1);
    std::vector<double> shaft;
    for (const double count : seen.of("count")) shaft.push_back(count * radian_per_count);
    BackEmfRecord record{seen.of("voltage"), seen.of("current"), shaft, {}, {}};
    if (!known.brushed()) record.electrical_angle = seen.of("electrical_angle");
    const BackEmfFit fit = fit_back_emf({&record, 1}, back_emf_config(known));
    if (!fit.finding.is_none()) fail(fit);
    constants.push_back(fit.torque_constant);
  }
  const IdentifiedValue value =
      repeated_value("motor.torque_constant", constants, "N m/A", known.torque_constant);
  report.values.push_back(value);
  constexpr double largest_spread = 0.1;
  if (value.spread > largest_spread * value.value)
    throw StepFailed({"encoder_slipping",
                      fmt::format("the torque constant differs by {:.0f} % from one measurement to the next",
                                  100.0 * value.spread / value.value),
                      "tighten the encoder's hub and clean its disc; nobody may hold the handle"});
  // Lost travel scales everything that is measured alike: only a reference can show it.
  constexpr double largest_change = 0.2;
  const double before = known.torque_constant;
  if (known.calibrated && std::abs(value.value - before) > largest_change * before)
    throw StepFailed(
        {"encoder_slipping",
         fmt::format("the torque constant is {:.3g} N m/A and was {:.3g} N m/A when this motor was last "
                     "calibrated: the encoder loses a share of the travel",
                     value.value, before),
         "tighten the encoder's hub; after an exchange of motor or encoder: 'kmax set motor.calibrated=no', "
         "and calibrate again"});
  known.torque_constant = value.value;
  bench.set_result({fmt::format("motor.torque_constant={:.9g}", value.value)});
}

namespace {
constexpr std::size_t motion_samples = 4000;
constexpr int waves = 24;  // half periods in a record

// compensation.limit as a share of the friction: room for friction that changes (force_compensation.hpp).
constexpr double compensation_share = 0.7;

struct Motion {
  std::vector<double> force, position;
};

Motion motion_of(const Waveforms& seen, const MotorKnowledge& known) {
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
  const int interval = std::max(1, waves * longest / static_cast<int>(motion_samples));
  std::vector<Motion> motions;
  for (std::size_t i = 0; i < shakings.size(); ++i) {
    shakings[i]->set_half_period(half_periods[i]);
    motions.push_back(
        motion_of(shakings[i]->record({"voltage", "current", "count"}, motion_samples, interval), known));
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

void find_motion(Calibration& run) {
  Bench& bench = run.bench;
  MotorKnowledge& known = run.known;
  StepReport& report = run.report;
  const double mass_before = known.mass;
  Shaking strong(bench, known, known.current, stroke_share * bench.travel());
  strong.prepare();
  const MotionFit rough = fit_of(known, {&strong}, {strong.half_period()});
  // Not good enough to be kept, but it bounds how far the weaker waves can throw the handle if its encoder
  // dies.
  known.mass = rough.mass.value;
  known.mass_known = true;
  const double wanted = motion_force_ratio * std::max(rough.friction.value, 0.0) / known.force_per_ampere();
  std::vector<Estimate> mass, damping, friction;
  const auto shake_with = [&](double current) {
    Shaking gentle(bench, known, current, stroke_share * bench.travel());
    gentle.prepare();
    const int slow = gentle.half_period();
    const int fast = std::max(20, static_cast<int>(slow * motion_second_period));
    for (int i = 0; i < run.settings.repetitions; ++i) {
      bench.progress(fmt::format("motion: {} of {}", i + 1, run.settings.repetitions));
      const MotionFit fit = fit_of(known, {&strong, &gentle, &gentle}, {strong.half_period(), slow, fast});
      mass.push_back(fit.mass);
      damping.push_back(fit.damping);
      friction.push_back(fit.friction);
    }
  };
  // Where the friction is small a detent of the cogging may hold the handle all the same.
  for (double current = std::clamp(wanted, 0.15 * known.current, known.current);;
       current = std::min(2.0 * current, known.current)) {
    try {
      shake_with(current);
      break;
    } catch (const StepFailed& failed) {
      if (failed.diagnosis().cause != "motor_blocked" || current >= known.current) throw;
    }
    mass.clear(), damping.clear(), friction.clear();
  }
  report.values.push_back(repeated_value("device.mass", mass, "kg", mass_before));
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
  if (known.compensation_limit > allowed && !run.settings.has(StepSet::compensation))
    run.set_at_end({fmt::format("compensation.limit={:.9g}", allowed)});
}

namespace {
// Slow and stiff: a handle that swings against the cogging, rather than being led over it, shows too little
// of it, or the opposite. With 6 kN/m and 0.1 kg that begins at 40 Hz; 4 mm/s over a cogging of 0.75 mm is 5
// Hz.
constexpr double sweep_speed = 0.004;  // m/s
constexpr double stiffness = 6000.0;   // N/m
constexpr double sweep_share = 0.7;    // of the travel, to each side
constexpr std::size_t sweep_samples = 4000;

struct RecordedSweep {
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
RecordedSweep sweep(Bench& bench, const MotorKnowledge& known, double from, double stroke) {
  const double time = std::abs(stroke) / sweep_speed;
  const int interval = std::max(1, static_cast<int>(time / known.tick / static_cast<double>(sweep_samples)));
  bool cut_off = false;
  const Waveforms seen = bench.repeat([&] {
    if (std::exchange(cut_off, true)) go_back(bench, known, from);
    return bench.record(moved_by(stroke, known), {{"current", "count"}, sweep_samples, interval, 0.0});
  });
  require_no_trip(seen);
  RecordedSweep result;
  result.interval = seen.interval;
  for (const double current : seen.of("current")) result.force.push_back(known.force_per_ampere() * current);
  for (const double count : seen.of("count"))
    result.angle.push_back(2.0 * std::numbers::pi * count / known.counts_per_turn);
  return result;
}
}  // namespace

void map_compensation(Calibration& run) {
  Bench& bench = run.bench;
  MotorKnowledge& known = run.known;
  StepReport& report = run.report;
  bench.repeat([&] { centre_handle(bench, known); });
  bench.disarm();
  const double reach = sweep_share * bench.travel();
  bench.progress("compensation: moving to one side");
  const double middle = bench.displacement();
  sweep(bench, known, middle, -reach - middle);
  std::vector<RecordedSweep> sweeps;
  for (int i = 0; i < run.settings.repetitions; ++i) {
    for (const double from : {-reach, reach}) {
      bench.progress(
          fmt::format("compensation: sweep {} of {}", sweeps.size() + 1, 2 * run.settings.repetitions));
      sweeps.push_back(sweep(bench, known, from, -2.0 * from));
    }
  }
  const double end = bench.displacement();
  sweep(bench, known, end, -end);
  // Nothing is fitted to this last way, and nothing else would say that its encoder has died.
  const double left = bench.displacement();
  if (std::abs(left) > 0.25 * reach)
    throw StepFailed({"not_led_back",
                      fmt::format("led back by {:.1f} mm to the middle, the handle is {:.1f} mm away from it",
                                  1000.0 * std::abs(end), 1000.0 * std::abs(left)),
                      "see whether something holds the handle; else check the encoder's cable and mounting"});
  std::vector<CoggingSweep> views;
  for (const RecordedSweep& one : sweeps) views.push_back({one.force, one.angle});
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
  run.set_at_end(results);
}

}  // namespace kmax::calibration
