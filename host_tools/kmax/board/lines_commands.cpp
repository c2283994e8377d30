// kmax lines, reset, bootloader.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/kmax/board/board_services.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {

using lines::LineRole;
using lines::LinesConfig;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

namespace {
/// Where a line is left: the board stops, and starts its application.
bool final_state(lines::LineRole role) {
  return role == lines::LineRole::emergency_stop;
}

/// Lines that are driven to their final states when this ends, however it ends.
class HeldLines {
 public:
  HeldLines(Context& context, lines::GpioLines& gpio) : context_(context), gpio_(gpio) {}
  HeldLines(const HeldLines&) = delete;
  HeldLines& operator=(const HeldLines&) = delete;

  void drive(const lines::LineSettings& settings, lines::LineRole role, bool active) {
    held_.push_back({role, active, gpio_.drive(settings, active)});
  }

  /// Errors: LineError of the last line that could not be brought there; the others are.
  void end() {
    std::exception_ptr error;
    for (Held& one : held_) {
      const bool wanted = final_state(one.role);
      if (one.active == wanted) continue;
      one.active = wanted;
      try {
        // Driven, not only released: some GPIO drivers leave a released line at its last level.
        one.line->set(wanted);
        context_.note(
            fmt::format("{} = {}", lines::facts_of(one.role).name, lines::state_word(one.role, wanted)));
      } catch (const std::exception&) {
        error = std::current_exception();
      }
    }
    if (error) std::rethrow_exception(error);
  }

  ~HeldLines() {
    try {
      end();
    } catch (const std::exception& error) {
      context_.note(error.what());
    }
  }

 private:
  struct Held {
    lines::LineRole role;
    bool active;
    std::unique_ptr<lines::OutputLine> line;
  };

  Context& context_;
  lines::GpioLines& gpio_;
  std::vector<Held> held_;
};

struct LinesOptions {
  std::string file;
  std::vector<std::string> texts;
  double duration = 0;
  std::string board;

  void declare(CLI::App& command) { add_lines_option(command, file); }
  void declare_duration(CLI::App& command) {
    command.add_option("--for", duration, "Ends after so many seconds instead of at Ctrl-C")
        ->type_name("S")
        ->transform(quantity("s", 0.001, 1e6));
  }
};

struct WatchLinesOptions : LinesOptions {
  void declare(CLI::App& command) {
    LinesOptions::declare(command);
    // Not positional: `reset` would be taken for the command of that name.
    command
        .add_option("--line", texts,
                    "Line as in the configuration, may be repeated (default: fault and healthy)")
        ->type_name("NAME")
        ->allow_extra_args(false);
    declare_duration(command);
  }
};

struct SetLinesOptions : LinesOptions {
  void declare(CLI::App& command) {
    LinesOptions::declare(command);
    command
        .add_option("assignments", texts,
                    "emergency_stop=stop|run, reset=reset|run, boot0=bootloader|application")
        ->option_text("NAME=STATE ...");
    declare_duration(command);
  }
};

struct BootloaderOptions : LinesOptions {
  void declare(CLI::App& command) {
    LinesOptions::declare(command);
    command.add_option("--board", board, "Kind of board: " + flash::board_kinds())->type_name("KIND");
  }
};

constexpr milliseconds look_around{100};

/// A line that the configuration lacks is wrong usage; whatever else goes wrong is not.
template <typename Options, int (*run)(Context&, const LinesOptions&, const LinesConfig&)>
int with_lines(Context& context, const Options& options) {
  const LinesConfig config = read_lines_config(options.file);
  try {
    return run(context, options, config);
  } catch (const lines::LinesConfigError& error) {
    throw UsageError(error.what());
  }
}

void require_some(const LinesConfig& config) {
  if (!config.lines.empty()) return;
  throw UsageError(
      fmt::format("no lines are configured{}; write into {} which line is wired to what, for example\n"
                  "  [lines.reset]\n  chip = \"gpiochip0\"\n  line = 17",
                  config.file.empty() ? "" : " in " + config.file,
                  config.file.empty() ? lines::default_lines_file().string() : "it"));
}

/// End of --for, or never.
std::function<bool()> until(const LinesOptions& options, const base::Interruption& interruption) {
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(options.duration));
  const bool limited = options.duration > 0;
  return [=, &interruption] { return interruption.requested() || (limited && Clock::now() >= end); };
}

