// kmax list, get, set.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <bit>
#include <cctype>
#include <optional>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/suggestion.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/parameters/parameter_table.hpp"

namespace kmax::cli {

using device::Assignment;
using device::Device;
using device::Parameter;

namespace {
struct ListOptions {
  std::string text;
  bool all_axes = false, changed_only = false, whole_texts = false;

  void declare(CLI::App& command) {
    command
        .add_option("text", text,
                    "Only names that begin with this; if none does, those that contain it; else those whose "
                    "help does")
        ->option_text("TEXT");
    command.add_flag("--all", all_axes, "Every axis");
    command.add_flag("--changed", changed_only, "Only values that are not the default");
    command.add_flag("--long", whole_texts, "Whole help texts and choices, on lines of their own");
  }
};

bool contains_whatever_case(std::string_view text, std::string_view part) {
  const auto same = [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); };
  return std::search(text.begin(), text.end(), part.begin(), part.end(), same) != text.end();
}

std::vector<Parameter> listed(const Context& context, const ListOptions& options) {
  // axis0.wall is how axis 0's names may be written, not how they are shown.
  const bool names_axis_0 = options.text.starts_with("axis0.");
  const std::string text = names_axis_0 ? options.text.substr(6) : options.text;
  const bool names_axis = names_axis_0 || text.starts_with("axis");
  std::vector<Parameter> beginning, containing, explained;
  std::vector<std::string> groups;
  for (const Parameter& parameter : device::all_parameters()) {
    const std::string name = parameter.name();
    groups.push_back(name.substr(0, name.rfind('.')));
    if (parameter.belongs_to_axis() && !names_axis && !options.all_axes && parameter.axis() != context.axis())
      continue;
    if (names_axis_0 && !(parameter.belongs_to_axis() && parameter.axis() == 0)) continue;
    // With --axis 1 the text `wall` means axis1.wall.
    const std::string_view compared = names_axis ? std::string_view(name) : parameter.definition().name;
    if (compared.starts_with(text)) beginning.push_back(parameter);
    if (contains_whatever_case(compared, text)) containing.push_back(parameter);
    if (contains_whatever_case(parameter.definition().help, text)) explained.push_back(parameter);
  }
  for (auto* found : {&beginning, &containing, &explained}) {
    if (!found->empty()) return *found;
  }
  std::sort(groups.begin(), groups.end());
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  throw UsageError(fmt::format("no parameter's name or help contains '{}'{}", options.text,
                               base::did_you_mean(options.text, groups)));
}

int run_list(Context& context, const ListOptions& options) {
  const auto parameters = listed(context, options);
  Device device = context.connect();
  const auto raw = device.read(parameters);
  std::vector<ParameterRow> rows;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const bool changed = parameters[i].writable() && parameters[i].definition().persistent &&
                         !same_value(parameters[i], raw[i], parameters[i].default_raw());
    if (changed || !options.changed_only) rows.push_back({parameters[i], raw[i]});
  }
  if (!context.json) {
    if (rows.empty()) {
      context.note("every value is its default");
    } else {
      print_parameter_table(context.out, rows, base::terminal_behind(context.out), options.whole_texts);
    }
    return base::done;
  }
  Json document = Json::object();
  for (const ParameterRow& row : rows) {
    Json one = json::value_and_unit_json(row.parameter, row.raw);
    const Json description = json::description_json(row.parameter);
    for (const char* key : {"min", "max", "default", "values", "access", "help"}) one[key] = description[key];
    document[row.parameter.name()] = one;
  }
  context.print(document);
  return base::done;
}

/// The name a value is shown under: as the user wrote it if that says the axis.
std::string shown_name(const std::string& given, const Parameter& parameter) {
  return given.starts_with("axis") ? given : parameter.name();
}

struct GetOptions {
  std::vector<std::string> names;

  void declare(CLI::App& command) {
    command.add_option("names", names, "Names as 'kmax list' shows them")->option_text("NAME ...");
  }
};

int run_get(Context& context, const GetOptions& options) {
  const std::vector<std::string>& names = options.names;
  if (names.empty())
    throw UsageError("name a parameter, as in 'kmax get wall.stiffness'; 'kmax list' shows all of them");
  std::vector<Parameter> parameters;
  for (const std::string& name : names) parameters.push_back(device::resolve(name, context.axis()));
  Device device = context.connect();
  const auto raw = device.read(parameters);
  Json document = Json::object();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (context.json) {
      document[shown_name(names[i], parameters[i])] = json::value_and_unit_json(parameters[i], raw[i]);
    } else {
      base::print(context.out, "{} = {}\n", shown_name(names[i], parameters[i]),
                  value_with_unit(parameters[i], raw[i]));
    }
  }
  if (context.json) context.print(document);
  return base::done;
}

