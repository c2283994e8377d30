// kmax selftest.
#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/bench/prompter.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"
#include "host_tools/selftest/selftest.hpp"

namespace kmax::cli {

namespace {
struct SelfTestOptions {
  bool hand = false;
  double patience = 20.0;
  int exchanges = 50;

  void declare(CLI::App& command) {
    command.add_flag("--hand", hand, "Also asks you to move the handle and to press the emergency stop");
    add_quantity(command, "--patience", patience, "s", "How long --hand waits for each, s", 1.0, 600.0);
    add_number(command, "--exchanges", exchanges, "Messages exchanged to test the link", 1, 10000);
  }
};

Json check_json(const selftest::CheckResult& check) {
  Json values = Json::array();
  for (const selftest::MeasuredValue& value : check.values)
    values.push_back({{"name", value.name},
                      {"value", std::isfinite(value.value) ? Json(value.value) : Json(nullptr)},
                      {"unit", value.unit}});
  return {{"name", check.name},
          {"verdict", selftest::name_of(check.verdict)},
          {"message", check.message},
          {"values", values}};
}

Json fault_json(const std::optional<selftest::FaultAtStart>& before) {
  if (!before) return nullptr;
  return {{"name", before->fault == firmware::Fault::none
                       ? Json(nullptr)
                       : Json(std::string(firmware::text_of(before->fault).name))},
          {"message", before->words},
          {"cleared", before->cleared}};
}

void print_json(Context& context, const selftest::Report& report) {
  Json checks = Json::array();
  for (const selftest::CheckResult& check : report.checks) checks.push_back(check_json(check));
  const selftest::CheckResult* failure = report.first_failure();
  context.print({{"pass", report.pass()},
                 {"fault_at_start", fault_json(report.fault_at_start)},
                 {"checks", checks},
                 {"faulty_part", failure == nullptr ? Json(nullptr) : Json(failure->part)},
                 {"largest_displacement_m", report.largest_displacement},
                 {"conclusion", selftest::conclusion(report)}});
}

void print_table(Context& context, const selftest::Report& report) {
  constexpr std::size_t name_width = 23, verdict_width = 11, indent = name_width + verdict_width;
  const std::size_t width = context.columns();
  if (report.fault_at_start)
    base::print(context.out, "{:<{}}{}\n", "fault before the test", indent,
                base::wrapped(fmt::format("{} ({})", report.fault_at_start->words,
                                          report.fault_at_start->cleared ? "cleared" : "its cause remains"),
                              width - indent, indent));
  for (const selftest::CheckResult& check : report.checks)
    base::print(context.out, "{:<{}}{:<{}}{}\n", check.name, name_width, selftest::name_of(check.verdict),
                verdict_width, base::wrapped(check.message, width - indent, indent));
  base::print(context.out, "The handle was moved by {:.2f} mm at most, by its encoder.\n{}\n",
              report.largest_displacement * 1e3, selftest::conclusion(report));
}

int run_selftest_command(Context& context, const SelfTestOptions& options) {
  const base::Interruption interruption;
  device::Device device = context.connect_to_change();
  selftest::SelfTestSettings settings;
  settings.axis = context.axis();
  settings.link_exchanges = options.exchanges;
  if (options.hand) {
    settings.hand.emplace();
    settings.hand->patience = options.patience;
    settings.say = [&](const std::string& text) { context.note(text); };
  }
  selftest::Report report;
  {
    base::Progress progress(context.messages());
    report = selftest::run_selftest(device, settings, [&](const std::string& text) {
      if (interruption.requested()) throw bench::Interrupted("interrupted");
      if (!text.empty()) progress.show(text);
    });
  }
  if (context.json) {
    print_json(context, report);
  } else {
    print_table(context, report);
  }
  return report.pass() ? base::done : base::verdict_is_no;
}
}  // namespace

void add_selftest_command(CLI::App& app, Context& context) {
  add_command<SelfTestOptions>(
      app, context,
      {"selftest", "Finds the faulty part of an axis: supply, gate driver, phases, sensors, encoder, lines.",
       "  kmax selftest\n  kmax selftest --axis 1 --json\n  kmax selftest --hand\n\n"
       "Gives small voltages that move the handle by well under 1 mm; keep it free. The axis is disarmed\n"
       "afterwards and every parameter is as it was; a fault that it had before is shown and cleared.\n"
       "Exit code 3: a check failed."},
      Takes::device_and_axis, run_selftest_command);
}

}  // namespace kmax::cli