int list_lines(Context& context, const LinesOptions&, const LinesConfig& config) {
  require_some(config);
  const auto gpio = board_services(context).open_gpio();
  Json document = Json::object();
  std::exception_ptr first_error;
  for (const auto& [role, settings] : config.lines) {
    const std::string name(lines::facts_of(role).name);
    try {
      const lines::LineFacts facts = gpio->describe(settings);
      const std::string state =
          facts.active ? std::string(lines::state_word(role, *facts.active)) : "unknown";
      if (context.json) {
        document[name] = {{"chip", facts.chip},
                          {"label", facts.label},
                          {"line", facts.offset},
                          {"name", facts.name},
                          {"direction", facts.output ? "output" : "input"},
                          {"held_by", facts.consumer.empty() ? Json(nullptr) : Json(facts.consumer)},
                          {"level", facts.high ? Json(*facts.high ? "high" : "low") : Json(nullptr)},
                          {"active", facts.active ? Json(*facts.active) : Json(nullptr)},
                          {"state", facts.active ? Json(state) : Json(nullptr)}};
        continue;
      }
      base::print(context.out, "{:15} {} line {}{}, {}: {}\n", name, facts.chip, facts.offset,
                  facts.name.empty() ? "" : fmt::format(" \"{}\"", facts.name),
                  facts.output ? "output" : "input",
                  facts.high ? fmt::format("{}, {}", *facts.high ? "high" : "low", state)
                             : fmt::format("held by {}", facts.consumer));
    } catch (const lines::LineError& error) {
      // The others are still worth seeing.
      if (!first_error) first_error = std::current_exception();
      if (context.json) {
        document[name] = {{"error", error.what()}};
      } else {
        base::print(context.out, "{:15} {}\n", name, error.what());
      }
    }
  }
  if (context.json) context.print(document);
  if (first_error && !context.json) std::rethrow_exception(first_error);
  return first_error ? base::failed : base::done;
}

LineRole role_of(const std::string& name) {
  if (const auto role = lines::role_named(name)) return *role;
  std::string names;
  for (const auto& facts : lines::all_roles) names += (names.empty() ? "" : ", ") + std::string(facts.name);
  throw UsageError(fmt::format("there is no line '{}'; lines are {}", name, names));
}

std::string seconds_text(std::chrono::nanoseconds time) {
  return fmt::format("{}.{:09}", time.count() / 1'000'000'000, time.count() % 1'000'000'000);
}

int watch_lines(Context& context, const LinesOptions& options, const LinesConfig& config) {
  std::vector<LineRole> roles;
  for (const std::string& name : options.texts) roles.push_back(role_of(name));
  if (options.texts.empty()) {
    require_some(config);
    for (const auto& [role, settings] : config.lines) {
      if (lines::facts_of(role).from_board) roles.push_back(role);
    }
    if (roles.empty())
      throw UsageError(
          "neither fault nor healthy is configured; name the lines to watch, as in 'kmax lines watch --line "
          "reset'");
  }
  std::vector<lines::LineSettings> settings;
  for (const LineRole role : roles) settings.push_back(config.required(role));

  const base::Interruption interruption;
  const auto gpio = board_services(context).open_gpio();
  const auto watch = gpio->watch(settings);
  const auto over = until(options, interruption);
  Json start = Json::object(), edges = Json::array();
  const std::vector<bool> states = watch->states();
  for (std::size_t i = 0; i < roles.size(); ++i) {
    const std::string word(lines::state_word(roles[i], states[i]));
    start[std::string(lines::facts_of(roles[i]).name)] = word;
    if (!context.json)
      base::print(context.out, "{:>20}  {:15} {}\n", "now", lines::facts_of(roles[i]).name, word);
  }
  context.out.flush();
  // The wait ends at an edge; its limit is only for the end of the whole.
  while (!over()) {
    for (const lines::Edge& edge : watch->wait(look_around)) {
      const std::string name(lines::facts_of(roles[edge.line]).name);
      const std::string word(lines::state_word(roles[edge.line], edge.active));
      if (context.json) {
        edges.push_back(
            {{"line", name}, {"state", word}, {"active", edge.active}, {"time_ns", edge.time.count()}});
      } else {
        base::print(context.out, "{:>20}  {:15} {}\n", seconds_text(edge.time), name, word);
      }
    }
    context.out.flush();
  }
  if (context.json) context.print({{"start", start}, {"edges", edges}});
  return base::done;
}

struct LineAssignment {
  LineRole role;
  bool active;
};

LineAssignment parsed(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos)
    throw UsageError(fmt::format("'{}': write NAME=STATE, as in emergency_stop=stop", text));
  const LineRole role = role_of(text.substr(0, equals));
  const auto& facts = lines::facts_of(role);
  if (role != LineRole::emergency_stop && role != LineRole::boot0 && role != LineRole::reset)
    throw UsageError(
        fmt::format("'{}': {}; lines to set are reset, boot0 and emergency_stop", text,
                    facts.from_board ? "the board drives this line" : "this line is the debug port's"));
  const std::string word = text.substr(equals + 1);
  for (const bool active : {true, false}) {
    if (word == lines::state_word(role, active)) return {role, active};
  }
  throw UsageError(
      fmt::format("'{}': {} is set to {} or {}", text, facts.name, facts.active, facts.inactive));
}

