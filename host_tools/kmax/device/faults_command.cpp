// kmax faults.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <limits>

#include "firmware/drive/fault.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/crash_words.hpp"
#include "host_tools/device/fault_log.hpp"
#include "host_tools/kmax/commands.hpp"

namespace kmax::cli {

using base::number_text;
using device::number_of;
using firmware::FaultText;
using firmware::LogEntry;
using firmware::LogEvent;
using firmware::TripNumber;

namespace {
struct FaultsOptions {
  std::optional<std::uint32_t> number;
  bool clear = false;
  void declare(CLI::App& command) {
    auto* one = command.add_option("number", number, "Show all of the entry with this number")
                    ->check(plain_number())
                    ->check(CLI::Range(std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max()));
    command.add_flag("--clear", clear, "Erase the log; refused while an axis is armed")->excludes(one);
  }
};

/// What was measured when it tripped, in the order of TripNumber.
struct NumberText {
  const char *name, *key, *unit;
};
constexpr NumberText number_texts[] = {{"value", "value", nullptr},
                                       {"bound", "bound", nullptr},
                                       {"position", "position", "m"},
                                       {"velocity", "velocity", "m/s"},
                                       {"force", "force", "N"},
                                       {"current", "current", "A"},
                                       {"current asked for", "current_reference", "A"},
                                       {"supply", "supply", "V"},
                                       {"power stage", "temperature", "degC"},
                                       {"winding", "winding_temperature", "degC"}};
static_assert(std::size(number_texts) == std::tuple_size_v<decltype(LogEntry::numbers)>);

/// Of value and bound: the fault's; empty: it has neither.
std::string_view unit_of(const LogEntry& entry) {
  const FaultText* text = firmware::fault_by_error_code(entry.code);
  return text != nullptr ? text->unit : std::string_view();
}

std::string time_text(const LogEntry& entry) {
  if (entry.event != LogEvent::trip) return "-";
  const double time = device::time_of(entry);
  const auto minutes = static_cast<std::uint64_t>(time / 60.0);
  return fmt::format("{}:{:02}:{:06.3f}", minutes / 60, minutes % 60,
                     time - 60.0 * static_cast<double>(minutes));
}

/// One of the first two, with its unit.
std::string judged_text(const LogEntry& entry, TripNumber which) {
  if (entry.event != LogEvent::trip || unit_of(entry).empty()) return "";
  return fmt::format("{:.5g} {}", number_of(entry, which), unit_of(entry));
}

Json entry_json(const LogEntry& entry) {
  const bool trip = entry.event == LogEvent::trip;
  Json json = {{"number", entry.number},
               {"start", entry.start},
               {"event", trip ? "fault" : "start"},
               {"name", device::name_of(entry)}};
  if (!trip) {
    const auto crash = device::crash_before(entry);
    json["reset_cause"] = entry.code < std::size(firmware::names::reset_cause)
                              ? std::string(firmware::names::reset_cause[entry.code].name)
                              : std::to_string(entry.code);
    json["times"] = entry.count;
    json["crash"] = crash.count == 0 ? Json(nullptr) : Json(device::crash_words(crash));
    json["program_counter"] = crash.count == 0 ? Json(nullptr) : Json(crash.program_counter);
    return json;
  }
  json["axis"] = entry.axis;
  json["error_code"] = entry.code;
  json["time"] = device::time_of(entry);
  json["tick"] = entry.tick;
  json["unit"] = std::string(unit_of(entry));
  for (std::size_t i = 0; i < std::size(number_texts); ++i) {
    const bool known = number_texts[i].unit != nullptr || !unit_of(entry).empty();
    json[number_texts[i].key] =
        known ? Json(base::shortest_double(number_of(entry, static_cast<TripNumber>(i)))) : Json(nullptr);
  }
  return json;
}

void print_table(Context& context, const std::vector<LogEntry>& entries) {
  if (entries.empty()) {
    context.say("no fault and no reset since power-on, or since the log was erased");
    return;
  }
  const auto row = [&context](const auto&... cells) {
    const std::string line = fmt::format("{:>5} {:>5} {:>14}  {:<4}  {:<22} {:<12} {}", cells...);
    base::print(context.out, "{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
  };
  row("no.", "start", "time in it", "axis", "what", "value", "bound");
  for (const LogEntry& entry : entries) {
    const bool trip = entry.event == LogEvent::trip;
    const std::string times = entry.count > 1 ? fmt::format("{} times", entry.count) : "";
    row(entry.number, entry.start, time_text(entry), trip ? std::to_string(entry.axis) : std::string("-"),
        device::name_of(entry), trip ? judged_text(entry, TripNumber::value) : times,
        judged_text(entry, TripNumber::bound));
  }
  base::print(context.out, "'kmax faults {}' shows all that is known of entry {}\n", entries.front().number,
              entries.front().number);
}

void print_entry(Context& context, const LogEntry& entry) {
  const auto line = [&context](const char* name, const std::string& text) {
    if (!text.empty()) context.say(fmt::format("{:<18} {}", name, text), 19);
  };
  line("number", std::to_string(entry.number));
  line("start", fmt::format("{} since power-on", entry.start));
  line("what", device::name_of(entry));
  if (entry.event == LogEvent::start) {
    line("times in a row", std::to_string(entry.count));
    line("crash", device::crash_words(device::crash_before(entry)));
    return;
  }
  line("axis", std::to_string(entry.axis));
  line("time in it", fmt::format("{} (tick {})", time_text(entry), entry.tick));
  line("error code", fmt::format("0x{:04X}", entry.code));
  if (const FaultText* text = firmware::fault_by_error_code(entry.code)) {
    line("that is", std::string(text->what));
    line("look at", std::string(text->check));
  }
  for (std::size_t i = 0; i < std::size(number_texts); ++i) {
    const auto which = static_cast<TripNumber>(i);
    const char* unit = number_texts[i].unit;
    line(number_texts[i].name, unit == nullptr
                                   ? judged_text(entry, which)
                                   : fmt::format("{} {}", number_text(number_of(entry, which)), unit));
  }
}

int run_faults(Context& context, const FaultsOptions& options) {
  device::Device device = options.clear ? context.connect_to_change() : context.connect();
  const auto entries = device::read_fault_log(device.link());
  if (options.clear) {
    device::erase_fault_log(device);
    if (context.json) context.print({{"erased", entries.size()}});
    if (!context.json)
      base::print(context.out, "erased {} of the fault log\n",
                  entries.size() == 1 ? "1 entry" : fmt::format("{} entries", entries.size()));
    return base::done;
  }
  auto shown = entries;
  if (options.number) {
    std::erase_if(shown, [&options](const LogEntry& entry) { return entry.number != *options.number; });
    if (shown.empty())
      throw UsageError(entries.empty()
                           ? fmt::format("the fault log has no entry {}: it is empty", *options.number)
                           : fmt::format("the fault log has no entry {}; it has {} to {}", *options.number,
                                         entries.back().number, entries.front().number));
  }
  if (context.json) {
    Json list = Json::array();
    for (const LogEntry& entry : shown) list.push_back(entry_json(entry));
    context.print({{"start", device.read(device::Parameter::of<"log.start">())}, {"entries", list}});
  } else if (options.number) {
    print_entry(context, shown.front());
  } else {
    print_table(context, shown);
  }
  return base::done;
}
}  // namespace

void add_faults_command(CLI::App& app, Context& context) {
  add_command<FaultsOptions>(
      app, context,
      {"faults", "Shows the device's last 16 faults and resets, with the numbers of each.",
       "  kmax faults            the newest first\n"
       "  kmax faults 12         all that is known of entry 12, and what to look at\n"
       "  kmax faults --clear\n\n"
       "The log outlives resets, crashes and the watchdog, but no loss of power. A start in it is one that\n"
       "nobody switched on: several alike in a row are one entry."},
      Takes::device, run_faults);
}

}  // namespace kmax::cli
