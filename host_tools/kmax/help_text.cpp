#include "host_tools/kmax/help_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <regex>

#include "host_tools/base/terminal_text.hpp"

namespace kmax::cli {

namespace {
constexpr std::size_t term_indent = 2, term_width = 24;

/// CLI11 names a type and puts the validators' descriptions behind it: "FLOAT:(NUMBER) AND (FLOAT in [0 -
/// 5])".
std::string bounds_of(const std::string& type) {
  static const std::regex range(R"(in \[([^ ]+) - ([^\]]+)\])"), choices(R"(\{([^}]*)\})");
  std::smatch found;
  if (std::regex_search(type, found, range)) return fmt::format("{} .. {}", found.str(1), found.str(2));
  if (std::regex_search(type, found, choices)) return std::regex_replace(found.str(1), std::regex(","), ", ");
  return {};
}

bool says(const std::string& text, const std::string& bounds) {
  return text.find(bounds) != std::string::npos;
}

std::string capitals(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

/// CLI11 keeps groups of options among the commands, without a name.
std::vector<const CLI::App*> option_groups_of(const CLI::App& app) {
  std::vector<const CLI::App*> found;
  for (const CLI::App* one : app.get_subcommands({})) {
    if (one->get_name().empty()) found.push_back(one);
  }
  return found;
}

std::string title_of(const CLI::App& option_group) {
  return fmt::format("{} ({})", option_group.get_group(), option_group.get_description());
}

std::vector<const CLI::Option*> options_of(const CLI::App& app, bool positional) {
  return app.get_options([positional](const CLI::Option* option) {
    return !option->get_group().empty() && option->get_positional() == positional;
  });
}

std::string usage(const CLI::App& app) {
  std::string text = command_path(app);
  if (!commands_of(app).empty()) text += app.get_require_subcommand_min() == 0 ? " [COMMAND]" : " COMMAND";
  if (!options_of(app, false).empty()) text += " [OPTIONS]";
  for (const CLI::Option* option : options_of(app, true)) {
    const std::string term = text_of(*option).term;
    text += option->get_required() ? " " + term : fmt::format(" [{}]", term);
  }
  return text;
}

std::vector<std::pair<std::string, std::vector<const CLI::App*>>> commands_by_group(const CLI::App& app) {
  std::vector<std::pair<std::string, std::vector<const CLI::App*>>> groups;
  for (const CLI::App* command : commands_of(app)) {
    const std::string name = command->get_group();
    auto group =
        std::find_if(groups.begin(), groups.end(), [&](const auto& one) { return one.first == name; });
    if (group == groups.end()) group = groups.insert(groups.end(), {name, {}});
    group->second.push_back(command);
  }
  return groups;
}

void add_row(std::string& text, const std::string& term, const std::string& meaning, std::size_t width) {
  constexpr std::size_t column = term_indent + term_width;
  // A term that reaches into the meaning has a line of its own.
  const bool alone = term.size() + 2 > term_width;
  text += fmt::format("{:{}}{:<{}}{}", "", term_indent, term, alone ? 0 : term_width,
                      alone ? "\n" + std::string(column, ' ') : "");
  text += base::wrapped(meaning, width - column, column) + "\n";
}

void add_options(std::string& text, const CLI::App& app, bool positional, const std::string& title,
                 std::size_t width) {
  const auto options = options_of(app, positional);
  if (options.empty()) return;
  text += fmt::format("\n{}:\n", title);
  for (const CLI::Option* option : options) {
    const auto [term, meaning] = text_of(*option);
    add_row(text, term, meaning, width);
  }
}

/// Remarks are wrapped as paragraphs. What is indented, an example, keeps its line; where that is too long it
/// keeps its indent, and its comment moves up to it.
std::string footer_text(const std::string& footer, std::size_t width) {
  std::string text, paragraph;
  const auto end_paragraph = [&] {
    if (!paragraph.empty()) text += base::wrapped(paragraph, width, 0) + "\n";
    paragraph.clear();
  };
  for (const std::string& line : base::lines_of(footer, std::string::npos)) {
    const std::size_t indent = std::min(line.find_first_not_of(' '), line.size());
    if (indent == 0 && !line.empty()) {
      paragraph += (paragraph.empty() ? "" : " ") + line;
      continue;
    }
    end_paragraph();
    const std::string words = std::regex_replace(line.substr(indent), std::regex(" {2,}"), "  ");
    text += line.size() <= width
                ? line
                : line.substr(0, indent) + base::wrapped(words, width - indent - 2, indent + 2);
    text += '\n';
  }
  end_paragraph();
  return text;
}

std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      // A line that begins with a point or an apostrophe would be a request.
      if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
      out += c;
    }
  }
  return out;
}

