#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <set>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/base/suggestion.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/device/settings_file.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/completion.hpp"
#include "host_tools/kmax/context.hpp"
#include "host_tools/kmax/help_text.hpp"
#include "host_tools/kmax/supplied_files.hpp"
#include "host_tools/kmax/usage_suggestion.hpp"
#include "host_tools/plot/csv_table.hpp"
#include "host_tools/plot/gnuplot_picture.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::cli {

namespace {
int report_error(Context& context, const std::string& message, base::ExitCode code) {
  context.note(message);
  if (context.json) context.print({{"error", message}});
  return code;
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

/// The first argument that stands where a command's name should; empty if there is none.
std::string word_for_command(const std::vector<std::string>& arguments) {
  static const std::set<std::string> with_value = {"--device"};
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (with_value.contains(arguments[i])) {
      ++i;
    } else if (!arguments[i].starts_with('-')) {
      return arguments[i];
    }
  }
  return {};
}

/// The command that the arguments name, as deep as they were understood; the whole program if none was.
const CLI::App& command_meant(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  return *command;
}

/// "experiment jitter".
std::string name_within(const CLI::App& app, const CLI::App& command) {
  const std::string path = command_path(command);
  return path.substr(std::min(path.size(), command_path(app).size() + 1));
}

std::string usage_message(const CLI::App& app, const CLI::ParseError& error,
                          const std::vector<std::string>& arguments) {
  if (const std::string misplaced = misplaced_option_text(app, arguments); !misplaced.empty())
    return misplaced;
  const auto names = command_names(app);
  const std::string word = word_for_command(arguments);
  if (word.empty()) {
    if (const std::string unknown = unknown_option_text(app, arguments); !unknown.empty()) return unknown;
    return fmt::format("a command is missing; commands are {}; 'kmax --help' explains them",
                       fmt::join(names, ", "));
  }
  if (std::find(names.begin(), names.end(), word) == names.end()) {
    const std::string meant = base::did_you_mean(word, names);
    return fmt::format("there is no command '{}'{}", word,
                       meant.empty() ? fmt::format("; commands are {}", fmt::join(names, ", ")) : meant);
  }
  const CLI::App& meant = command_meant(app);
  const std::string command = &meant == &app ? word : name_within(app, meant);
  if (const auto inner = command_names(meant);
      !inner.empty() && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr)
    return fmt::format("{}: name one of {}; 'kmax {} --help' explains it", command, fmt::join(inner, ", "),
                       command);
  return fmt::format("{}: {}{}; 'kmax {} --help' explains it", command, error.what(),
                     usage_suggestion(app, error, arguments), command);
}

}  // namespace

int act(Context& context) {
  try {
    const int code = context.action();
    context.out.flush();
    if (!context.out) {
      context.note("the output could not be written; is the disk full or the pipe closed?");
      return base::failed;
    }
    return code;
  } catch (const UsageError& error) {
    return report_error(context, error.what(), base::wrong_usage);
  } catch (const base::ValueError& error) {
    return report_error(context, error.what(), base::wrong_usage);
  } catch (const device::AddressError& error) {
    return report_error(context, error.what(), base::wrong_usage);
  } catch (const simulation::SceneError& error) {
    return report_error(context, error.what(), base::wrong_usage);
  } catch (const plot::CsvError& error) {
    return report_error(context, error.what(), base::wrong_usage);
  } catch (const plot::PictureNameError& error) {
    return report_error(context, error.what(), base::wrong_usage);
  } catch (const std::exception& error) {
    return report_error(context, error.what(), base::failed);
  }
}

void declare(CLI::App& app, Context& context) {
  app.name("kmax");
  app.description(
      "Sets parameters of a Kmax haptic device, reads its state, renders virtual walls and measures them.");
  app.formatter(std::make_shared<HelpFormatter>(context.columns()));
  app.set_help_flag("-h,--help", "This text");
  app.set_version_flag("--version", version_text,
                       "The version of this program, and the image that comes with it");
  app.add_flag("--json", context.json, "One JSON document on standard output, in SI units");
  add_device_option(app, context);
  app.require_subcommand(1);
  app.footer(std::string("'kmax COMMAND --help' explains a command and shows examples.\n\n") +
             base::exit_code_text);
  add_all_commands(app, context);
}

std::optional<int> parse(CLI::App& app, const std::vector<std::string>& arguments, Context& context) {
  declare(app, context);

  // Known before parsing can fail, so that an error is a document too.
  const bool wants_json = std::find(arguments.begin(), arguments.end(), "--json") != arguments.end();
  try {
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
    app.parse(reversed);
  } catch (const CLI::Success& request) {  // --help, --version
    app.exit(request, context.out, context.out);
    return base::done;
  } catch (const CLI::ParseError& error) {
    context.json = wants_json;
    return report_error(context, usage_message(app, error, arguments), base::wrong_usage);
  }
  return std::nullopt;
}

int run(const std::vector<std::string>& arguments, Context& context) {
  CLI::App app;
  if (!arguments.empty() && arguments.front() == "complete") {  // asked by the scripts of 'kmax completion'
    declare(app, context);
    const auto first = arguments.begin() + (arguments.size() > 1 && arguments[1] == "--" ? 2 : 1);
    for (const std::string& candidate : completions(app, {first, arguments.end()}))
      context.out << candidate << '\n';
    return base::done;
  }
  const std::optional<int> ended = parse(app, arguments, context);
  if (ended && *ended != base::done) return *ended;
  // A text that was asked for is an output like any other: it can meet a full disk.
  if (ended) context.action = [] { return base::done; };
  return act(context);
}

std::optional<std::string> Context::named_device() const {
  return device_option.empty() ? device::default_device_address() : device_option;
}

std::vector<std::size_t> Context::axes() const {
  if (axis_option) return {*axis_option};
  std::vector<std::size_t> all;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) all.push_back(axis);
  return all;
}

std::unique_ptr<device::Link> Context::open_link() {
  return opener_(device_address(), [this](const std::string& text) { note(text); });
}

device::Device Context::connect() {
  const device::Notice notice = [this](const std::string& text) { note(text); };
  auto opened = open_link();
  if (!named_device())
    note(
        "sim: a fresh simulated device that lives only for this command; --device serial:PATH or KMAX_DEVICE "
        "names a lasting one");
  return device::Device(std::move(opened), notice);
}

device::Device Context::connect_to_change() {
  if (!named_device())
    throw UsageError(fmt::format(
        "this changes a device, and none is named: give --device serial:PATH, can:IFACE or usb, set "
        "KMAX_DEVICE, or write device = \"serial:PATH\" into {}; 'kmax devices' shows what can be reached. "
        "'kmax serve --serial /tmp/kmax' is a simulated one that lasts, --device sim one that is gone when "
        "the command ends",
        device::settings_file().string()));
  return connect();
}

std::size_t Context::width() const {
  if (fixed_width) return *fixed_width;
  const auto terminal = base::terminal_behind(out);
  return terminal ? std::max<std::size_t>(terminal->columns, 40) : 0;
}

void Context::say(const std::string& text, std::size_t indent) {
  out << (width() == 0 ? text : base::wrapped(text, columns() - indent, indent)) << '\n';
}

void Context::note(const std::string& text) {
  base::Progress::make_room_on_terminal();
  const auto terminal = base::terminal_behind(messages_);
  messages_ << (terminal ? base::wrapped("kmax: " + text, terminal->columns - 3, 2) : "kmax: " + text)
            << std::endl;
}

}  // namespace kmax::cli
