// kmax save, defaults.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "host_tools/base/print.hpp"
#include "host_tools/device/store.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/parameters/store_text.hpp"

namespace kmax::cli {

using device::Store;
using device::StoreStatus;

namespace {
int run_save(Context& context) {
  device::Device device = context.connect_to_change();
  Store store(device);
  const std::uint32_t errors_before = store.status().write_errors;
  const StoreStatus status = store.save();
  if (status.write_errors != errors_before)
    context.note(fmt::format("{} did not take and {} stepped over: the memory wears out",
                             counted(status.write_errors - errors_before, "word"),
                             status.write_errors - errors_before == 1 ? "was" : "were"));
  if (status.unsaved_parameters != 0)
    context.note(fmt::format("{} been changed by another program since the save began; save again to keep {}",
                             status.unsaved_parameters == 1
                                 ? std::string("1 parameter has")
                                 : fmt::format("{} parameters have", status.unsaved_parameters),
                             status.unsaved_parameters == 1 ? "it" : "them"));
  if (context.json) {
    context.print({{"saved_parameters", status.saved_parameters},
                   {"record", status.sequence},
                   {"read_back_equal", true},
                   {"unsaved_parameters", status.unsaved_parameters},
                   {"free_saves", status.free_saves},
                   {"erases", status.erases},
                   {"write_errors", status.write_errors}});
    return base::done;
  }
  context.say(fmt::format("saved {} as record {}, read back equal; {} before the next erase",
                          counted(status.saved_parameters, "parameter"), status.sequence,
                          status.free_saves == 1 ? std::string("1 more save fits")
                                                 : fmt::format("{} more saves fit", status.free_saves)));
  return base::done;
}

int run_defaults(Context& context) {
  device::Device device = context.connect_to_change();
  Store store(device);
  const auto changes = store.set_defaults();
  const std::size_t all = device::persistent_parameters().size();
  const StoreStatus status = store.status();
  if (context.json) {
    Json changed = Json::object();
    for (const auto& [parameter, before] : changes)
      changed[parameter.name()] = {{"before", json::value_json(parameter, before)},
                                   {"value", json::value_json(parameter, parameter.default_raw())},
                                   {"unit", std::string(parameter.definition().unit)}};
    context.print(
        {{"parameters", all}, {"changed", changed}, {"unsaved_parameters", status.unsaved_parameters}});
    return base::done;
  }
  for (const auto& [parameter, before] : changes)
    base::print(context.out, "{} = {} (was {})\n", parameter.name(),
                value_with_unit(parameter, parameter.default_raw()), value_text(parameter, before));
  base::print(context.out, "all {} parameters have their defaults; {} changed\n", all, changes.size());
  context.note(status.unsaved_parameters == 0 ? "that is what a restart brings, too"
                                              : "until the next restart: only 'kmax save' keeps them");
  return base::done;
}
}  // namespace

void add_store_commands(CLI::App& app, Context& context) {
  add_command(
      app, context,
      {"save", "Keeps all present parameters over a restart, and reads them back.",
       "  kmax set wall.stiffness=3.58N/mm && kmax save\n\n"
       "All means those of 'kmax dump' and CANopen's own settings.\n"
       "Appends a record to the device's memory; the one before stays until this one is whole, so a loss\n"
       "of power leaves the one or the other. Refused while an axis is armed, since the memory may hold the\n"
       "processor up for half a second; no axis can be armed meanwhile."},
      Takes::device, run_save);

  add_command(
      app, context,
      {"defaults", "Sets all parameters to their defaults; only 'kmax save' keeps that.",
       "  kmax defaults                  see what changes; a restart brings the kept parameters back\n"
       "  kmax defaults && kmax save     for good\n\n"
       "All means all: axes, motors, encoders, limits and the link itself (unit and baud rate). What is\n"
       "kept in the device's memory is not touched. Refused while an axis is armed."},
      Takes::device, run_defaults);
}

}  // namespace kmax::cli
