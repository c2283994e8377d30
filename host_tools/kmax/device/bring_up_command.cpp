// kmax bring-up.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "host_tools/base/files.hpp"
#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/bring_up/bring_up.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"
#include "host_tools/kmax/terminal.hpp"

namespace kmax::cli {

namespace {
using bring_up::StageResult;
using bring_up::StageText;
using selftest::CheckResult;
using selftest::MeasuredValue;

struct BringUpOptions {
  bring_up::Settings settings;
  std::string stage, report;
  double supply = 0.0, brake = 0.0;
  bool no_button = false, yes = false, list = false;
  const CLI::Option *supply_given = nullptr, *brake_given = nullptr;

  void declare(CLI::App& command) {
    std::vector<std::string> names;
    for (const StageText& text : bring_up::all_stages()) names.emplace_back(text.name);
    command
        .add_option("--stage", stage, "This stage again; without it on from the first that has not passed")
        ->check(CLI::IsMember(names));
    command.add_option("--report", report, "Report file (default: bring_up_SERIAL.json)")->type_name("FILE");
    supply_given = command.add_option("--supply", supply, "What the supply's own meter shows, V")
                       ->transform(quantity("V", 5.0, 60.0));
    brake_given =
        command.add_option("--brake", brake, "Measured between the terminals of AUX, ohm; 0: nothing there")
            ->transform(quantity("ohm", 0.0, 1000.0));
    add_quantity(command, "--stiffness", settings.stiffness, "N/m", "The last wall's at most, N/m", 100.0,
                 100000.0);
    add_quantity(command, "--patience", settings.patience, "s", "How long a hand is waited for, s", 1.0,
                 600.0);
    command.add_flag("--no-button", no_button, "The emergency stop is a wire, and nobody can press it");
    command.add_flag("--yes", yes, "Everything is connected as it must be: ask nothing");
    command.add_flag("--list", list, "Show the stages and do nothing");
  }
};

/// Asks whoever is at the terminal; or nobody, as if all were agreed to.
class StagePrompter final : public bench::Prompter {
 public:
  explicit StagePrompter(TerminalPrompter* terminal) : terminal_(terminal) {}
  void ask(const std::string& what_to_do) override {
    if (terminal_ == nullptr) return;
    terminal_->ask(what_to_do);
  }

