#include "host_tools/kmax/commands.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/base/axis_name.hpp"

namespace kmax::cli {

// Each is in the file of its name.
void add_parameter_commands(CLI::App& app, Context& context);       // list, get, set
void add_parameter_file_commands(CLI::App& app, Context& context);  // dump, load, diff
void add_store_commands(CLI::App& app, Context& context);           // save, defaults
void add_lock_commands(CLI::App& app, Context& context);            // lock, unlock
void add_info_command(CLI::App& app, Context& context);
void add_devices_command(CLI::App& app, Context& context);
void add_drive_commands(CLI::App& app, Context& context);  // state, arm, disarm, stop, clear
void add_faults_command(CLI::App& app, Context& context);
void add_view_command(CLI::App& app, Context& context);
void add_watch_command(CLI::App& app, Context& context);
void add_record_command(CLI::App& app, Context& context);
void add_capture_command(CLI::App& app, Context& context);
void add_calibrate_command(CLI::App& app, Context& context);
void add_selftest_command(CLI::App& app, Context& context);
void add_bring_up_command(CLI::App& app, Context& context);
void add_wall_command(CLI::App& app, Context& context);
void add_check_command(CLI::App& app, Context& context);
void add_simulate_command(CLI::App& app, Context& context);
void add_sweep_command(CLI::App& app, Context& context);
void add_experiment_command(CLI::App& app, Context& context);
void add_design_command(CLI::App& app, Context& context);
void add_plot_command(CLI::App& app, Context& context);
void add_lines_commands(CLI::App& app, Context& context);  // lines, reset, bootloader
void add_flash_command(CLI::App& app, Context& context);
void add_serve_command(CLI::App& app, Context& context);
void add_describe_command(CLI::App& app, Context& context);

void add_completion_commands(CLI::App& app, Context& context);  // completion, manual

void add_all_commands(CLI::App& app, Context& context) {
  struct Group {
    const char* title;
    std::vector<void (*)(CLI::App&, Context&)> add;
  };
  const Group groups[] = {
      {"Device", {add_devices_command, add_info_command, add_drive_commands, add_faults_command}},
      {"Parameters",
       {add_parameter_commands, add_parameter_file_commands, add_store_commands, add_lock_commands}},
      {"Looking and recording",
       {add_view_command, add_watch_command, add_record_command, add_capture_command, add_plot_command}},
      {"Commissioning", {add_bring_up_command, add_calibrate_command, add_selftest_command}},
      {"Walls and experiments",
       {add_wall_command, add_check_command, add_simulate_command, add_sweep_command, add_experiment_command,
        add_design_command, add_serve_command}},
      {"Board", {add_lines_commands, add_flash_command}},
      {"Documents", {add_describe_command, add_completion_commands}},
  };
  for (const Group& group : groups) {
    const std::size_t before = app.get_subcommands({}).size();
    for (const auto add : group.add) add(app, context);
    const auto commands = app.get_subcommands({});
    for (std::size_t i = before; i < commands.size(); ++i) commands[i]->group(group.title);
  }
}

CLI::Validator plain_number() {
  return CLI::Validator(
      [](const std::string& text) {
        return base::is_plain_number(text) ? std::string()
                                           : fmt::format("'{}' is not a plain number such as 0 or 12", text);
      },
      "");
}

CLI::Option* add_axis_option(CLI::App& command, Context& context, const char* help) {
  return command.add_option("--axis", context.axis_option, help)
      ->type_name("N")
      ->check(plain_number())
      ->check(CLI::Range(0, static_cast<int>(firmware::axis_count) - 1));
}

CLI::Validator within(double least, double most) {
  const auto finite = [](const std::string& text) {
    double number = 0.0;
    const bool good = CLI::detail::lexical_cast(text, number) && std::isfinite(number);
    return good ? std::string() : fmt::format("'{}' is not a number", text);
  };
  return CLI::Validator(finite, "NUMBER") & CLI::Range(least, most);
}

void add_device_option(CLI::App& command, Context& context) {
  command
      .add_option("--device", context.device_option,
                  "sim, usb[:SERIAL], serial:PATH[?unit=1&baud=115200] or can:IFACE[?node=1]; else "
                  "KMAX_DEVICE, the settings file, or sim")
      ->type_name("ADDRESS")
      ->check(CLI::Validator(
          [](const std::string& text) {
            return text.empty() ? "the address is empty; name a device, or leave --device out"
                                : std::string();
          },
          ""));
}

CLI::App* add_command(CLI::App& app, Context& context, const CommandText& text, Takes takes) {
  CLI::App* command = app.add_subcommand(text.name, text.summary);
  command->group("Commands");
  command->set_help_flag("-h,--help", "This text");
  command->add_flag("--json", context.json, "One JSON document on standard output, in SI units");
  if (takes == Takes::device || takes == Takes::device_and_axis) add_device_option(*command, context);
  if (takes == Takes::axis || takes == Takes::device_and_axis)
    add_axis_option(*command, context, "Axis that names without a prefix are on");
  const std::string examples = *text.examples == '\0' ? "" : fmt::format("Examples:\n{}\n\n", text.examples);
  command->footer(examples + base::exit_code_text);
  return command;
}

void add_command(CLI::App& app, Context& context, const CommandText& text, Takes takes,
                 int (*run)(Context&)) {
  add_command(app, context, text, takes)->callback([&context, run] {
    context.action = [&context, run] { return run(context); };
  });
}

}  // namespace kmax::cli
