// Resistance and inductance of the winding, and whether all phases and both current sensors are there.
#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "host_tools/calibration/applied_voltage.hpp"
#include "host_tools/calibration/phase_response.hpp"
#include "host_tools/calibration/step.hpp"
#include "host_tools/calibration/winding_excitation.hpp"
#include "host_tools/calibration/winding_fit.hpp"

namespace kmax::calibration {

namespace {
constexpr double quarter_turn = std::numbers::pi / 2.0;
constexpr std::size_t settling_ticks = 100;  // of a square wave that comes up
constexpr std::size_t most_samples = 1500;   // of a capture: more cost time on the line and gain little
constexpr double seen_current = 0.05;        // A, from which a response is more than noise

// The pulse that acted at each sample, without the rounding of the timer's ticks being a part of the model's
// error.
std::vector<double> applied_brushed(const MotorKnowledge& known, const Waveforms& recording) {
  std::vector<double> applied;
  const auto asked = recording.of("voltage"), supply = recording.of("supply");
  for (std::size_t i = 0; i < asked.size(); ++i)
    applied.push_back(applied_brushed_voltage(*known.electronics, asked[i], supply[i]));
  return applied;
}

std::vector<double> applied_along(const MotorKnowledge& known, std::span<const double> along, double across,
                                  double angle, double supply, bool wave_is_across) {
  std::vector<double> applied;
  for (const double value : along) {
    const VoltageVector asked = wave_is_across ? VoltageVector{across, value} : VoltageVector{value, across};
    const VoltageVector got = applied_vector(*known.electronics, asked, angle, supply);
    applied.push_back(wave_is_across ? got.q : got.d);
  }
  return applied;
}

// What went before does not matter to these: a rotor falls in again with the vector.
Waveforms record(Bench& bench, const ExcitationPlan& excitation, const CapturePlan& plan) {
  return bench.repeat([&] { return bench.record_alone(excitation, plan); });
}

WindingFit resolved(WindingFit fit) {
  if (!fit.finding.is_none())
    throw StepFailed(
        {"winding_not_resolved", to_string(fit.finding), "raise --current; nobody may hold the handle"});
  return fit;
}

// V
double dead_time_loss(const WindingFit& fit) {
  return fit.dead_time_voltage.known() ? std::max(fit.dead_time_voltage.value, 0.0) : 0.0;
}

ExcitationPlan biased_wave(const WindingExcitation& planned, const WindingFit& rough,
                           const MotorKnowledge& known, double angle, bool across) {
  ExcitationPlan wave;
  wave.kind = "voltage";
  wave.bias = std::min(planned.bias + dead_time_loss(rough), 0.6 * known.largest_voltage());
  wave.alternation = std::min(planned.alternation, 0.35 * known.largest_voltage());
  wave.half_period = planned.half_period;
  wave.across = across;
  wave.angle = angle;
  wave.ramp = 0.5 * planned.settling;
  wave.duration = planned.settling + 1.0;
  return wave;
}
struct Response {
  SensorAnswer phases;
  Waveforms seen;
};

Response respond(Bench& bench, double voltage, double angle) {
  ExcitationPlan wave;
  wave.kind = "voltage";
  wave.alternation = voltage;
  wave.half_period = first_half_period;
  wave.angle = angle;
  wave.ramp = 0.004;
  wave.duration = 0.1;
  Response response;
  response.seen =
      record(bench, wave, {{"current_b", "current_c", "voltage", "supply"}, 3 * settling_ticks, 1, 0.0});
  const Waveforms& seen = response.seen;
  if (!seen.empty())
    response.phases = phase_response(seen.of("voltage"), seen.of("current_b"), seen.of("current_c"),
                                     first_half_period, seen.trip ? 0 : settling_ticks);
  return response;
}

// How much more sensor B reads than C of the one current of a brushed motor, as a share. A synchronous
// motor's dead time, which differs between the two directions, would be taken for it.
double mismatch_of(const SensorAnswer& phases) {
  return 2.0 * (phases.b + phases.c) / (phases.b - phases.c);
}

// Finds the voltage that drives known.current, and judges phases and sensors as soon as any current is seen.
// Returns what they answered last.
SensorAnswer search(Bench& bench, MotorKnowledge& known) {
  double voltage = first_voltage;
  for (;;) {
    bench.progress(fmt::format("winding: trying {:.2f} V", voltage));
    known.search_voltage = voltage;
    const Response first = respond(bench, voltage, 0.0);
    const Response second = known.brushed() ? first : respond(bench, voltage, quarter_turn);
    // Half a look shows no pattern; a brushed motor's one look is all there is.
    if (!known.brushed()) {
      require_no_trip(first.seen);
      require_no_trip(second.seen);
    }
    const auto magnitude = magnitude_of(first.phases, known.brushed() ? SensorAnswer{} : second.phases);
    if (magnitude > std::max(seen_current, 0.1 * known.current)) {
      if (const auto diagnosis = diagnose_phases(known.brushed(), first.phases, second.phases))
        throw StepFailed(*diagnosis);
    }
    require_no_trip(first.seen);
    if (magnitude >= 0.7 * known.current) return first.phases;
    const double most = known.largest_voltage();
    if (voltage >= most) {
      if (magnitude < seen_current)
        throw StepFailed({known.brushed() ? "motor_open" : "phases_open",
                          fmt::format("{:.3g} V drive only {:.3f} A", voltage, magnitude),
                          known.brushed()
                              ? "check the motor's two wires, on legs B and C"
                              : "two or three of the motor's wires are open: check its connector"});
      if (magnitude < 0.3 * known.current)
        throw StepFailed(
            {"supply_too_low",
             fmt::format("all of the supply's {:.3g} V drive only {:.3f} A of the {:.3f} A wanted",
                         known.supply, magnitude, known.current),
             "use a higher supply voltage, or lower current.limit or --current"});
      known.current = magnitude;
      return first.phases;
    }
    const double factor = magnitude > 0.1 * known.current
                              ? std::min(voltage_factor, known.current / magnitude)
                              : voltage_factor;
    voltage = std::min(voltage * std::max(factor, 1.1), most);
  }
}

WindingFitConfig config_of(const MotorKnowledge& known) {
  WindingFitConfig config;
  config.tick = known.tick;
  config.pwm_frequency = known.electronics->pwm_hz();
  config.switching_legs = known.brushed() ? 2.0 : 4.0 / 3.0;
  return config;
}

// V that the dead time takes, as seconds of dead time.
Estimate dead_time_of(const WindingFit& fit, const MotorKnowledge& known) {
  const double volts = config_of(known).switching_legs * known.electronics->pwm_hz() * known.supply;
  return {fit.dead_time_voltage.value / volts, fit.dead_time_voltage.standard_error / volts, "s"};
}

// Unbiased, so that the dead time shows; a vector stands along phase A.
WindingFit rough_fit(Bench& bench, const MotorKnowledge& known) {
  ExcitationPlan wave;
  wave.kind = "voltage";
  wave.alternation = known.search_voltage;
  wave.half_period = first_half_period;
  wave.ramp = 0.004;
  wave.duration = 0.2;
  const Waveforms seen = record(bench, wave, {{"voltage", "current", "supply"}, 1000, 1, 0.0});
  require_no_trip(seen);
  const std::vector<double> applied =
      known.brushed() ? applied_brushed(known, seen)
                      : applied_along(known, seen.of("voltage"), 0.0, 0.0, known.supply, false);
  const WindingRecord record{applied, seen.of("current"), seen.of("supply"), {}};
  WindingFitConfig config = config_of(known);
  config.motion = WindingMotion::free;
  WindingFit fit = fit_winding({&record, 1}, config);
  if (!fit.resistance.known() || !fit.inductance.known() || !(fit.resistance.value > 0.0))
    throw StepFailed({"winding_not_resolved", to_string(fit.finding), "raise --current"});
  return fit;
}

WindingFit fit_brushed(Bench& bench, const MotorKnowledge& known, const WindingFit& rough) {
  const WindingExcitation planned =
      brushed_excitation(rough.resistance.value, rough.inductance.value, known.current, known.tick);
  ExcitationPlan wave;
  wave.kind = "voltage";
  wave.alternation = std::min(planned.alternation + dead_time_loss(rough), known.largest_voltage());
  wave.half_period = planned.half_period;
  wave.ramp = 0.02;
  wave.duration = 1.0;
  const Waveforms seen = record(
      bench, wave,
      {{"voltage", "current", "supply"}, std::min(planned.samples, most_samples), 1, planned.settling});
  require_no_trip(seen);
  const std::vector<double> applied = applied_brushed(known, seen);
  const WindingRecord record{applied, seen.of("current"), seen.of("supply"), {}};
  WindingFitConfig config = config_of(known);
  config.motion = WindingMotion::free;
  return resolved(fit_winding({&record, 1}, config));
}

WindingFit fit_along(Bench& bench, const MotorKnowledge& known, const WindingFit& rough, double angle) {
  const WindingExcitation planned =
      vector_excitation(rough.resistance.value, rough.inductance.value, known.current, known.tick);
  const Waveforms seen = record(
      bench, biased_wave(planned, rough, known, angle, false),
      {{"voltage", "current", "supply"}, std::min(planned.samples, most_samples), 1, planned.settling});
  require_no_trip(seen);
  const std::vector<double> applied =
      applied_along(known, seen.of("voltage"), 0.0, angle, bench::mean_of(seen.of("supply")), false);
  const WindingRecord record{applied, seen.of("current"), seen.of("supply"), {}};
  return resolved(fit_winding({&record, 1}, config_of(known)));
}

// The rotor swings with a current across the field that holds it: fitted as a motion, from waves of two
// lengths.
WindingFit fit_across(Bench& bench, const MotorKnowledge& known, const WindingFit& rough, double angle,
                      const Estimate& resistance) {
  const WindingExcitation planned =
      across_excitation(rough.resistance.value, rough.inductance.value, known.current, known.tick);
  std::vector<Waveforms> seen;
  std::vector<std::vector<double>> applied;
  for (const int half_period : {planned.half_period, winding_slow_half_period(planned.half_period)}) {
    ExcitationPlan wave = biased_wave(planned, rough, known, angle, true);
    wave.half_period = half_period;
    seen.push_back(record(bench, wave,
                          {{"voltage_d", "current_d", "supply"},
                           std::min(planned.samples, most_samples),
                           1,
                           planned.settling}));
    require_no_trip(seen.back());
    applied.push_back(applied_along(known, seen.back().of("voltage_d"), wave.bias, angle,
                                    bench::mean_of(seen.back().of("supply")), true));
  }
  std::vector<WindingRecord> records;
  for (std::size_t i = 0; i < seen.size(); ++i)
    records.push_back({applied[i], seen[i].of("current_d"), seen[i].of("supply"), {}});
  WindingFitConfig config = config_of(known);
  config.fit_dead_time = false;
  config.motion = WindingMotion::free;
  config.known_resistance = resistance;
  return resolved(fit_winding(records, config));
}

void measure(Calibration& run, const WindingFit& rough) {
  Bench& bench = run.bench;
  const MotorKnowledge& known = run.known;
  std::vector<Estimate> resistance, inductance, across, dead_time;
  for (int i = 0; i < run.settings.repetitions; ++i) {
    bench.progress(fmt::format("winding: measurement {} of {}", i + 1, run.settings.repetitions));
    // Another phase carries the bias each time, and the rotor turns by a third of a turn at most.
    const double angle = std::numbers::pi / 3.0 * (i % 3 == 2 ? -1 : i % 3);
    const WindingFit fit =
        known.brushed() ? fit_brushed(bench, known, rough) : fit_along(bench, known, rough, angle);
    resistance.push_back(fit.resistance);
    inductance.push_back(fit.inductance);
    if (!known.brushed())
      across.push_back(fit_across(bench, known, rough, angle, fit.resistance).inductance);
    else if (fit.dead_time_voltage.known())
      dead_time.push_back(dead_time_of(fit, known));
  }
  std::vector<IdentifiedValue>& values = run.report.values;
  values.push_back(repeated_value("motor.resistance", resistance, "ohm", known.resistance));
  values.push_back(repeated_value("motor.inductance", inductance, "H", known.inductance));
  if (!known.brushed()) {
    values.push_back(repeated_value("motor.inductance_q", across, "H", known.inductance_q));
    // The dead time shows where the current changes its sign.
    for (int i = 0; i < run.settings.repetitions; ++i) {
      const WindingFit fit = rough_fit(bench, known);
      if (fit.dead_time_voltage.known()) dead_time.push_back(dead_time_of(fit, known));
    }
  }
  if (!dead_time.empty())
    values.push_back(repeated_value("compensation.dead_time", dead_time, "s", known.dead_time));
}

void finish(Calibration& run) {
  MotorKnowledge& known = run.known;
  // A dead time that scatters by more than this is not compensated; nothing else depends on it.
  constexpr double fine_dead_time = 150e-9;  // s, 72 mV per leg at 24 V and 20 kHz
  for (IdentifiedValue& value : run.report.values) {
    if (value.name != "compensation.dead_time") {
      // A salient rotor that is held between its axes shows neither inductance well; the field's turn names
      // it.
      const double floor = known.brushed() ? 0.0 : 0.5 * value.value;
      require_repeatable(value, floor, "winding_not_resolved");
    } else if (value.spread > fine_dead_time) {
      value.value = 0.0;
    }
  }
  std::vector<std::string> results;
  known.inductance_q = 0.0;
  known.dead_time = known.dead_time_error = 0.0;
  for (IdentifiedValue& value : run.report.values) {
    if (value.name == "motor.resistance") {
      known.resistance = value.value;
      known.resistance_error = std::max(value.spread, 1e-3 * value.value);
    } else if (value.name == "motor.inductance") {
      known.inductance = value.value;
    } else if (value.name == "motor.inductance_q") {
      known.inductance_q = value.value;
    } else if (value.name == "compensation.dead_time") {
      // A fit may say that there is none, and less than none.
      value.value = std::clamp(value.value, 0.0, 5e-6);
      known.dead_time = value.value;
      known.dead_time_error = std::max(value.spread, 5e-9);
      continue;
    }
    results.push_back(fmt::format("{}={:.9g}", value.name, value.value));
  }
  if (known.inductance_q <= 0.0) known.inductance_q = known.inductance;
  if (known.brushed()) results.push_back("motor.inductance_q=0");
  if (known.dead_time_error > 0.0)
    run.set_at_end({fmt::format("compensation.dead_time={:.9g}", known.dead_time),
                    fmt::format("compensation.dead_time_current={:.6g}",
                                std::clamp(known.dead_time_band(), 0.02, 0.2 * known.current_limit))});
  run.bench.set_result(results);
}
}  // namespace

void find_winding(Calibration& run) {
  MotorKnowledge& known = run.known;
  const SensorAnswer answered = search(run.bench, known);
  const WindingFit rough = rough_fit(run.bench, known);
  // What the supply can drive is measured with: less is less exact, and below 30 % of what was wanted not
  // exact enough.
  constexpr double least_share = 0.3;
  const double most = known.largest_voltage() / rough.resistance.value;
  if (most < least_share * known.current)
    throw StepFailed(
        {"supply_too_low",
         fmt::format("{:.3g} V drive at most {:.3g} A through {:.3g} ohm, of the {:.3g} A wanted",
                     known.supply, most, rough.resistance.value, known.current),
         "use a higher supply voltage, or lower current.limit or --current"});
  known.current = std::min(known.current, most);
  measure(run, rough);
  finish(run);
  if (!known.brushed()) return;
  constexpr double allowed = 0.06;  // beyond it currents seem not to add up (phase_watch.hpp)
  const double mismatch = mismatch_of(answered);
  run.report.values.push_back({"current_b.mismatch", mismatch, 0.0, "", std::nullopt});
  if (std::abs(mismatch) > allowed)
    run.report.remarks.push_back(
        {"current_mismatch",
         fmt::format("sensor B reads {:+.1f} % of sensor C's current, of {:.0f} % that are allowed",
                     mismatch * 100.0, allowed * 100.0),
         "look at the shunts; more than that ends as current_sum"});
}

}  // namespace kmax::calibration
