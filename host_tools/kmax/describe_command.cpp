// kmax describe: the object dictionary of this program, without a device.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <CLI/CLI.hpp>

#include <map>

#include "host_tools/device/suggestion.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/value_json.hpp"

namespace kmax::cli {

using device::Parameter;
using device::Table;

namespace {
const std::vector<std::string> formats = {"markdown", "json", "modbus", "eds", "dbc"};

void describe_json(Context& context) {
  Json objects = Json::array();
  for (const Parameter& parameter : device::all_parameters()) objects.push_back(description_json(parameter));
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
  fmt::print(context.out, "table,address,words,type,access,name,unit,allowed,default\n");
  for (const auto& [place, parameter] : by_address) {
    const Json description = description_json(parameter);
    fmt::print(context.out, "{},0x{:04X},{},{},{},{},{},\"{}\",{}\n", table_name(parameter),
               parameter.address(), parameter.words(), description["type"].get<std::string>(),
               description["access"].get<std::string>(), parameter.name(), parameter.definition().unit,
               parameter.writable() ? allowed_text(parameter) : "",
               parameter.writable() ? value_text(parameter, parameter.default_raw()) : "");
  }
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

void describe_markdown(Context& context) {
  fmt::print(
      context.out,
      "# Parameters\n\n"
      "Made by `kmax describe --format markdown` from the object dictionary. Each further axis has the axis\n"
      "parameters again: index + 0x{:X}, Modbus address + 0x{:X}, name with the prefix `axisN.`. Values of "
      "two\n"
      "registers have the high word first.\n",
      firmware::axis_index_offset, firmware::axis_modbus_offset);
  std::uint16_t group = 0;
  for (const Parameter& parameter : device::all_parameters()) {
    if (parameter.axis() != 0) continue;
    const auto& entry = parameter.definition();
    if (entry.group.index != group) {
      group = entry.group.index;
      fmt::print(context.out, "\n## {}: {} ({}, Modbus {} registers)\n\n", entry.group.name,
                 parameter.writable() ? "settings" : "readings",
                 parameter.belongs_to_axis() ? "per axis" : "per device", table_name(parameter));
      fmt::print(context.out,
                 "| name | unit | allowed | default | type | object | register | help "
                 "|\n|---|---|---|---|---|---|---|---|\n");
    }
    std::string help = escaped(entry.help);
    if (entry.change == firmware::Change::disarmed_only) help += " Changes only while disarmed.";
    if (parameter.writable() && !entry.persistent) help += " Not saved.";
    const Json type = description_json(parameter)["type"];
    fmt::print(context.out, "| `{}` | {} | {} | {} | {} | 0x{:04X}:{} | 0x{:04X} | {} |\n", entry.name,
               entry.unit, parameter.writable() ? escaped(allowed_text(parameter)) : "read only",
               parameter.writable() ? value_text(parameter, parameter.default_raw()) : "",
               type.get<std::string>(), parameter.index(), entry.object_subindex(), parameter.address(),
               help);
  }
}

int run_describe(Context& context, std::string format) {
  if (format.empty()) format = context.json ? "json" : "markdown";
  if (format == "eds" || format == "dbc")
    throw UsageError(
        fmt::format("--format {} is not in this version; there are markdown, json and modbus", format));
  if (std::find(formats.begin(), formats.end(), format) == formats.end())
    throw UsageError(fmt::format("there is no format '{}'{}; there are markdown, json and modbus", format,
                                 device::did_you_mean(format, formats)));
  if (context.json && format != "json")
    throw UsageError(fmt::format("--json and --format {} exclude each other", format));
  if (format == "json") describe_json(context);
  if (format == "modbus") describe_modbus(context);
  if (format == "markdown") describe_markdown(context);
  return done;
}
}  // namespace

void add_describe_command(CLI::App& app, Context& context) {
  auto* describe = add_command(
      app, context,
      {"describe", "Writes the object dictionary: every parameter, its range, object and register.",
       "  kmax describe --format markdown > parameters.md\n"
       "  kmax describe --format modbus      register map as CSV\n"
       "  kmax describe --format json        {\"objects\": [...]}"},
      Takes::nothing);
  auto format = std::make_shared<std::string>();
  describe->add_option("--format", *format, "markdown (default), json or modbus")->type_name("FORMAT");
  describe->callback(
      [&context, format] { context.action = [&context, format] { return run_describe(context, *format); }; });
}

}  // namespace kmax::cli
