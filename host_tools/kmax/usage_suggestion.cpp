#include "host_tools/kmax/usage_suggestion.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "host_tools/base/suggestion.hpp"

namespace kmax::cli {

using CLI::App;

namespace {
/// "--axis" of "--axis=0".
std::string option_name(const std::string& argument) {
  return argument.substr(0, argument.find('='));
}

bool is_long_option(const std::string& argument) {
  return argument.starts_with("--") && argument.size() > 2;
}

const App* command_named(const App& app, const std::string& name) {
  for (const App* command : app.get_subcommands({})) {
    if (command->get_name() == name) return command;
  }
  return nullptr;
}

/// Groups of options are nameless apps of their own.
void collect_options(const App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  for (const App* group : app.get_subcommands({})) {
    if (group->get_name().empty()) collect_options(*group, names);
  }
}

std::vector<std::string> options_of(const App& app) {
  std::vector<std::string> names;
  collect_options(app, names);
  return names;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The command that the arguments name, as deep as they go; `app` if none.
const App* command_in(const App& app, const std::vector<std::string>& arguments) {
  const App* command = &app;
  for (const std::string& argument : arguments) {
    if (const App* next = command_named(*command, argument)) command = next;
  }
  return command;
}

/// What stands between the braces of "--trigger: contct not in {now,contact}".
std::string choice_suggestion(std::string_view message) {
  constexpr std::string_view before = " not in {";
  const std::size_t list = message.find(before);
  const std::size_t end = message.rfind('}');
  const std::size_t colon = message.find(": ");
  if (list == std::string_view::npos || end == std::string_view::npos || colon >= list) return {};
  const std::string value(message.substr(colon + 2, list - colon - 2));
  std::vector<std::string> choices;
  for (std::size_t at = list + before.size(); at < end;) {
    const std::size_t comma = std::min(message.find(',', at), end);
    const std::string_view one = message.substr(at, comma - at);
    choices.emplace_back(one.substr(0, one.find("->")));  // of a choice that is translated
    at = comma + 1;
  }
  return base::did_you_mean(value, choices);
}
}  // namespace

std::string misplaced_option_text(const App& app, const std::vector<std::string>& arguments) {
  const std::vector<std::string> known = options_of(app);
  const App* command = command_in(app, arguments);
  if (command == &app) return {};
  for (const std::string& argument : arguments) {
    if (command_named(app, argument) != nullptr) return {};
    const std::string name = option_name(argument);
    if (!is_long_option(argument) || contains(known, name)) continue;
    if (!contains(options_of(*command), name)) return {};
    std::string path = command->get_name();
    for (const App* above = command->get_parent(); above != nullptr && above != &app;
         above = above->get_parent())
      path = above->get_name() + ' ' + path;
    return fmt::format("{0} stands behind its command: 'kmax {1} {0} ...'", name, path);
  }
  return {};
}

std::string unknown_option_text(const App& app, const std::vector<std::string>& arguments) {
  const std::vector<std::string> known = options_of(app);
  for (const std::string& argument : arguments) {
    const std::string name = option_name(argument);
    if (!is_long_option(argument) || contains(known, name)) continue;
    return fmt::format("there is no option '{}' before a command{}; 'kmax --help' names those there are",
                       name, base::did_you_mean(name, known));
  }
  return {};
}

std::string usage_suggestion(const App& app, const CLI::ParseError& error,
                             const std::vector<std::string>& arguments) {
  if (const std::string choice = choice_suggestion(error.what()); !choice.empty()) return choice;
  const std::vector<std::string> known = options_of(*command_in(app, arguments));
  for (const std::string& argument : arguments) {
    const std::string name = option_name(argument);
    if (is_long_option(argument) && !contains(known, name)) return base::did_you_mean(name, known);
  }
  return {};
}

}  // namespace kmax::cli