int set_lines(Context& context, const LinesOptions& options, const LinesConfig& config) {
  if (options.texts.empty()) throw UsageError("write NAME=STATE, as in 'kmax lines set emergency_stop=stop'");
  std::vector<LineAssignment> assignments;
  for (const std::string& text : options.texts) {
    const LineAssignment one = parsed(text);
    if (std::ranges::any_of(assignments, [&](const auto& other) { return other.role == one.role; }))
      throw UsageError(fmt::format("'{}': {} is named twice", text, lines::facts_of(one.role).name));
    config.required(one.role);
    assignments.push_back(one);
  }
  const base::Interruption interruption;
  const auto gpio = board_services(context).open_gpio();
  HeldLines held(context, *gpio);
  Json document = Json::object();
  for (const auto& [role, active] : assignments) {
    held.drive(config.required(role), role, active);
    const std::string name(lines::facts_of(role).name), word(lines::state_word(role, active));
    document[name] = word;
    if (!context.json) base::print(context.out, "{} = {}\n", name, word);
  }
  context.out.flush();
  if (std::ranges::any_of(assignments, [](const auto& one) { return one.role == LineRole::emergency_stop; }))
    context.note(
        "the emergency stop is a normally closed contact to ground: open is stop. This line must lie in "
        "series with the button, never beside it, where it would bridge it");
  context.note(fmt::format(
      "holding {}; then the lines are let go and fall back to their pulls",
      options.duration > 0 ? fmt::format("for {} s", options.duration) : std::string("until Ctrl-C")));
  const auto over = until(options, interruption);
  while (!over()) board_services(context).sleep(milliseconds(20));
  held.end();
  if (context.json) context.print(document);
  return base::done;
}

int run_reset(Context& context, const LinesOptions&, const LinesConfig& config) {
  config.required(LineRole::reset);
  // A reset that is torn would leave the board in it.
  const base::Interruption interruption;
  const auto gpio = board_services(context).open_gpio();
  lines::pulse_reset(*gpio, config, board_services(context).sleep);
  if (context.json) {
    context.print({{"reset", true}});
  } else {
    base::print(context.out, "the board was reset\n");
  }
  return base::done;
}

int run_bootloader(Context& context, const LinesOptions& options, const LinesConfig& config) {
  const flash::BoardProfile& board = chosen_board(options.board, config);
  if (board.boot0_is_switch && config.find(LineRole::boot0) == nullptr)
    throw std::runtime_error(fmt::format(
        "BOOT0 of {} is a switch that no line can move. To start the ROM bootloader: {}. To go back: {}",
        board.title, board.to_bootloader, board.to_application));
  // Likewise.
  const base::Interruption interruption;
  const auto gpio = board_services(context).open_gpio();
  lines::enter_bootloader(*gpio, config, board_services(context).sleep);
  if (context.json) {
    context.print({{"bootloader", true}});
  } else {
    base::print(context.out, "the ROM bootloader runs until the next reset ('kmax reset')\n");
  }
  return base::done;
}

}  // namespace

void add_lines_commands(CLI::App& app, Context& context) {
  CLI::App* list =
      add_command<LinesOptions>(app, context,
                                {"lines", "Shows the GPIO lines to the board and their levels.",
                                 "  kmax lines\n  kmax lines watch\n  kmax lines set emergency_stop=stop\n\n"
                                 "Nothing is changed: a line is looked at as it is."},
                                Takes::nothing, with_lines<LinesOptions, list_lines>);
  add_command<WatchLinesOptions>(
      *list, context,
      {"watch", "Prints every edge of a line with the kernel's time of it.",
       "  kmax lines watch                 fault and healthy, until Ctrl-C\n"
       "  kmax lines watch --line healthy --for 10\n\n"
       "Sleeps until the kernel reports an edge. Times are seconds of the kernel's monotonic clock; with\n"
       "--json the edges come as one document at the end."},
      Takes::nothing, with_lines<WatchLinesOptions, watch_lines>);
  add_command<SetLinesOptions>(
      *list, context,
      {"set", "Drives lines for as long as the command runs.",
       "  kmax lines set emergency_stop=stop\n  kmax lines set emergency_stop=run --for 60\n"
       "  kmax lines set reset=reset --for 1\n\n"
       "The emergency stop is a normally closed contact to ground: open is stop, closed is run. At the end\n"
       "it goes to stop, reset to run and BOOT0 to application; then the lines are let go."},
      Takes::nothing, with_lines<SetLinesOptions, set_lines>);
  add_command<LinesOptions>(app, context,
                            {"reset", "Resets the board's processor by its NRST line.", "  kmax reset"},
                            Takes::nothing, with_lines<LinesOptions, run_reset>);
  add_command<BootloaderOptions>(
      app, context,
      {"bootloader", "Starts the ROM bootloader of the board's processor by BOOT0 and NRST.",
       "  kmax bootloader\n\n'kmax flash' does this by itself where it needs it."},
      Takes::nothing, with_lines<BootloaderOptions, run_bootloader>);
}

}  // namespace kmax::cli
