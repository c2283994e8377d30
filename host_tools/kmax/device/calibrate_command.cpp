// kmax calibrate.
#include <fmt/format.h>

#include <chrono>
#include <string>
#include <utility>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/calibration/procedure.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"
#include "host_tools/kmax/terminal.hpp"

namespace kmax::cli {

namespace {
using calibration::CalibrationReport;
using calibration::CalibrationSettings;
using calibration::Diagnosis;
using calibration::IdentifiedValue;
using calibration::StepReport;

struct CalibrateOptions {
  CalibrationSettings settings;
  std::vector<std::string> sets = {"electrical", "encoder", "mechanical"};
  double current = 0.0;
  bool no_save = false;
  bool hand = false;

  void declare(CLI::App& command) {
    command.add_option("--steps", sets, "Which steps")
        ->delimiter(',')
        ->check(CLI::IsMember({"electrical", "encoder", "mechanical", "compensation", "all"}))
        ->capture_default_str();
    add_quantity(command, "--travel", settings.travel, "m", "How far the handle may move to either side, m",
                 0.001, 1.0);
    command
        .add_option("--current", current,
                    "Motor current to measure with, A; half of current.limit without it")
        ->transform(quantity("A", 0.01, 120.0));
    command.add_flag("--keep-pole-pairs", settings.keep_pole_pairs,
                     "Fail if motor.pole_pairs is not what is measured, rather than correct it");
    command.add_flag("--hand", hand, "Ask for a move of the handle by hand, which shows where positive is");
    command.add_flag("--dry-run", settings.dry_run, "Measure, and put every parameter back");
    command.add_flag("--no-save", no_save, "Keep the result until the next restart only");
  }
};

void choose_sets(CalibrationSettings& settings, const std::vector<std::string>& names) {
  settings.sets.fill(false);
  for (const std::string& name : names) {
    for (std::size_t i = 0; i < settings.sets.size(); ++i)
      settings.sets[i] = settings.sets[i] || name == "all" || name == calibration::step_set_names[i];
  }
}

Json diagnosis_json(const Diagnosis& diagnosis) {
  return {{"cause", diagnosis.cause}, {"message", diagnosis.words}, {"advice", diagnosis.advice}};
}

Json step_json(const StepReport& step) {
  Json values = Json::array(), remarks = Json::array();
  for (const IdentifiedValue& value : step.values)
    values.push_back({{"name", value.name},
                      {"value", value.value},
                      {"spread", value.spread},
                      {"unit", value.unit},
                      {"previous", value.previous ? Json(*value.previous) : Json(nullptr)}});
  for (const Diagnosis& remark : step.remarks) remarks.push_back(diagnosis_json(remark));
  return {
      {"name", step.name},       {"pass", step.pass},
      {"skipped", step.skipped}, {"values", values},
      {"remarks", remarks},      {"failure", step.failure ? diagnosis_json(*step.failure) : Json(nullptr)}};
}

void print_step(Context& context, const StepReport& step) {
  base::print(context.out, "{}: {}\n", step.name,
              step.pass      ? "done"
              : step.skipped ? "left out, a step before it has failed"
                             : "FAILED");
  for (const IdentifiedValue& value : step.values)
    context.say(fmt::format("  {:<27} {:>12.5g} +- {:<8.2g} {:<7} {}", value.name, value.value, value.spread,
                            value.unit, value.previous ? fmt::format("was {:.5g}", *value.previous) : ""),
                30);
  for (const Diagnosis& remark : step.remarks)
    context.say(fmt::format("  {}: {}; {}", remark.cause, remark.words, remark.advice), 4);
  if (!step.failure) return;
  context.say(fmt::format("  {}: {}", step.failure->cause, step.failure->words), 4);
  context.say("  " + step.failure->advice, 2);
}

void print_report(Context& context, const CalibrateOptions& options, const CalibrationReport& report) {
  for (const StepReport& step : report.steps) print_step(context, step);
  if (report.stored) {
    base::print(context.out, "saved\n");
  } else if (report.kept) {
    base::print(context.out, "kept until the next restart; 'kmax save' keeps it for good\n");
  } else if (options.settings.dry_run && report.pass()) {
    base::print(context.out, "dry run: all parameters are as before\n");
  } else {
    base::print(context.out, "nothing was kept: all parameters are as before\n");
  }
}

/// Roughly, as it is known: in tens of seconds, from a minute and a half on in minutes.
std::string rough(std::chrono::seconds time) {
  const auto count = time.count();
  return count < 90 ? fmt::format("{} s", (count + 9) / 10 * 10)
                    : fmt::format("{} minutes", (count + 30) / 60);
}

int run_calibrate(Context& context, const CalibrateOptions& options) {
  const base::Interruption interruption;
  CalibrationSettings settings = options.settings;
  settings.axis = context.axis();
  settings.save = !options.no_save;
  if (options.current > 0.0) settings.current = options.current;
  choose_sets(settings, options.sets);
  device::Device device = context.connect_to_change();
  const auto check_interruption = [&] {
    if (interruption.requested()) throw bench::Interrupted("interrupted");
  };
  TerminalPrompter prompter(context, check_interruption, "--hand needs somebody at the terminal");
  CalibrationReport report;
  {
    base::Progress progress(context.messages());
    const auto show = [&](const std::string& text) {
      check_interruption();
      if (!text.empty()) progress.show(text);
    };
    report = calibration::calibrate(
        device, settings, options.hand ? &prompter : nullptr, show,
        [&, first = true](std::string_view step, std::chrono::seconds to_go) mutable {
          if (std::exchange(first, false))
            context.note(fmt::format("this takes about {} over a serial line of 115200 baud, less over CAN",
                                     rough(to_go)));
          context.note(fmt::format("calibrating: {}", step));
        });
  }
  if (context.json) {
    Json steps = Json::array();
    for (const StepReport& step : report.steps) steps.push_back(step_json(step));
    context.print({{"steps", steps},
                   {"pass", report.pass()},
                   {"dry_run", settings.dry_run},
                   {"kept", report.kept},
                   {"stored", report.stored}});
  } else {
    print_report(context, options, report);
  }
  return report.pass() ? base::done : base::verdict_is_no;
}
}  // namespace

void add_calibrate_command(CLI::App& app, Context& context) {
  add_command<CalibrateOptions>(
      app, context,
      {"calibrate",
       "Identifies motor, encoder and handle of an axis, names what is wrong with them, and saves them.",
       R"(  kmax calibrate                                  everything that control needs
  kmax calibrate --steps electrical --dry-run     look at the motor, change nothing
  kmax calibrate --steps all --travel 0.03        cogging, friction and gravity as well
  kmax calibrate --hand                           also tells swapped phases from a reversed encoder

Nobody may hold the handle, which trembles and moves by up to --travel to either side. Before: motor.kind,
encoder.kind, encoder.counts_per_turn, device.transmission and current.limit must be right.
The parameters change only if every step passes; the axis is disarmed at the end and on Ctrl-C.
Exit code 3: a step failed; its cause has a name that docs/calibration.md explains.)"},
      Takes::device_and_axis, run_calibrate);
}

}  // namespace kmax::cli
