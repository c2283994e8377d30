// The stages in which the handle moves and is felt: calibration, wall, stiffer.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/bring_up/bring_up.hpp"
#include "host_tools/calibration/procedure.hpp"
#include "host_tools/check/judgement.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/experiment/device_rig.hpp"

namespace kmax::bring_up {

using device::Parameter;
using selftest::CheckResult;
using selftest::MeasuredValue;

namespace {
/// A number that a parameter holds should be in its range; others have none.
MeasuredValue measured(const calibration::IdentifiedValue& value) {
  MeasuredValue out{value.name, value.value, value.unit};
  for (const Parameter& parameter : device::all_parameters()) {
    if (parameter.name() != value.name || !parameter.writable()) continue;
    out.least = parameter.definition().minimum;
    out.most = parameter.definition().maximum;
  }
  return out;
}

CheckResult check_of(const calibration::StepReport& step) {
  CheckResult check{step.name};
  for (const calibration::IdentifiedValue& value : step.values) check.values.push_back(measured(value));
  if (step.failure)
    return check.fail(step.failure->cause, fmt::format("{}; {}", step.failure->words, step.failure->advice));
  if (step.skipped) return check.not_judged("left out, a step before it has failed");
  std::string words = "done";
  for (const calibration::Diagnosis& remark : step.remarks) words += fmt::format("; {}", remark.words);
  return check.pass(words);
}

constexpr double way_to_wall = 5e-3;  ///< m

/// One touch of a wall, watched; and where the wall is put for it.
class WallTrial {
 public:
  WallTrial(device::Device& device, const Settings& settings, const Party& party, double force_limit)
      : device_(device), settings_(settings), party_(party) {
    limits_.axis = settings.axis;
    limits_.force_limit = force_limit;
    limits_.abort_amplitude = 3e-3;
    limits_.patience = settings.patience;
    rig_.emplace(device, limits_, experiment::TouchParty{&party.person, nullptr, report_, notice_});
    limit_ = rig_->force_limit();
  }

  CheckResult touch(double stiffness) {
    rig_->set({.stiffness = stiffness, .haptic_rate = static_cast<double>(firmware::tick_rate_hz)});
    experiment::TouchPlan plan;
    plan.name = fmt::format("wall of {:.2f} N/mm", stiffness * 1e-3);
    plan.request = fmt::format(
        "{}: take the handle, and be ready to move it slowly by {:.0f} mm, towards {} positions, to press "
        "lightly against the wall for 2 s, and to let go when the verdict has come and the wall is gone",
        plan.name, way_to_wall * 1e3,
        device_.read_number(fmt::format("axis{}.wall.side", settings_.axis)) > 0.0 ? "smaller" : "larger");
    plan.hold_time = 2.0;
    return rig_
        ->touch<Felt>(plan, [&](const experiment::RigTouch& touch) { return measure(touch, stiffness); })
        .check;
  }

 private:
  /// What DeviceRig keeps of a touch: one in which nobody pressed is made again.
  struct Felt {
    CheckResult check;
    bool pressed = false;
    bool counts() const { return pressed; }
  };

  Felt measure(const experiment::RigTouch& touch, double stiffness) const {
    double largest = 0.0, deepest = 0.0, products = 0.0, squares = 0.0;
    for (const experiment::RigSample& sample : touch.samples) {
      largest = std::max(largest, std::abs(sample.force));
      const double depth = -sample.outside_distance;
      deepest = std::max(deepest, depth);
      // The soft start, and a force at its limit, are not the spring.
      if (sample.time < 0.1 || depth <= 0.0 || std::abs(sample.force) > 0.95 * limit_) continue;
      products += depth * std::abs(sample.force);
      squares += depth * depth;
    }
    const double alarms = device_.read_number(fmt::format("axis{}.instability.alarms", settings_.axis));
    const double felt = squares > 0.0 ? products / squares : 0.0;
    Felt out{CheckResult{fmt::format("wall of {:.2f} N/mm", stiffness * 1e-3)}, deepest > 0.0};
    out.check.values = {{"largest_force", largest, "N", 0.0, limit_},
                        {"deepest", deepest, "m", 0.0, 0.02},
                        {"stiffness", felt, "N/m", 0.9 * stiffness, 1.1 * stiffness},
                        {"alarms", alarms, "", 0.0, 0.0}};
    const std::string seen =
        fmt::format("pressed in by {:.2f} mm with up to {:.2f} N", deepest * 1e3, largest);
    if (touch.aborted_at || alarms > 0.0)
      out.check.fail("wall (unstable)",
                     seen + "; the handle oscillated: 'kmax check' says which parameter to change");
    else if (largest > 1.001 * limit_)
      out.check.fail("force limit",
                     fmt::format("{}; allowed are {:.2f} N: report it as a defect", seen, limit_));
    else if (squares > 0.0 && std::abs(felt / stiffness - 1.0) > 0.1)
      out.check.fail("force", fmt::format("{}: {:.2f} N/mm asked of the motor in place of {:.2f}", seen,
                                          felt * 1e-3, stiffness * 1e-3));
    else
      out.check.pass(seen + ", held still");
    return out;
  }

