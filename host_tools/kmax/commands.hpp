#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

// To add a command, write X_command.cpp in the folder of its kind and name it twice in commands.cpp:
//
//   struct XOptions {
//     bool fast = false;
//     void declare(CLI::App& command) { command.add_flag("--fast", fast, "Does it fast"); }
//   };
//
//   int run_x(Context& context, const XOptions& options) { ... }
//
//   void add_x_command(CLI::App& app, Context& context) {
//     add_command<XOptions>(app, context, {"x", "Does x.", "  kmax x --fast"}, Takes::device, run_x);
//   }
//
// Options that declare one of the context's own, such as --axis, take it as declare()'s second argument.
// run_x() returns an ExitCode and reports errors by throwing: UsageError, base::ValueError and
// device::AddressError become exit code 2, every other exception 1; the message is shown, with --json as
// {"error": "..."}.

/// All of them, in groups and in the order the help shows.
void add_all_commands(CLI::App& app, Context& context);

struct CommandText {
  const char* name;
  const char* summary;   ///< one sentence
  const char* examples;  ///< lines, may be empty
};

/// --axis alone, for a command whose group of options it belongs to.
CLI::Option* add_axis_option(CLI::App& command, Context& context, const char* help);
/// --device.
void add_device_option(CLI::App& command, Context& context);

/// A whole number in digits alone. The library that parses options reads 010 as 8, and 0x1 and +1 as 1.
CLI::Validator plain_number();

/// A finite number from `least` to `most`: CLI::Range alone lets a NaN pass.
CLI::Validator within(double least, double most);

/// A number from `least` to `most`, whose default the help shows.
template <typename Number>
CLI::Option* add_number(CLI::App& command, const char* name, Number& value, const char* help,
                        std::type_identity_t<Number> least, std::type_identity_t<Number> most) {
  CLI::Option* option = command.add_option(name, value, help);
  if constexpr (std::is_floating_point_v<Number>) {
    option->check(within(least, most));
  } else {
    option->check(CLI::Range(least, most));
  }
  return option->capture_default_str();
}

/// What a command takes besides its own arguments.
enum class Takes { nothing, axis, device, device_and_axis };

/// A subcommand with --json and, as `takes` says, --device and --axis; its help ends with the examples and
/// the exit codes.
CLI::App* add_command(CLI::App& app, Context& context, const CommandText& text,
                      Takes takes = Takes::device_and_axis);

/// One without arguments of its own.
void add_command(CLI::App& app, Context& context, const CommandText& text, Takes takes, int (*run)(Context&));

/// One whose arguments `Options` declares; `run` gets what was given.
template <typename Options>
CLI::App* add_command(CLI::App& app, Context& context, const CommandText& text, Takes takes,
                      int (*run)(Context&, const Options&)) {
  CLI::App* command = add_command(app, context, text, takes);
  const auto options = std::make_shared<Options>();
  if constexpr (requires { options->declare(*command, context); }) {
    options->declare(*command, context);
  } else {
    options->declare(*command);
  }
  command->callback([&context, command, options, run] {
    if (!command->get_subcommands().empty()) return;  // that one acts
    context.action = [&context, options, run] { return run(context, *options); };
  });
  return command;
}

/// The whole program behind main(): parses the arguments (without the program's name), runs the command,
/// turns what is thrown into a message and an exit code.
int run(const std::vector<std::string>& arguments, Context& context);

/// Commands and options, without anything parsed. `app`: a new one.
void declare(CLI::App& app, Context& context);

/// The halves of run(). parse() leaves in the context what is to be done, and touches nothing else; an exit
/// code: it was done (--help), or is wrong usage. `app`: a new one, whose options act() still reads.
std::optional<int> parse(CLI::App& app, const std::vector<std::string>& arguments, Context& context);
int act(Context& context);

}  // namespace kmax::cli