void note_line_settings(Context& context, const std::vector<Assignment>& assignments, const Device& device) {
  const bool concerns_line = std::any_of(assignments.begin(), assignments.end(), [](const Assignment& one) {
    return one.parameter == Parameter::of<"modbus.unit">() ||
           one.parameter == Parameter::of<"modbus.baud_rate">();
  });
  if (concerns_line && !context.simulated())
    context.note(fmt::format("from now on: --device '{}'", device.description()));
}

/// Node ID and bit rate are taken over when the node starts to communicate (CiA 301, NMT reset).
void note_can_settings(Context& context, const std::vector<Assignment>& assignments) {
  for (const auto& [parameter, raw] : assignments) {
    if (parameter == Parameter::of<"node.id">())
      context.note(fmt::format(
          "node.id takes effect at the next start ('kmax save' first) or NMT reset; then --device "
          "'can:IFACE?node={}'",
          raw));
    if (parameter == Parameter::of<"can.bit_rate">())
      context.note(
          "can.bit_rate takes effect at the next start ('kmax save' first) or NMT reset; then the interface "
          "must have it, too: 'sudo ip link set IFACE type can bitrate RATE'");
  }
}

struct SetOptions {
  std::vector<std::string> texts;

  void declare(CLI::App& command) {
    command.add_option("assignments", texts, "Names and what they are set to")->option_text("NAME=VALUE ...");
  }
};

int run_set(Context& context, const SetOptions& options) {
  const std::vector<std::string>& texts = options.texts;
  if (texts.empty())
    throw UsageError("write NAME=VALUE, as in 'kmax set wall.stiffness=3580'; 'kmax list' shows all names");
  std::optional<Device> connected;
  const std::vector<Assignment> assignments =
      device::parse_assignments(texts, context.axis(), [&](std::size_t axis) {
        if (!connected) connected.emplace(context.connect_to_change());
        return static_cast<double>(
            std::bit_cast<float>(connected->read(Parameter::of<"measured.position">(axis))));
      });
  if (!connected) connected.emplace(context.connect_to_change());
  Device& device = *connected;
  std::vector<Parameter> parameters;
  for (const Assignment& assignment : assignments) parameters.push_back(assignment.parameter);
  const auto before = device.read(parameters);
  device.apply(assignments);
  note_line_settings(context, assignments, device);
  note_can_settings(context, assignments);

  Json document = Json::object();
  for (std::size_t i = 0; i < assignments.size(); ++i) {
    const auto& [parameter, raw] = assignments[i];
    if (context.json) {
      document[parameter.name()] = json::value_and_unit_json(parameter, raw);
    } else {
      base::print(context.out, "{} = {} (was {})\n", parameter.name(), value_with_unit(parameter, raw),
                  value_text(parameter, before[i]));
    }
  }
  if (context.json) context.print(document);
  return base::done;
}
}  // namespace

void add_parameter_commands(CLI::App& app, Context& context) {
  add_command<ListOptions>(
      app, context,
      {"list", "Shows parameters and readings with value, unit, range, default and help.",
       "  kmax list                 axis 0 and the device; * marks what is not the default\n"
       "  kmax list wall.           the wall's parameters\n"
       "  kmax list axis1.wall      the same of axis 1\n"
       "  kmax list --long wall.    with the whole help texts"},
      Takes::device_and_axis, run_list);

  add_command<GetOptions>(
      app, context,
      {"get", "Prints values by name.",
       "  kmax get wall.stiffness axis1.wall.stiffness\n"
       "  kmax get measured.position --json    {\"measured.position\": {\"value\": ..., \"unit\": \"m\"}}"},
      Takes::device_and_axis, run_get);

  add_command<SetOptions>(
      app, context,
      {"set", "Sets values, all of them in the same instant or none, and reads them back.",
       "  kmax set wall.law=magnetic wall.stiffness=3.58N/mm wall.magnetic_length=1mm\n"
       "  kmax set axis1.wall.side=-1\n"
       "  kmax set wall.position=here-5mm   5 mm below where the handle is now\n\n"
       "Numbers are SI; units such as N/mm, mm, mm/s, ms, kHz, g, mN are converted. Choices go by\n"
       "name or number."},
      Takes::device_and_axis, run_set);
}

}  // namespace kmax::cli
