#include "host_tools/view/procedure.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "host_tools/base/errors.hpp"
#include "host_tools/calibration/procedure.hpp"
#include "host_tools/experiment/contact/contact_experiment.hpp"
#include "host_tools/selftest/selftest.hpp"

namespace kmax::view {

namespace {
using calibration::StepReport;
using experiment::ContactResult;

ProcedureResult self_test(device::Device& device, const ProcedureSettings& settings,
                          const ProcedureParty& party) {
  selftest::SelfTestSettings test{.axis = settings.axis, .say = party.instruct};
  if (settings.hand) test.hand.emplace();
  const selftest::Report report = selftest::run_selftest(device, test, party.progress);
  if (const auto& before = report.fault_at_start)
    party.note(fmt::format("fault before the test: {} ({})", before->words,
                           before->cleared ? "cleared" : "its cause remains"));
  for (const selftest::CheckResult& check : report.checks)
    party.found({check.name, selftest::name_of(check.verdict), check.message});
  return {report.pass(), selftest::conclusion(report)};
}

Finding finding_of(const StepReport& step) {
  Finding finding{step.name, step.pass ? "pass" : step.skipped ? "not judged" : "fail"};
  std::vector<std::string> parts;
  if (step.skipped) parts.emplace_back("left out, a step before it has failed");
  const auto add = [&](const calibration::Diagnosis& one) {
    parts.push_back(fmt::format("{}: {}; {}", one.cause, one.words, one.advice));
  };
  if (step.failure) add(*step.failure);
  std::for_each(step.remarks.begin(), step.remarks.end(), add);
  for (const calibration::IdentifiedValue& value : step.values)
    parts.push_back(fmt::format("{} {:.4g} {}{}", value.name, value.value, value.unit,
                                value.previous ? fmt::format(" (was {:.4g})", *value.previous) : ""));
  finding.words = fmt::format("{}", fmt::join(parts, ". "));
  return finding;
}

ProcedureResult calibration_of(device::Device& device, const ProcedureSettings& settings,
                               const ProcedureParty& party) {
  calibration::CalibrationSettings steps;
  steps.axis = settings.axis;
  steps.save = false;  // whoever has read the result decides
  const calibration::CalibrationReport report = calibration::calibrate(
      device, steps, settings.hand ? &party.prompter : nullptr, party.progress,
      [&](std::string_view started, std::chrono::seconds) { party.progress(std::string(started)); });
  for (const StepReport& one : report.steps) party.found(finding_of(one));
  if (report.pass()) return {true, "Every step has passed.", report.kept};
  const auto failed =
      std::ranges::find_if(report.steps, [](const StepReport& one) { return !one.pass && !one.skipped; });
  const std::string advice =
      failed != report.steps.end() && failed->failure ? ": " + failed->failure->advice : std::string();
  return {false, fmt::format("A step has failed, so that every parameter is as before{}.", advice)};
}

ProcedureResult contact(device::Device& device, const ProcedureSettings& settings,
                        const ProcedureParty& party) {
  experiment::TouchLimits limits = experiment::contact_limits();
  limits.axis = settings.axis;
  std::string so_far;
  const experiment::ReportText report = [&](const std::string& text) { party.progress(so_far + text); };
  const experiment::ReportText notice = party.note;
  experiment::DeviceRig rig(device, limits,
                            {party.asks_before_touches ? &party.prompter : nullptr, nullptr, report, notice});
  const auto results = experiment::run_contacts(
      rig, {}, settings.trials,
      [&](std::size_t made, std::size_t all) {
        so_far = fmt::format("touch {} of {}, ", made + 1, all);
        party.progress("");
      },
      [&](const ContactResult& result) {
        party.found(
            {result.condition.name, result.agrees_with_paper() == true ? "pass" : "fail",
             fmt::format("{}, {:.3f} mm peak to peak; {} of {} touches unstable; paper 1, Fig. {}: {}",
                         experiment::to_string(result.measure.verdict), result.measure.peak_to_peak * 1e3,
                         result.unstable_trials, result.trials, result.condition.figure,
                         result.condition.paper_words)});
      });
  const auto agree =
      std::ranges::count_if(results, [](const auto& one) { return one.agrees_with_paper() == true; });
  return {static_cast<std::size_t>(agree) == results.size(),
          fmt::format("{} of {} walls came out as in paper 1.", agree, results.size())};
}
}  // namespace

ProcedureResult run_procedure(device::Device& device, const ProcedureSettings& settings,
                              const ProcedureParty& party) {
  const std::string_view name = procedure_named(settings.name).name;
  return (name == "self_test"     ? self_test
          : name == "calibration" ? calibration_of
                                  : contact)(device, settings, party);
}

}  // namespace kmax::view
