// kmax describe: the object dictionary of this program, without a device.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <charconv>
#include <cstdlib>
#include <ctime>
#include <map>
#include <string_view>

#include "host_tools/base/print.hpp"
#include "host_tools/base/suggestion.hpp"
#include "host_tools/description/described_objects.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"

namespace kmax::cli {

using device::Parameter;
using device::Table;

namespace {
const std::vector<std::string> formats = {"markdown", "json", "modbus", "eds", "dbc"};

struct DescribeOptions {
  std::string format;
  std::optional<unsigned> node;

  void declare(CLI::App& command) {
    command.add_option("--format", format, "markdown (default), json, modbus, eds or dbc")
        ->type_name("FORMAT");
    command.add_option("--node", node, "Node ID of the messages in a dbc file; default: the factory's")
        ->type_name("N")
        ->check(CLI::Range(1, 127));
  }
};

void describe_json(Context& context) {
  Json objects = Json::array();
  for (const Parameter& parameter : device::all_parameters())
    objects.push_back(json::description_json(parameter));
  context.print({{"objects", objects}});
}

std::string table_name(const Parameter& parameter) {
  return parameter.table() == Table::holding ? "holding" : "input";
}

/// One line per value, by table and address: for a spreadsheet, or for another Modbus client.
void describe_modbus(Context& context) {
  std::map<std::pair<Table, std::uint16_t>, Parameter> by_address;
  for (const Parameter& parameter : device::all_parameters())
    by_address.emplace(std::pair(parameter.table(), parameter.address()), parameter);
  base::print(context.out, "table,address,words,type,access,name,unit,allowed,default\n");
  for (const auto& [place, parameter] : by_address) {
    const Json description = json::description_json(parameter);
    base::print(context.out, "{},0x{:04X},{},{},{},{},{},\"{}\",{}\n", table_name(parameter),
                parameter.address(), parameter.words(), description["type"].get<std::string>(),
                description["access"].get<std::string>(), parameter.name(), parameter.definition().unit,
                parameter.writable() ? allowed_text(parameter) : "",
                parameter.writable() ? value_text(parameter, parameter.default_raw()) : "");
  }
}

/// The same bytes from the same program, whenever it runs: a file that is kept under version control changes
/// only with what it says. Who wants a date sets SOURCE_DATE_EPOCH (reproducible-builds.org) to the seconds
/// since 1970. Throws UsageError if that is no such number, or beyond the year 9999.
std::time_t time_of_file() {
  constexpr std::time_t latest = 253'402'300'799;
  const char* epoch = std::getenv("SOURCE_DATE_EPOCH");
  if (epoch == nullptr) return 0;
  const std::string_view text(epoch);
  std::time_t time = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), time);
  if (error != std::errc() || end != text.data() + text.size() || time < 0 || time > latest)
    throw UsageError(fmt::format(
        "SOURCE_DATE_EPOCH is '{}'; it takes seconds since 1970, 0 to {}: correct it, or unset it", text,
        latest));
  return time;
}

/// What a bar would be in a cell of a Markdown table.
std::string escaped(std::string_view text) {
  std::string result;
  for (const char letter : text) {
    if (letter == '|') result += '\\';
    result += letter;
  }
  return result;
}

std::string kind_of(const firmware::Entry& entry) {
  switch (entry.access) {
    case firmware::Access::read_only:
      return "readings";
    case firmware::Access::communication:
      return "settings over CANopen, readings over other links";
    case firmware::Access::read_write:
      break;
  }
  return "settings";
}

std::string default_text(const Parameter& parameter) {
  const auto& entry = parameter.definition();
  if (entry.access == firmware::Access::read_only) return "";
  if (entry.node_relative) return fmt::format("0x{:X} + node ID", parameter.default_raw());
  // An identifier, or an object in a PDO.
  if (entry.access == firmware::Access::communication && entry.maximum > 4e9)
    return fmt::format("0x{:X}", parameter.default_raw());
  return value_text(parameter, parameter.default_raw());
}

