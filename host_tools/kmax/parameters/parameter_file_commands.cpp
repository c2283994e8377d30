// kmax dump, load, diff.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>

#include "firmware/parameters/parameter_rules.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/parameter_file.hpp"
#include "host_tools/device/store.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/parameters/store_text.hpp"

namespace kmax::cli {

using device::Assignment;
using device::Device;
using device::FileSetting;
using device::Parameter;

namespace {
struct DumpOptions {
  std::string file;

  void declare(CLI::App& command) {
    command.add_option("file", file, "File to write, replaced if it is there; - for standard output")
        ->option_text("FILE")
        ->required();
  }
};

struct DiffOptions {
  std::string file;

  void declare(CLI::App& command) {
    command.add_option("file", file, "File to read, as 'kmax dump' writes it")
        ->option_text("FILE")
        ->required();
  }
};

struct LoadOptions {
  std::string file;
  bool dry_run = false;

  void declare(CLI::App& command) {
    command.add_option("file", file, "File to read, as 'kmax dump' writes it")
        ->option_text("FILE")
        ->required();
    command.add_flag("--dry-run", dry_run, "Check the file and show what would change, but set nothing");
  }
};

/// A setting of a file and what the device has instead.
struct Difference {
  FileSetting setting;
  std::uint32_t on_device;
};

std::string parameters_text(std::size_t count) {
  return counted(static_cast<std::uint32_t>(count), "parameter");
}

/// What the device has of all that a file can hold.
std::vector<Assignment> values_of(Device& device) {
  const auto parameters = device::file_parameters();
  const auto raw = device.read(parameters);
  std::vector<Assignment> values;
  for (std::size_t i = 0; i < raw.size(); ++i) values.push_back({parameters[i], raw[i]});
  return values;
}

std::uint32_t value_in(const std::vector<Assignment>& values, const Parameter& parameter) {
  return std::find_if(values.begin(), values.end(),
                      [&](const Assignment& one) { return one.parameter == parameter; })
      ->raw;
}

std::vector<Difference> differences_of(const std::vector<FileSetting>& settings,
                                       const std::vector<Assignment>& present) {
  std::vector<Difference> differences;
  for (const FileSetting& setting : settings) {
    const Assignment& wanted = setting.assignment;
    const std::uint32_t on_device = value_in(present, wanted.parameter);
    if (!same_value(wanted.parameter, wanted.raw, on_device)) differences.push_back({setting, on_device});
  }
  return differences;
}

device::FileOrigin origin_of(Device& device) {
  const auto texts = device.identify();
  std::string names;
  for (const char* key : {"vendor_name", "product_code", "model_name"}) {
    if (const auto text = texts.find(key); text != texts.end() && !text->second.empty())
      names += (names.empty() ? "" : ", ") + text->second;
  }
  if (names.empty()) names = "a Kmax device";
  const std::uint32_t serial = device.read(Parameter::of<"info.serial_number">());
  if (serial != 0) names += fmt::format(", serial number {}", serial);
  const std::uint32_t version = device.read(Parameter::of<"info.firmware_version">());
  return {names, fmt::format("{}.{}.{}", version >> 16, (version >> 8) & 0xFFu, version & 0xFFu)};
}

int run_dump(Context& context, const DumpOptions& options) {
  const std::string& file = options.file;
  const bool to_file = file != "-";
  if (to_file) base::check_writable(file);  // before a device is asked
  Device device = context.connect();
  const auto values = values_of(device);
  const device::FileOrigin origin = origin_of(device);
  const std::string text = parameter_file_text(origin, values);
  if (to_file) base::write_file(file, text);
  if (context.json) {
    Json all = Json::object();
    for (const Assignment& one : values)
      all[one.parameter.name()] = json::value_and_unit_json(one.parameter, one.raw);
    context.print({{"file", to_file ? Json(file) : Json(nullptr)},
                   {"device", origin.device},
                   {"firmware", origin.firmware},
                   {"parameters", all}});
  } else if (to_file) {
    context.say(fmt::format(
        "{}: {} written; CANopen's own {} settings, which 'kmax save' keeps as well, are not in files", file,
        parameters_text(values.size()), device::persistent_parameters().size() - values.size()));
  } else {
    context.out << text;
  }
  return base::done;
}

/// What a user must know who reaches the device by what is about to change.
std::vector<std::string> address_warnings(const std::vector<Difference>& differences,
                                          const std::vector<Assignment>& present) {
  const auto changed = [&](const Parameter& parameter) -> const Difference* {
    for (const Difference& one : differences) {
      if (one.setting.assignment.parameter == parameter) return &one;
    }
    return nullptr;
  };
  const auto after = [&](const Parameter& parameter) {
    const Difference* one = changed(parameter);
    return value_text(parameter, one != nullptr ? one->setting.assignment.raw : value_in(present, parameter));
  };
  constexpr Parameter unit = Parameter::of<"modbus.unit">(), baud = Parameter::of<"modbus.baud_rate">(),
                      node = Parameter::of<"node.id">(), bit_rate = Parameter::of<"can.bit_rate">();
  std::vector<std::string> warnings;
  const auto warn = [&](const Parameter& parameter, const std::string& consequence) {
    if (const Difference* one = changed(parameter))
      warnings.push_back(fmt::format("{} changes from {} to {}: {}", parameter.name(),
                                     value_text(parameter, one->on_device), after(parameter), consequence));
  };
  const std::string serial =
      fmt::format("the device's address on its serial line becomes serial:PATH?unit={}&baud={} at once",
                  after(unit), after(baud));
  warn(unit, serial);
  warn(baud, serial);
  warn(node,
       fmt::format("the device's address on its CAN bus becomes can:IFACE?node={} at the next NMT reset, "
                   "or after 'kmax save' at the next start",
                   after(node)));
  warn(bit_rate,
       "the device takes part in a CAN bus of this bit rate only, from the next NMT reset, or after 'kmax "
       "save' from the next start");
  return warnings;
}

/// What the device would find in the whole set of values; what depends on the moment only it can know.
void check_rules_with(const std::vector<FileSetting>& settings, const std::vector<Assignment>& present) {
  firmware::ParameterValues values;
  const auto put = [&values](const Assignment& one) {
    values.set_raw(firmware::slot_of(one.parameter.entry(), one.parameter.axis()), one.raw);
  };
  for (const Assignment& one : present) put(one);
  for (const FileSetting& setting : settings) put(setting.assignment);
  const auto broken = check_rules(values);
  if (broken.refusal == firmware::Refusal::none) return;
  const auto owner = firmware::owner_of(broken.slot);
  const Parameter parameter(owner.entry, owner.axis);
  throw base::ValueError(fmt::format("{} = {}: the device would refuse: {}", parameter.name(),
                                     value_with_unit(parameter, values.raw(broken.slot)),
                                     firmware::to_string(broken.refusal)));
}

/// The file's line that a refusal is about, if it has one.
std::string with_place(const std::string& message, const std::string& file,
                       const std::vector<FileSetting>& settings) {
  for (const FileSetting& setting : settings) {
    if (message.starts_with(setting.assignment.parameter.name() + " "))
      return fmt::format("{}:{}: {}", file, setting.line, message);
  }
  return fmt::format("{}: {}", file, message);
}

void set_all(Device& device, const LoadOptions& options, const std::vector<FileSetting>& settings,
             const std::vector<Assignment>& present) {
  try {
    if (options.dry_run) return check_rules_with(settings, present);
    std::vector<Assignment> assignments;
    for (const FileSetting& setting : settings) assignments.push_back(setting.assignment);
    device.apply(assignments);
  } catch (const base::ValueError& error) {
    throw base::ValueError(with_place(error.what(), options.file, settings));
  } catch (const base::DeviceError& error) {
    throw base::DeviceError(with_place(error.what(), options.file, settings));
  }
}

int run_load(Context& context, const LoadOptions& options) {
  const auto settings = device::read_parameter_file(options.file);
  Device device = context.connect_to_change();
  const std::string address = device.description();
  const auto present = values_of(device);
  const auto changes = differences_of(settings, present);
  const auto warnings = address_warnings(changes, present);
  for (const std::string& warning : warnings) context.note(warning);
  set_all(device, options, settings, present);
  if (device.description() != address)
    context.note(fmt::format("from now on: --device '{}'", device.description()));

  if (context.json) {
    Json changed = Json::object();
    for (const auto& [setting, before] : changes) {
      const auto& [parameter, raw] = setting.assignment;
      changed[parameter.name()] = {{"before", json::value_json(parameter, before)},
                                   {"value", json::value_json(parameter, raw)},
                                   {"unit", std::string(parameter.definition().unit)}};
    }
    context.print({{"file", options.file},
                   {"dry_run", options.dry_run},
                   {"parameters", settings.size()},
                   {"changed", changed},
                   {"warnings", warnings}});
    return base::done;
  }
  for (const auto& [setting, before] : changes) {
    const auto& [parameter, raw] = setting.assignment;
    base::print(context.out, "{} = {} ({} {})\n", parameter.name(), value_with_unit(parameter, raw),
                options.dry_run ? "is" : "was", value_text(parameter, before));
  }
  if (options.dry_run) {
    base::print(context.out, "{}: {}, {} would change; nothing was set\n", options.file,
                parameters_text(settings.size()), changes.size());
    return base::done;
  }
  base::print(context.out, "{}: {} set and read back equal; {} changed\n", options.file,
              parameters_text(settings.size()), changes.size());
  if (!changes.empty()) context.note("until the next restart: only 'kmax save' keeps them");
  return base::done;
}

int run_diff(Context& context, const DiffOptions& options) {
  const std::string& file = options.file;
  const auto settings = device::read_parameter_file(file);
  Device device = context.connect();
  const auto present = values_of(device);
  const auto differences = differences_of(settings, present);
  const std::size_t not_in_file = present.size() - settings.size();
  const int code = differences.empty() ? base::done : base::verdict_is_no;
  if (context.json) {
    Json differing = Json::object();
    for (const auto& [setting, on_device] : differences) {
      const auto& [parameter, raw] = setting.assignment;
      differing[parameter.name()] = {{"file", json::value_json(parameter, raw)},
                                     {"device", json::value_json(parameter, on_device)},
                                     {"unit", std::string(parameter.definition().unit)}};
    }
    context.print({{"file", file},
                   {"parameters", settings.size()},
                   {"not_in_file", not_in_file},
                   {"equal", differences.empty()},
                   {"differences", differing}});
    return code;
  }
  struct Row {
    std::string name, in_file, on_device;
  };
  std::vector<Row> rows{{"name", "file", "device"}};
  for (const auto& [setting, on_device] : differences) {
    const auto& [parameter, raw] = setting.assignment;
    rows.push_back(
        {parameter.name(), value_with_unit(parameter, raw), value_with_unit(parameter, on_device)});
  }
  std::size_t name_width = 0, file_width = 0;
  for (const Row& row : rows) {
    name_width = std::max(name_width, row.name.size());
    file_width = std::max(file_width, row.in_file.size());
  }
  if (differences.empty()) {
    base::print(context.out, "{}: {}, equal on the device\n", file, parameters_text(settings.size()));
  } else {
    for (const Row& row : rows)
      base::print(context.out, "{:<{}}  {:<{}}  {}\n", row.name, name_width, row.in_file, file_width,
                  row.on_device);
  }
  if (not_in_file != 0)
    context.note(fmt::format("{} not in the file and not compared",
                             not_in_file == 1 ? std::string("1 parameter of the device is")
                                              : fmt::format("{} parameters of the device are", not_in_file)));
  return code;
}
}  // namespace

void add_parameter_file_commands(CLI::App& app, Context& context) {
  add_command<DumpOptions>(
      app, context,
      {"dump", "Writes the device's parameters to a file (TOML), with units and choices.",
       "  kmax dump handle.toml\n"
       "  kmax dump -               on standard output\n\n"
       "All that 'kmax save' keeps, except CANopen's own settings, with the values that are in use\n"
       "now. The file has no date in it: equal parameters give an equal file."},
      Takes::device, run_dump);

  add_command<LoadOptions>(
      app, context,
      {"load", "Sets the parameters of a file, all of them in the same instant or none, and reads them back.",
       "  kmax load handle.toml --dry-run    see what would change\n"
       "  kmax load handle.toml && kmax save\n\n"
       "Parameters that the file does not name stay as they are. One bad line refuses the whole file. A dry\n"
       "run finds all that is wrong with the values, but not what depends on the moment: some parameters\n"
       "cannot change while an axis is armed."},
      Takes::device, run_load);

  add_command<DiffOptions>(
      app, context,
      {"diff", "Compares the parameters of a file with the device's.",
       "  kmax diff handle.toml && echo equal\n\n"
       "Exit code 3 if a value differs. Parameters that the file does not name are not compared."},
      Takes::device, run_diff);
}

}  // namespace kmax::cli