 private:
  TerminalPrompter* terminal_;
};

std::string range_text(const MeasuredValue& value) {
  const bool low = std::isfinite(value.least), high = std::isfinite(value.most);
  if (low && high && value.least == value.most) return fmt::format("must be {:.4g}", value.least);
  if (low && high) return fmt::format("{:.4g} .. {:.4g}", value.least, value.most);
  if (low) return fmt::format("at least {:.4g}", value.least);
  if (high) return fmt::format("at most {:.4g}", value.most);
  return "";
}

void print_result(Context& context, const bring_up::Report& before, std::size_t axis,
                  const StageResult& result) {
  for (const CheckResult& check : result.checks) {
    base::print(context.out, "  {:<22} {}\n", check.name, selftest::name_of(check.verdict));
    if (check.verdict != selftest::Verdict::pass) context.say("    " + check.message, 4);
    for (const MeasuredValue& value : check.values) {
      const auto was = before.number(axis, result.stage, check.name, value.name);
      std::string line = fmt::format("    {:<22}{:>11.5g} {:<7}{:<18}{}", value.name, value.value, value.unit,
                                     range_text(value), was ? fmt::format(" was {:.5g}", *was) : "");
      line.resize(line.find_last_not_of(' ') + 1);
      context.say(line, 26);
    }
  }
  context.out.flush();
}

int list_stages(Context& context) {
  if (context.json) {
    Json list = Json::array();
    for (const StageText& text : bring_up::all_stages())
      list.push_back({{"name", std::string(text.name)},
                      {"title", std::string(text.title)},
                      {"connect", std::string(text.connect)},
                      {"does", std::string(text.does)}});
    context.print({{"stages", list}});
    return base::done;
  }
  for (const StageText& text : bring_up::all_stages()) {
    context.say(fmt::format("{}: {}", text.name, text.title));
    context.say(fmt::format("  connect: {}", text.connect), 4);
    context.say(fmt::format("  does: {}", text.does), 4);
  }
  return base::done;
}

/// Before there is a device, nothing but its link can be wrong.
device::Device connect_or_advise(Context& context) {
  try {
    return context.connect_to_change();
  } catch (const device::LinkError& error) {
    throw device::LinkError(
        fmt::format("stage 'logic': {}. PWR must be green (motor supply on); serial line: 3.3 V adapter, RXD "
                    "to GPIO3 and TXD to GPIO4, 8E1 (even parity); CAN: H, L and ground on J3, 120 ohm at "
                    "both ends; SW1 on RUN, and the firmware written ('kmax flash')",
                    error.what()));
  }
}

int run_bring_up(Context& context, const BringUpOptions& options) {
  if (options.list) return list_stages(context);
  const base::Interruption interruption;
  bring_up::Settings settings = options.settings;
  settings.axis = context.axis();
  settings.has_button = !options.no_button;
  if (!options.stage.empty()) settings.only = bring_up::stage_named(options.stage);
  if (options.supply_given->count() > 0) settings.supply = options.supply;
  if (options.brake_given->count() > 0) settings.brake = options.brake;
  device::Device device = connect_or_advise(context);
  const bring_up::BoardFacts board = bring_up::read_board(device);
  const std::string file =
      options.report.empty() ? fmt::format("bring_up_{}.json", board.serial_number) : options.report;
  bring_up::Report report = bring_up::open_report(file, board);
  const bring_up::Report before = report;
  base::check_writable(file);
  const auto check = [&] {
    if (interruption.requested()) throw bench::Interrupted("interrupted; 'kmax bring-up' goes on from here");
  };
  TerminalPrompter terminal(context, check, "somebody must be at the board; --yes asks nothing");
  base::Progress progress(context.messages());
  StagePrompter prompter(options.yes ? nullptr : &terminal);
  const auto keep = [&file](const bring_up::Report& now) { base::write_file(file, now.text()); };
  const bring_up::Party party{prompter,
                              [&](const std::string& text) {
                                check();
                                if (!text.empty()) progress.show(text);
                              },
                              [&](const StageText& text) {
                                progress.make_room();
                                context.note(fmt::format("stage {}", text.name));
                              },
                              [&](const StageResult& result) {
                                if (context.json) return;
                                progress.make_room();
                                base::print(context.out, "{}: {}\n", bring_up::text_of(result.stage).name,
                                            result.passed() ? "passed" : "FAILED");
                                print_result(context, before, settings.axis, result);
                              }};
  bool passed = false;
  try {
    passed = bring_up::bring_up(device, report, settings, party, keep);
  } catch (const bring_up::OutOfTurn& error) {
    throw UsageError(error.what());
  }
  const auto next = report.next(settings.axis);
  if (context.json) {
    Json document = Json::parse(report.text());
    document["passed"] = passed;
    document["next_stage"] = next ? Json(std::string(bring_up::text_of(*next).name)) : Json(nullptr);
    document["report"] = file;
    context.print(document);
  } else {
    context.say(fmt::format(
        "{}: {}", file,
        next ? fmt::format("next stage: {}", bring_up::text_of(*next).name)
             : "all stages have passed; 'kmax save' keeps wall.stiffness. Positions count from each start: "
               "then 'kmax set wall.position=here-5mm'"));
  }
  return passed ? base::done : base::verdict_is_no;
}
}  // namespace

void add_bring_up_command(CLI::App& app, Context& context) {
  add_command<BringUpOptions>(
      app, context,
      {"bring-up", "Leads through the first start of a new board, stage by stage, to the first wall.",
       "  kmax bring-up --supply 24.1 --device serial:/dev/ttyUSB0\n"
       "  kmax bring-up --stage load                 once more, against what was measured before\n"
       "  kmax bring-up --list\n\n"
       "Each stage says what to connect and what will be done, asks, does it within stated limits, and "
       "measures. No\n"
       "stage before its turn. The report has every number with its range; the next run goes on behind the "
       "last\n"
       "stage that has passed. Exit code 3: a stage failed."},
      Takes::device_and_axis, run_bring_up);
}

}  // namespace kmax::cli