/// When it may change, as a sentence; empty: at any time.
std::string change_text(const firmware::Entry& entry) {
  const std::string until =
      entry.ceiling.empty() ? "." : fmt::format(", or raised up to `{}`.", entry.ceiling);
  switch (entry.change) {
    case firmware::Change::any_time:
      return "";
    case firmware::Change::disarmed_only:
      return " Changes only while disarmed.";
    case firmware::Change::only_lower:
      return " While armed it can only be lowered" + until;
    case firmware::Change::only_higher:
      return " While armed it can only be raised" + until;
    case firmware::Change::only_nearer_zero:
      return " While armed it can only be brought nearer to 0" + until;
  }
  return "";
}

void describe_markdown(Context& context) {
  base::print(context.out,
              R"(# Parameters

Made by `kmax describe --format markdown` from the object dictionary. Each further axis has the axis
parameters again: index + 0x{:X}, Modbus address + 0x{:X}, name with the prefix `axisN.`. Values of two
registers have the high word first. What is set over CANopen only can be read over every link.
)",
              firmware::axis_index_offset, firmware::axis_modbus_offset);
  std::uint16_t group = 0;
  for (const Parameter& parameter : device::all_parameters()) {
    if (parameter.axis() != 0) continue;
    const auto& entry = parameter.definition();
    if (entry.group.index != group) {
      group = entry.group.index;
      base::print(context.out, "\n## {}: {} ({}, Modbus {} registers)\n\n", entry.group.name, kind_of(entry),
                  parameter.belongs_to_axis() ? "per axis" : "per device", table_name(parameter));
      base::print(context.out,
                  R"(| name | unit | allowed | default | type | object | register | help |
|---|---|---|---|---|---|---|---|
)");
    }
    std::string help = escaped(entry.help);
    help += change_text(entry);
    if (parameter.writable() && !entry.persistent) help += " Not saved.";
    const bool settable = entry.access != firmware::Access::read_only;
    const Json type = json::description_json(parameter)["type"];
    base::print(context.out, "| `{}` | {} | {} | {} | {} | 0x{:04X}:{} | 0x{:04X} | {} |\n", entry.name,
                entry.unit, settable ? escaped(allowed_text(parameter)) : "read only",
                default_text(parameter), type.get<std::string>(), parameter.index(), entry.object_subindex(),
                parameter.address(), help);
  }
}

int run_describe(Context& context, const DescribeOptions& options) {
  std::string format = options.format;
  if (format.empty()) format = context.json ? "json" : "markdown";
  if (std::find(formats.begin(), formats.end(), format) == formats.end())
    throw UsageError(fmt::format("there is no format '{}'{}; there are {}", format,
                                 base::did_you_mean(format, formats), fmt::join(formats, ", ")));
  if (context.json && format != "json")
    throw UsageError(fmt::format("--json and --format {} exclude each other", format));
  if (options.node && format != "dbc")
    throw UsageError(fmt::format("--node belongs to --format dbc; {} is the same for every node", format));
  if (format == "json") describe_json(context);
  if (format == "modbus") describe_modbus(context);
  if (format == "markdown") describe_markdown(context);
  if (format == "eds")
    description::write_eds(context.out,
                           {.file_name = "kmax.eds", .version = KMAX_VERSION, .created = time_of_file()});
  if (format == "dbc")
    description::write_dbc(context.out, static_cast<std::uint8_t>(
                                            options.node.value_or(Parameter::of<"node.id">().default_raw())));
  return base::done;
}
}  // namespace

void add_describe_command(CLI::App& app, Context& context) {
  add_command<DescribeOptions>(
      app, context,
      {"describe", "Writes the object dictionary: every parameter, its range, object and register.",
       "  kmax describe --format markdown > parameters.md\n"
       "  kmax describe --format modbus      register map as CSV\n"
       "  kmax describe --format json        {\"objects\": [...]}\n"
       "  kmax describe --format eds > kmax.eds             for CANopen masters and configuration tools\n"
       "  kmax describe --format dbc --node 5 > kmax.dbc    for programs that show a CAN bus by name\n\n"
       "The EDS is dated 1970, so that the same program always writes the same file; with the environment\n"
       "variable SOURCE_DATE_EPOCH, in seconds since then, it has the date that you give."},
      Takes::nothing, run_describe);
}

}  // namespace kmax::cli