std::string dashed(std::string path) {
  std::replace(path.begin(), path.end(), ' ', '-');
  return path;
}

void add_roff_options(std::string& page, const CLI::App& app, bool positional, const std::string& title) {
  const auto options = options_of(app, positional);
  if (options.empty()) return;
  page += fmt::format(".SH \"{}\"\n", roff(capitals(title)));
  for (const CLI::Option* option : options) {
    const auto [term, meaning] = text_of(*option);
    page += fmt::format(".TP\n.B {}\n{}\n", roff(term), roff(meaning));
  }
}
}  // namespace

std::string command_path(const CLI::App& app) {
  return app.get_parent() == nullptr ? app.get_name()
                                     : command_path(*app.get_parent()) + " " + app.get_name();
}

std::string value_name(const CLI::Option& option) {
  if (!option.get_option_text().empty()) return option.get_option_text();
  if (option.get_type_size() == 0) return {};
  const std::string type = option.get_type_name();
  const std::string name = type.substr(0, type.find(':'));
  if (name == "FLOAT") return "NUMBER";
  if (name == "INT" || name == "UINT") return "N";
  return name;
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  std::vector<const CLI::App*> found;
  for (const CLI::App* one : app.get_subcommands({})) {
    if (!one->get_name().empty() && !one->get_group().empty()) found.push_back(one);
  }
  return found;
}

std::vector<const CLI::Option*> all_options_of(const CLI::App& app) {
  const auto own = app.get_options();
  std::vector<const CLI::Option*> found(own.begin(), own.end());
  for (const CLI::App* group : option_groups_of(app)) {
    for (const CLI::Option* option : group->get_options()) found.push_back(option);
  }
  return found;
}

OptionText text_of(const CLI::Option& option) {
  std::string term = value_name(option);
  if (option.get_positional()) {
    if (option.get_option_text().empty()) term = capitals(option.get_name(true, false));
  } else {
    const std::string names = std::regex_replace(option.get_name(false, true), std::regex(","), ", ");
    term = term.empty() ? names : names + " " + term;
  }
  std::string meaning = option.get_description();
  std::vector<std::string> remarks;
  if (const std::string bounds = bounds_of(option.get_type_name()); !bounds.empty() && !says(meaning, bounds))
    remarks.push_back(bounds);
  if (const std::string value = option.get_default_str();
      !value.empty() && value != "\"\"" && !says(meaning, "default"))
    remarks.push_back("default " + value);
  if (!remarks.empty()) meaning += fmt::format(" ({})", fmt::join(remarks, "; "));
  return {term, meaning};
}

std::string help_text(const CLI::App& app, std::size_t width) {
  width = std::max<std::size_t>(width, 40);
  std::string text = base::wrapped(app.get_description(), width, 0) + "\n\n";
  text += "Usage: " + base::wrapped(usage(app), width - 9, 9) + "\n";
  add_options(text, app, true, "Arguments", width);
  for (const auto& [group, commands] : commands_by_group(app)) {
    text += fmt::format("\n{}:\n", group);
    for (const CLI::App* command : commands)
      add_row(text, command->get_name(), command->get_description(), width);
  }
  add_options(text, app, false, "Options", width);
  for (const CLI::App* group : option_groups_of(app))
    add_options(text, *group, false, title_of(*group), width);
  if (!app.get_footer().empty()) text += "\n" + footer_text(app.get_footer(), width);
  return text;
}

std::string manual_page(const CLI::App& app, const std::string& version) {
  const std::string path = command_path(app), name = dashed(path);
  std::string page =
      fmt::format(".TH {} 1 \"\" \"{}\" \"Kmax\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}\n", roff(name),
                  version, roff(name), roff(app.get_description()), roff(usage(app)));
  add_roff_options(page, app, true, "Arguments");
  for (const auto& [group, commands] : commands_by_group(app)) {
    page += fmt::format(".SH \"{}\"\n", roff(capitals(group)));
    for (const CLI::App* command : commands)
      page += fmt::format(".TP\n.BR {} (1)\n{}\n", roff(dashed(command_path(*command))),
                          roff(command->get_description()));
  }
  add_roff_options(page, app, false, "Options");
  for (const CLI::App* group : option_groups_of(app)) add_roff_options(page, *group, false, title_of(*group));
  if (!app.get_footer().empty()) page += fmt::format(".SH NOTES\n.nf\n{}\n.fi\n", roff(app.get_footer()));
  if (app.get_parent() != nullptr)
    page += ".SH \"SEE ALSO\"\n.BR " + roff(dashed(command_path(*app.get_parent()))) + " (1)\n";
  return page;
}

}  // namespace kmax::cli
