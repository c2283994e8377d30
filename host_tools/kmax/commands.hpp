#pragma once

#include <CLI/App.hpp>
#include <span>

#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

// One function per file of commands. To add a command: write X_command.cpp with
//
//   void add_x_command(CLI::App& app, Context& context) {
//     auto* command = add_command(app, context, {"x", "Does x.", "kmax x --fast    does it fast"});
//     auto options = std::make_shared<XOptions>();
//     command->add_option("--fast", options->fast, "...");
//     command->callback([&context, options] { context.action = [&context, options] { return run_x(context,
//     *options); }; });
//   }
//
// declare it here, and name it in commands.cpp and in host_tools/CMakeLists.txt. run_x() returns an
// ExitCode and reports errors by throwing: UsageError, device::ValueError and link::AddressError become exit
// code 2, every other exception 1; the message is shown, with --json as {"error": "..."}.
void add_parameter_commands(CLI::App& app, Context& context);  // list, get, set
void add_store_commands(CLI::App& app, Context& context);      // save, defaults
void add_info_command(CLI::App& app, Context& context);
void add_drive_commands(CLI::App& app, Context& context);  // state, arm, disarm, stop, clear
void add_capture_command(CLI::App& app, Context& context);
void add_record_command(CLI::App& app, Context& context);
void add_watch_command(CLI::App& app, Context& context);
void add_devices_command(CLI::App& app, Context& context);
void add_calibrate_command(CLI::App& app, Context& context);
void add_selftest_command(CLI::App& app, Context& context);
void add_wall_command(CLI::App& app, Context& context);
void add_check_command(CLI::App& app, Context& context);
void add_simulate_command(CLI::App& app, Context& context);
void add_experiment_command(CLI::App& app, Context& context);
void add_plot_command(CLI::App& app, Context& context);
void add_serve_command(CLI::App& app, Context& context);
void add_parameter_file_commands(CLI::App& app, Context& context);  ///< dump, load, diff
void add_lines_commands(CLI::App& app, Context& context);           ///< lines, reset, bootloader
void add_flash_command(CLI::App& app, Context& context);
void add_describe_command(CLI::App& app, Context& context);

/// All of them, in the order the help shows.
using AddCommand = void (*)(CLI::App&, Context&);
std::span<const AddCommand> all_commands();

struct CommandText {
  const char* name;
  const char* summary;   ///< one sentence
  const char* examples;  ///< lines, may be empty
};

/// --axis alone, for a command whose group of options it belongs to.
CLI::Option* add_axis_option(CLI::App& command, Context& context, const char* help);

/// What a command takes besides its own arguments.
enum class Takes { nothing, device, device_and_axis };

/// A subcommand with --json and, as `takes` says, --device and --axis; its help ends with the examples and
/// the exit codes.
CLI::App* add_command(CLI::App& app, Context& context, const CommandText& text,
                      Takes takes = Takes::device_and_axis);

}  // namespace kmax::cli
