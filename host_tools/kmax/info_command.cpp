// kmax info.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <CLI/CLI.hpp>

#include <map>

#include "host_tools/device/value_text.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/value_json.hpp"

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

/// A reading for people.
std::string reading_text(const Parameter& parameter, std::uint32_t raw) {
  if (parameter == Parameter::of<"info.firmware_version">()) return version_text(raw);
  if (parameter == Parameter::of<"info.uptime">()) return duration_text(raw);
  if (parameter == Parameter::of<"info.dictionary_checksum">()) return fmt::format("{:08X}", raw);
  return value_with_unit(parameter, raw);
}

Json reading_json(const Parameter& parameter, std::uint32_t raw) {
  if (parameter == Parameter::of<"info.firmware_version">()) return version_text(raw);
  return value_json(parameter, raw);
}

int run_info(Context& context) {
  device::Device device = context.connect();
  const auto texts = device.identify();
  std::vector<Parameter> parameters;
  for (const Parameter& parameter : device::all_parameters()) {
    const std::string_view group = parameter.definition().group.name;
    if (group == "info" || group == "counters") parameters.push_back(parameter);
  }
  const auto raw = device.read(parameters);

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
    context.print(document);
    return done;
  }

  const auto line = [&context](std::string name, const std::string& text) {
    for (char& letter : name) letter = letter == '_' ? ' ' : letter;
    fmt::print(context.out, "{:<20} {}\n", name, text);
  };
  line("device", device.description());
  line("program version", KMAX_VERSION);
  // Named apart from the numbers that follow.
  static const std::map<std::string, std::string> labels = {{"vendor_name", "vendor"},
                                                            {"product_code", "product"},
                                                            {"model_name", "board"},
                                                            {"revision", "firmware revision"}};
  for (const auto& [name, text] : texts) line(labels.contains(name) ? labels.at(name) : name, text);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const std::string_view name = parameters[i].definition().name;
    line(std::string(name.substr(name.find('.') + 1)), reading_text(parameters[i], raw[i]));
  }
  return done;
}
}  // namespace

void add_info_command(CLI::App& app, Context& context) {
  auto* info =
      add_command(app, context,
                  {"info", "Shows what the device is, its firmware, board, clock, uptime and link counters.",
                   "  kmax info\n  kmax info --device 'serial:/dev/ttyUSB0?unit=2'"},
                  Takes::device);
  info->callback([&context] { context.action = [&context] { return run_info(context); }; });
}

}  // namespace kmax::cli
