// kmax info.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <map>

#include "host_tools/base/print.hpp"
#include "host_tools/device/crash_words.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/lock.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/parameters/store_text.hpp"

namespace kmax::cli {

using device::Parameter;

namespace {
std::string version_text(std::uint32_t version) {
  return fmt::format("{}.{}.{}", version >> 16, (version >> 8) & 0xFFu, version & 0xFFu);
}

std::string duration_text(std::uint32_t seconds) {
  const std::uint32_t minutes = seconds / 60, hours = minutes / 60;
  if (hours != 0) return fmt::format("{} h {} min", hours, minutes % 60);
  if (minutes != 0) return fmt::format("{} min {} s", minutes, seconds % 60);
  return fmt::format("{} s", seconds);
}

bool is_about_crash(const Parameter& parameter) {
  return parameter.definition().name.starts_with("info.crash_");
}

std::string crash_text(device::Device& device) {
  const auto number = [&device](std::string_view name) { return device.read(device::resolve(name)); };
  firmware::CrashRecord crash;
  crash.count = number("info.crash_count");
  if (crash.count == 0) return {};
  crash.cause = static_cast<firmware::CrashCause>(number("info.crash_cause"));
  crash.exception_number = static_cast<std::uint16_t>(number("info.crash_exception"));
  crash.program_counter = number("info.crash_program_counter");
  crash.link_register = number("info.crash_link_register");
  crash.status = number("info.crash_status");
  crash.hard_fault_status = number("info.crash_hard_fault_status");
  crash.address = number("info.crash_address");
  return device::crash_words(crash);
}

/// A reading for people.
std::string reading_text(const Parameter& parameter, std::uint32_t raw) {
  if (parameter == Parameter::of<"info.firmware_version">()) return version_text(raw);
  if (parameter == Parameter::of<"info.uptime">()) return duration_text(raw);
  if (parameter == Parameter::of<"info.dictionary_checksum">()) return fmt::format("{:08X}", raw);
  constexpr std::uint32_t wanted = 0, unknown = 4;
  if (parameter == Parameter::of<"info.brown_out_level">() && raw != wanted && raw != unknown)
    return value_with_unit(parameter, raw) +
           ": between 1.8 and 2.7 V the processor would run outside its specification; 'kmax flash' by SWD "
           "sets level_3";
  return value_with_unit(parameter, raw);
}

Json reading_json(const Parameter& parameter, std::uint32_t raw) {
  if (parameter == Parameter::of<"info.firmware_version">()) return version_text(raw);
  return json::value_json(parameter, raw);
}

int run_info(Context& context) {
  device::Device device = context.connect();
  const auto texts = device.identify();
  // The link's own counters, and those of the board, which stand behind the serial line's.
  const std::string_view link_counters = device.description().starts_with("can:") ? "can" : "counters";
  const std::size_t first_of_board = firmware::entry_of<"counters.missed_ticks">();
  std::vector<Parameter> parameters;
  for (const Parameter& parameter : device::all_parameters()) {
    const std::string_view group = parameter.definition().group.name;
    const bool counts =
        group == link_counters || (group == "counters" && parameter.entry() >= first_of_board);
    if (group == "info" || (counts && !parameter.writable())) parameters.push_back(parameter);
  }
  const auto raw = device.read(parameters);
  const std::string crash = crash_text(device);
  const device::StoreStatus store = device::Store(device).status();
  const device::LockStatus lock = device::Lock(device).status();

  std::vector<std::string> presences;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    presences.push_back(device::presence_words(device::Drive(device, axis).presence()));

  if (context.json) {
    Json identity = Json::object();
    for (const auto& [name, text] : texts) identity[name] = text;
    Json document = {
        {"device", device.description()}, {"program_version", KMAX_VERSION}, {"identity", identity}};
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const std::string_view name = parameters[i].definition().name;
      const auto dot = name.find('.');
      document[std::string(name.substr(0, dot))][std::string(name.substr(dot + 1))] =
          reading_json(parameters[i], raw[i]);
    }
    document["crash"] = crash.empty() ? Json(nullptr) : Json(crash);
    document["store"] = store_json(store);
    document["lock"] = lock_json(lock);
    document["axes"] = presences;
    context.print(document);
    return base::done;
  }

  const auto line = [&context](std::string name, const std::string& text) {
    for (char& letter : name) letter = letter == '_' ? ' ' : letter;
    context.say(fmt::format("{:<20} {}", name, text), 21);
  };
  line("device", device.description());
  line("program version", KMAX_VERSION);
  // Named apart from the numbers that follow.
  static const std::map<std::string, std::string> labels = {{"vendor_name", "vendor"},
                                                            {"product_code", "product"},
                                                            {"model_name", "board"},
                                                            {"revision", "firmware revision"}};
  for (const auto& [name, text] : texts) line(labels.contains(name) ? labels.at(name) : name, text);
  for (const auto& [name, text] : store_lines(store)) line(name, text);
  line("write lock", device::lock_words(lock));
  for (std::size_t axis = 0; axis < presences.size(); ++axis)
    line(fmt::format("axis {}", axis), presences[axis]);
  if (!crash.empty()) line("last crash", crash);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (is_about_crash(parameters[i])) continue;  // said in words above
    const std::string_view name = parameters[i].definition().name;
    line(std::string(name.substr(name.find('.') + 1)), reading_text(parameters[i], raw[i]));
  }
  return base::done;
}
}  // namespace

void add_info_command(CLI::App& app, Context& context) {
  add_command(app, context,
              {"info",
               "Shows what the device is, its firmware, board, clock, last reset and crash, kept parameters, "
               "uptime and link counters.",
               "  kmax info\n  kmax info --device 'serial:/dev/ttyUSB0?unit=2'"},
              Takes::device, run_info);
}

}  // namespace kmax::cli
