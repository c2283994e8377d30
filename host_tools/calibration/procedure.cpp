#include "host_tools/calibration/procedure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host_tools/base/errors.hpp"
#include "host_tools/bench/power_stage.hpp"
#include "host_tools/calibration/step.hpp"
#include "host_tools/device/disarm_failure.hpp"
#include "host_tools/device/store.hpp"

namespace kmax::calibration {

using firmware::Fault;
using firmware::Refusal;

void Calibration::set_at_end(const std::vector<std::string>& texts) {
  device::parse_assignments(texts, settings.axis);
  results_at_end.insert(results_at_end.end(), texts.begin(), texts.end());
}

IdentifiedValue repeated_value(std::string name, std::span<const Estimate> repetitions, std::string unit,
                               std::optional<double> previous) {
  IdentifiedValue value{std::move(name), 0.0, 0.0, std::move(unit), previous};
  std::vector<double> values;
  double error = 0.0;
  for (const Estimate& one : repetitions) {
    values.push_back(one.value);
    if (std::isfinite(one.standard_error)) error = std::max(error, one.standard_error);
  }
  value.value = bench::mean_of(values);
  value.spread = std::max(bench::deviation_of(values), error);
  return value;
}

void require_repeatable(const IdentifiedValue& value, double fine, const std::string& cause) {
  constexpr double largest_scatter = 0.15;  // of the value
  if (value.spread <= std::max(largest_scatter * std::abs(value.value), fine)) return;
  throw StepFailed({cause,
                    fmt::format("{}: {:.3g} {} scatters by {:.2g} {} from one measurement to the next",
                                value.name, value.value, value.unit, value.spread, value.unit),
                    "raise --current or --travel; nobody may hold the handle"});
}

void throw_encoder_dead(const std::string& evidence) {
  throw StepFailed({"encoder_dead", evidence + ": the motor turns, the encoder does not",
                    "check the encoder's cable, supply and mounting, and encoder.kind"});
}

void throw_motor_blocked(const std::string& evidence) {
  throw StepFailed({"motor_blocked", evidence + ": the motor stands",
                    "free the handle, move it away from its stops, or raise --current"});
}

Diagnosis diagnosis_of(const Trip& trip) {
  const std::string words = "the axis tripped: " + trip.words;
  switch (trip.fault) {
    case Fault::under_voltage:
      return {"supply_too_low", words, "use a supply that holds its voltage under load, or lower --current"};
    case Fault::excitation_travel:
      return {"travel_too_small", words, "allow more with --travel, or move the handle away from its stops"};
    case Fault::encoder:
      return {"encoder_dead", words, "check the encoder's cable and supply, and encoder.kind"};
    case Fault::emergency_stop:
      return {"emergency_stop", words, "release the emergency stop once it is clear why it was pressed"};
    case Fault::power_stage:
    case Fault::gate_driver:
      return {std::string(firmware::text_of(trip.fault).name), words,
              "check the supply and the gate driver, which needs it"};
    case Fault::spin_out:
      return {"motor_runs_away", words, "calibrate the encoder first: --steps encoder"};
    default:
      return {std::string(firmware::text_of(trip.fault).name), words, "see 'kmax state'"};
  }
}

void require_no_trip(const Waveforms& seen) {
  if (seen.trip) throw StepFailed(diagnosis_of(*seen.trip));
}

Diagnosis diagnosis_of(Refusal refusal, double supply, double supply_min, double supply_max) {
  std::string words = fmt::format("the axis was not armed: {}", firmware::to_string(refusal));
  switch (refusal) {
    case Refusal::supply_out_of_range:
      words =
          fmt::format("the supply is {:.3g} V; supply.voltage_min is {:.3g} V, supply.voltage_max {:.3g} V",
                      supply, supply_min, supply_max);
      if (supply < supply_min)
        return {"supply_too_low", words,
                "use the supply that this device is made for, or lower supply.voltage_min"};
      return {"supply_too_high", words,
              "use the supply that this device is made for, or raise supply.voltage_max"};
    case Refusal::encoder_invalid:
      return {"encoder_dead", words, "check the encoder's cable and supply, and encoder.kind"};
    case Refusal::current_sense_invalid:
      return {"current_sensor", words, "check the shunts and the gate driver's amplifiers"};
    case Refusal::emergency_stop:
      return {"emergency_stop", words, "release the emergency stop once it is clear why it was pressed"};
    case Refusal::power_stage_not_ready:
      return {"power_stage", words + fmt::format(", and the supply is {:.3g} V", supply),
              "check the supply, and the gate driver, which needs it to answer"};
    case Refusal::gate_driver_fault:
      return {"gate_driver", words, "look for a short between phases or to ground, and check the supply"};
    default:
      return {"not_armed", words, "see 'kmax state'"};
  }
}

namespace {

void require_ready(device::Device& device, std::size_t axis) {
  bench::require_disarmed(device);
  const device::DriveStatus status = device::Drive(device, axis).status();
  if (status.faulty())
    throw base::DeviceError(
        fmt::format("axis {} has a fault: {}; then 'kmax clear'", axis, status.fault_words()));
}

MotorKnowledge knowledge_of(Bench& bench, const CalibrationSettings& settings,
                            const board::BoardDescription& electronics) {
  MotorKnowledge known;
  known.supply = bench.number("supply.voltage");
  if (known.supply <= 0.0)
    throw NothingToCalibrate(
        "there is nothing to calibrate: this device measures no supply and no currents, its force comes from "
        "an ideal source (supply.voltage reads 0); to try it on a simulated motor, start 'kmax serve --scene "
        "gimbal_a --serial LINK' and calibrate the device at LINK");
  known.electronics = &electronics;
  known.kind = static_cast<firmware::MotorKind>(bench.number("motor.kind"));
  known.tick = 1.0 / bench.number("info.tick_rate");
  known.current_limit = bench.number("current.limit");
  known.transmission = bench.number("device.transmission");
  known.counts_per_turn = bench.number("encoder.counts_per_turn");
  known.direction = static_cast<int>(bench.number("encoder.direction"));
  known.pole_pairs = static_cast<int>(bench.number("motor.pole_pairs"));
  known.resistance = bench.number("motor.resistance");
  known.inductance = bench.number("motor.inductance");
  known.inductance_q = bench.number("motor.inductance_q");
  known.dead_time = bench.number("compensation.dead_time");
  known.compensation_limit = bench.number("compensation.limit");
  known.electrical_offset = bench.number("motor.electrical_offset");
  known.torque_constant = bench.number("motor.torque_constant");
  known.mass = bench.number("device.mass");
  known.calibrated = bench.number("motor.calibrated") != 0.0;
  known.mass_known = known.calibrated;
  known.searches_index =
      bench.number("encoder.index") != 0.0 && bench.number("encoder.start") == 0.0 &&
      bench.number("encoder.kind") == static_cast<double>(firmware::EncoderKind::quadrature);
  known.current = std::min(settings.current.value_or(0.5 * known.current_limit), known.current_limit);
  return known;
}

using Reports = std::vector<StepReport>;

bool brushed(const Calibration& run) {
  return run.known.brushed();
}

bool synchronous(const Calibration& run) {
  return !run.known.brushed();
}

bool always(const Calibration&) {
  return true;
}

// All steps in their order.
const std::vector<Step>& calibration_steps() {
  static const std::vector<Step> steps = {
      {"current_offsets", StepSet::electrical, {}, always, {1, 1}, check_current_sensors},
      {"winding", StepSet::electrical, {"current_offsets"}, always, {15, 50}, find_winding},
      {"hand_direction",
       StepSet::encoder,
       {},
       [](const Calibration& run) { return run.prompter != nullptr; },
       {0, 0},
       find_direction_by_hand},
      {"direction",
       StepSet::encoder,
       {"winding", "hand_direction"},
       brushed,
       {2, 0},
       find_direction_by_pushes},
      // Not with an encoder that knows its angle anyway, and not without an index line.
      {"index_search",
       StepSet::encoder,
       {"winding", "hand_direction"},
       [](const Calibration& run) { return synchronous(run) && run.known.searches_index; },
       {0, 10},
       search_index},
      {"field_turn",
       StepSet::encoder,
       {"winding", "hand_direction", "index_search"},
       synchronous,
       {0, 25},
       find_field_angle},
      {"torque_constant",
       StepSet::mechanical,
       {"winding", "direction", "field_turn"},
       always,
       {15, 20},
       find_torque_constant},
      {"motion",
       StepSet::mechanical,
       {"direction", "field_turn", "torque_constant"},
       always,
       {75, 75},
       find_motion},
      {"compensation_map",
       StepSet::compensation,
       {"direction", "field_turn", "torque_constant", "motion"},
       always,
       {80, 80},
       map_compensation}};
  return steps;
}

bool blocked(const Step& step, const Reports& before) {
  return std::any_of(before.begin(), before.end(), [&](const StepReport& report) {
    return !report.pass && std::find(step.needs.begin(), step.needs.end(), report.name) != step.needs.end();
  });
}

bool is_to_be_run(const Step& step, const Calibration& run) {
  return run.settings.has(step.set) && step.applies(run);
}

std::chrono::seconds usual_time(const Step& step, const Calibration& run) {
  return std::chrono::seconds(step.usual_s[static_cast<std::size_t>(run.known.kind)]);
}

void run_step(const Step& step, Calibration& run) {
  Bench& bench = run.bench;
  const MotorKnowledge before = run.known;
  std::optional<Diagnosis>& failure = run.report.failure;
  try {
    // Steps that can repeat a part of themselves do; this is for the rest.
    bench.repeat([&] {
      run.known = before;
      run.report = {};
      run.report.name = step.name;
      step.run(run);
    });
  } catch (const StepFailed& failed) {
    failure = failed.diagnosis();
  } catch (const bench::AxisTripped& tripped) {
    failure = diagnosis_of(tripped.trip());
  } catch (const bench::ArmingRefused& refused) {
    failure = diagnosis_of(refused.refusal(), bench.number("supply.voltage"),
                           bench.number("supply.voltage_min"), bench.number("supply.voltage_max"));
  } catch (const base::ValueError& beyond) {
    // A result that no such device can have, or not a number.
    failure = {run.report.name + "_not_resolved", beyond.what(),
               "raise --current or --travel; nobody may hold the handle"};
  }
  // The next step begins from rest, whatever this one left behind.
  bench.disarm();
  const std::optional<Trip> trip = bench.take_unseen_trip();
  if (trip && !failure) failure = diagnosis_of(*trip);
  run.report.pass = !failure;
}

}  // namespace

bool CalibrationReport::pass() const {
  return std::all_of(steps.begin(), steps.end(), [](const StepReport& step) { return step.pass; });
}

namespace {

// Disarms and puts everything back. "" if that was done, else what is left.
std::string restore(Bench& bench) {
  std::string trouble;
  try {
    bench.disarm();
  } catch (const std::exception& error) {
    trouble = device::words_for_disarm_failure(bench.link_timeout(), error.what()) + "; ";
  }
  try {
    bench.journal().put_back();
  } catch (const std::exception& error) {
    trouble += fmt::format("the parameters were not put back ({}); ", error.what());
    // Said here: no second attempt by the destructor.
    bench.journal().forget();
  }
  if (trouble.empty()) return "";
  return trouble + "not put back: switch the device off and on before 'kmax save'";
}

void run_steps(Calibration& run, const board::BoardDescription& electronics, const StepStarted& started,
               CalibrationReport& report) {
  run.bench.begin();
  run.known = knowledge_of(run.bench, run.settings, electronics);
  // What is to be identified must not be corrected meanwhile.
  run.bench.set_temporary({"compensation.dead_time=0", "compensation.limit=0"});
  // Under an encoder that has died its velocity is 0 after its window, 33 samples at 20 kHz; the edge
  // period's falls as one over the time.
  run.bench.set_temporary({"velocity.estimator=foaw"});
  std::chrono::seconds to_go{};
  for (const Step& step : calibration_steps()) {
    if (is_to_be_run(step, run)) to_go += usual_time(step, run);
  }
  for (const Step& step : calibration_steps()) {
    if (!is_to_be_run(step, run)) continue;
    const std::chrono::seconds to_go_from_here = to_go;
    to_go -= usual_time(step, run);
    if (run.bench.unusable() || blocked(step, report.steps)) {
      StepReport skipped;
      skipped.name = step.name;
      skipped.skipped = true;
      report.steps.push_back(skipped);
      continue;
    }
    if (started) started(step.name, to_go_from_here);
    run_step(step, run);
    report.steps.push_back(run.report);
  }
  if (!report.pass() || run.settings.dry_run) return;
  if (!run.results_at_end.empty()) run.bench.set_result(run.results_at_end);
  if (run.settings.has(StepSet::electrical) && run.settings.has(StepSet::encoder) &&
      run.settings.has(StepSet::mechanical))
    run.bench.set_result({"motor.calibrated=yes"});
}

}  // namespace

CalibrationReport calibrate(device::Device& device, const CalibrationSettings& settings,
                            bench::Prompter* prompter,
                            const std::function<void(const std::string&)>& progress,
                            const StepStarted& started) {
  require_ready(device, settings.axis);
  // Before anything is changed.
  const board::BoardDescription& electronics = bench::power_stage_of(device);
  CalibrationReport report;
  Bench bench(device, settings.axis, settings.travel, progress);
  try {
    Calibration run{bench, settings, prompter};
    run_steps(run, electronics, started, report);
    bench.disarm();
    if (!report.pass() || settings.dry_run) {
      bench.journal().put_back();
      return report;
    }
    // Saved before the temporary ones are forgotten: a save that fails puts everything back.
    bench.journal().put_temporary_back();
    if (settings.save) {
      device::Store(device).save();
      report.stored = true;
    }
    bench.journal().forget();
    report.kept = true;
    return report;
  } catch (const bench::Interrupted& interruption) {
    const std::string left = restore(bench);
    throw bench::Interrupted(
        fmt::format("{}; {}", interruption.what(),
                    left.empty() ? "the axis has been disarmed and all parameters are as before" : left));
  } catch (const std::exception& error) {
    const std::string left = restore(bench);
    if (left.empty()) throw;
    throw base::DeviceError(fmt::format("{}; {}", error.what(), left));
  }
}

}  // namespace kmax::calibration