  device::Device& device_;
  const Settings& settings_;
  const Party& party_;
  experiment::TouchLimits limits_;
  experiment::ReportText report_ = party_.progress;
  experiment::ReportText notice_ = party_.progress;
  std::optional<experiment::DeviceRig> rig_;
  double limit_ = 0.0;
};

/// In front of where the handle is, on the side on which there is room.
void put_wall_here(device::Device& device, const Settings& settings) {
  const auto name = [&](const char* rest) { return fmt::format("axis{}.{}", settings.axis, rest); };
  const double side = device.read_number(name("wall.side"));
  const double here = device.read_number(name("measured.position"));
  device.apply(device::parse_assignments(
      {fmt::format("{}={:.6f}", name("wall.position"), here - side * way_to_wall)}));
}

/// The largest wall up to `most` that every criterion passes which applies; 0 if none does.
double stiffest(device::Device& device, std::size_t axis, double most) {
  firmware::ParameterValues values;
  for (const Parameter& parameter : check::parameters_of_judgement(axis))
    values.set_raw(parameter.slot(), device.read(parameter));
  const auto pass = [&](double stiffness) {
    values.set_raw(
        Parameter::of<"wall.stiffness">(axis).slot(),
        device::parse_value(Parameter::of<"wall.stiffness">(axis), fmt::format("{:.1f}", stiffness)));
    return check::judge_parameters(values, axis, {}).pass;
  };
  double stable = 0.0;
  for (double stiffness = most; stiffness >= 100.0 && stable == 0.0; stiffness *= 0.9) {
    if (pass(stiffness)) stable = stiffness;
  }
  return stable;
}

/// The longest tick so far against the half of the PWM's period that it has, and against our model of the
/// processor, whose waits for flash and buses nobody has compared with a board yet (docs/virtual_board.md).
CheckResult check_tick(device::Device& device) {
  constexpr double modelled = 2900.0;  ///< cycles, at most, waits included
  constexpr double share = 0.9;        ///< of the time there is
  CheckResult check{"time of the tick"};
  const double cycles = device.read_number("counters.longest_tick");
  if (cycles == 0.0) return check.not_judged("this board does not measure it");
  const double room =
      share * device.read_number("info.core_clock") / firmware::tick_rate_hz / firmware::axis_count;
  check.values = {{"longest_tick", cycles, "cycles", 0.0, room}};
  const std::string seen = fmt::format(
      "{:.0f} cycles, of those that ended a sleep; the model says at most {:.0f}", cycles, modelled);
  if (cycles > room)
    return check.fail("control tick",
                      fmt::format("{}; {:.0f} are allowed: report it with this report's file, "
                                  "and set a lower haptic.rate until then",
                                  seen, room));
  return check.pass(seen);
}
}  // namespace

StageResult try_calibration(device::Device& device, const Settings& settings, const Party& party) {
  StageResult result;
  calibration::CalibrationSettings calibration;
  calibration.axis = settings.axis;
  const auto report = calibration::calibrate(device, calibration, nullptr, party.progress);
  for (const calibration::StepReport& step : report.steps) result.checks.push_back(check_of(step));
  if (!result.passed()) return result;
  const std::vector<CheckResult> again = run_checks(test_free_handle(device, settings, party));
  result.checks.insert(result.checks.end(), again.begin(), again.end());
  return result;
}

StageResult try_wall(device::Device& device, const Settings& settings, const Party& party) {
  StageResult result;
  put_wall_here(device, settings);
  result.checks = {WallTrial(device, settings, party, 1.0).touch(500.0)};
  return result;
}

StageResult try_stiffer(device::Device& device, const Settings& settings, const Party& party) {
  StageResult result;
  put_wall_here(device, settings);
  const double stable = stiffest(device, settings.axis, settings.stiffness);
  CheckResult judged{"stability criteria"};
  judged.values = {{"stiffness", stable, "N/m", 100.0, settings.stiffness}};
  if (stable <= 0.0) {
    result.checks = {judged.fail("wall parameters",
                                 "no wall of 0.1 N/mm or more passes: 'kmax check' says what each criterion "
                                 "would need")};
    return result;
  }
  result.checks = {judged.pass(fmt::format("{:.2f} N/mm, of {:.2f} N/mm asked for", stable * 1e-3,
                                           settings.stiffness * 1e-3)),
                   WallTrial(device, settings, party, 3.0).touch(stable), check_tick(device)};
  if (result.passed())
    device.apply(
        device::parse_assignments({fmt::format("axis{}.wall.stiffness={:.1f}", settings.axis, stable)}));
  return result;
}

}  // namespace kmax::bring_up
