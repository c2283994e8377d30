#include "host_tools/calibration/procedure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "host_tools/base/errors.hpp"
#include "host_tools/calibration/compensation_step.hpp"
#include "host_tools/calibration/current_offset_step.hpp"
#include "host_tools/calibration/field_turn_step.hpp"
#include "host_tools/calibration/hand_direction_step.hpp"
#include "host_tools/calibration/index_search_step.hpp"
#include "host_tools/calibration/motion_step.hpp"
#include "host_tools/calibration/push_direction_step.hpp"
#include "host_tools/calibration/torque_constant_step.hpp"
#include "host_tools/calibration/trip_diagnosis.hpp"
#include "host_tools/calibration/winding_step.hpp"
#include "host_tools/device/store.hpp"

namespace kmax::calibration {

namespace {

void require_ready(device::Device& device, std::size_t axis) {
  for (std::size_t i = 0; i < firmware::axis_count; ++i) {
    const device::DriveStatus status = device::Drive(device, i).status();
    if (status.armed()) throw device::DeviceError(fmt::format("axis {} is armed; 'kmax disarm' first", i));
    if (i == axis && status.faulty())
      throw device::DeviceError(
          fmt::format("axis {} has a fault: {}; then 'kmax clear'", i, status.fault_words()));
  }
}

MotorKnowledge knowledge_of(Bench& bench) {
  MotorKnowledge known;
  known.supply = bench.number("supply.voltage");
  if (known.supply <= 0.0)
    throw NothingToCalibrate(
        "there is nothing to calibrate: this device measures no supply and no currents, its force comes from "
        "an ideal source (supply.voltage reads 0); to try it on a simulated motor, start 'kmax serve --scene "
        "gimbal_a --serial LINK' and calibrate the device at LINK");
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
  known.searches_index = bench.number("encoder.index") != 0.0 && bench.number("encoder.start") == 0.0 &&
                         bench.number("encoder.kind") == 0.0;
  known.current = std::min(bench.settings().current.value_or(0.5 * known.current_limit), known.current_limit);
  return known;
}

bool blocked(const Step& step, const std::vector<StepReport>& before) {
  const auto needed = step.needs();
  return std::any_of(before.begin(), before.end(), [&](const StepReport& report) {
    return !report.pass && std::find(needed.begin(), needed.end(), report.name) != needed.end();
  });
}

StepReport run_step(Step& step, Bench& bench, MotorKnowledge& known) {
  StepReport report;
  const MotorKnowledge before = known;
  try {
    // Steps that can repeat a part of themselves do; this is for the rest.
    bench.repeat([&] {
      known = before;
      report = {};
      report.name = step.name();
      step.run(bench, known, report);
    });
  } catch (const StepFailed& failure) {
    report.failure = failure.diagnosis();
  } catch (const device::ValueError& beyond) {
    // A result that no such device can have, or not a number.
    report.failure = {report.name + "_not_resolved", beyond.what(),
                      "raise --current or --travel; nobody may hold the handle"};
  }
  // The next step begins from rest, whatever this one left behind.
  bench.disarm();
  const std::optional<Trip> trip = bench.take_unseen_trip();
  if (trip && !report.failure) report.failure = diagnosis_of(*trip);
  report.pass = !report.failure;
  return report;
}

}  // namespace

bool CalibrationReport::pass() const {
  return std::all_of(steps.begin(), steps.end(), [](const StepReport& step) { return step.pass; });
}

std::vector<std::unique_ptr<Step>> calibration_steps() {
  std::vector<std::unique_ptr<Step>> steps;
  steps.push_back(std::make_unique<CurrentOffsetStep>());
  steps.push_back(std::make_unique<WindingStep>());
  steps.push_back(std::make_unique<HandDirectionStep>());
  steps.push_back(std::make_unique<PushDirectionStep>());
  steps.push_back(std::make_unique<IndexSearchStep>());
  steps.push_back(std::make_unique<FieldTurnStep>());
  steps.push_back(std::make_unique<TorqueConstantStep>());
  steps.push_back(std::make_unique<MotionStep>());
  steps.push_back(std::make_unique<CompensationStep>());
  return steps;
}

namespace {

// Disarms and puts everything back. "" if that was done, else what is left.
std::string restore(std::optional<Bench>& bench, ParameterJournal& journal) {
  std::string trouble;
  try {
    if (bench) bench->disarm();
  } catch (const std::exception& error) {
    trouble = fmt::format("the axis could not be disarmed ({}); ", error.what());
  }
  try {
    journal.put_back();
  } catch (const std::exception& error) {
    trouble += fmt::format("the parameters were not put back ({}); ", error.what());
    // Said here: no second attempt by the destructor.
    journal.forget();
  }
  if (trouble.empty()) return "";
  return trouble + "not put back: switch the device off and on before 'kmax save'";
}

void run_steps(Bench& bench, const CalibrationSettings& settings,
               const std::function<void(std::string_view)>& started, CalibrationReport& report) {
  MotorKnowledge known = knowledge_of(bench);
  // What is to be identified must not be corrected meanwhile.
  bench.set_temporary({"compensation.dead_time=0", "compensation.limit=0"});
  for (const auto& step : calibration_steps()) {
    if (!settings.has(step->set()) || !step->applies(known)) continue;
    if (step->name() == "hand_direction" && bench.prompter() == nullptr) continue;
    if (bench.unusable() || blocked(*step, report.steps)) {
      StepReport skipped;
      skipped.name = step->name();
      skipped.skipped = true;
      report.steps.push_back(skipped);
      continue;
    }
    if (started) started(step->name());
    report.steps.push_back(run_step(*step, bench, known));
  }
  if (!report.pass() || settings.dry_run) return;
  bench.apply_results_at_end();
  if (settings.has(StepSet::electrical) && settings.has(StepSet::encoder) &&
      settings.has(StepSet::mechanical))
    bench.set_result({"motor.calibrated=yes"});
}

}  // namespace

CalibrationReport calibrate(device::Device& device, const CalibrationSettings& settings, Prompter* prompter,
                            const std::function<void(const std::string&)>& tell,
                            const std::function<void(std::string_view)>& started) {
  require_ready(device, settings.axis);
  CalibrationReport report;
  // Outlives the bench, which disarms: parameters are put back on a disarmed axis.
  ParameterJournal journal(device, settings.axis);
  std::optional<Bench> bench;
  try {
    bench.emplace(device, settings, journal, prompter, tell);
    run_steps(*bench, settings, started, report);
    bench->disarm();
    if (!report.pass() || settings.dry_run) {
      journal.put_back();
      return report;
    }
    // Saved before the temporary ones are forgotten: a save that fails puts everything back.
    journal.put_temporary_back();
    if (settings.save) {
      device::Store(device).save();
      report.stored = true;
    }
    journal.forget();
    report.kept = true;
    return report;
  } catch (const CalibrationInterrupted& interruption) {
    const std::string left = restore(bench, journal);
    throw CalibrationInterrupted(
        fmt::format("{}; {}", interruption.what(),
                    left.empty() ? "the axis has been disarmed and all parameters are as before" : left));
  } catch (const std::exception& error) {
    const std::string left = restore(bench, journal);
    if (left.empty()) throw;
    throw device::DeviceError(fmt::format("{}; {}", error.what(), left));
  }
}

}  // namespace kmax::calibration
