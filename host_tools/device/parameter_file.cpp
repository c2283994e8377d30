#include "host_tools/device/parameter_file.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <tuple>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/suggestion.hpp"
#include "host_tools/base/toml_text.hpp"

namespace kmax::device {

namespace {
constexpr std::size_t shown_problems_max = 10;

std::string group_of(const Parameter& parameter) {
  const std::string name = parameter.name();
  return name.substr(0, name.rfind('.'));
}

/// A choice whose name is a number (wall.side, modbus.baud_rate) is that number.
bool is_whole_number(std::string_view text) {
  if (text.starts_with('+') || text.starts_with('-')) text.remove_prefix(1);
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

std::string toml_value(const Assignment& assignment) {
  const std::string text = value_text(assignment.parameter, assignment.raw);
  const bool named = !assignment.parameter.definition().values.empty() && !is_whole_number(text);
  return named ? fmt::format("\"{}\"", text) : text;
}

std::string remark_on(const Parameter& parameter) {
  const auto& entry = parameter.definition();
  if (entry.values.empty()) return std::string(entry.unit);
  const std::string choices = allowed_text(parameter);
  return entry.unit.empty() ? choices : fmt::format("{}: {}", entry.unit, choices);
}

/// A device's own texts may have characters that TOML forbids in a comment.
std::string in_comment(std::string text) {
  for (char& letter : text) {
    if (letter < ' ' || letter > '~') letter = '?';
  }
  return text;
}

const std::vector<std::string>& groups() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
      all.push_back(fmt::format("axis{}", axis));
    for (const Parameter& parameter : all_parameters()) {
      std::string group = group_of(parameter);
      if (std::find(all.begin(), all.end(), group) != all.end()) continue;
      if (parameter.belongs_to_axis() && parameter.axis() == 0) all.push_back("axis0." + group);
      all.push_back(std::move(group));
    }
    return all;
  }();
  return names;
}

constexpr std::string_view dump_begin =
    "# Parameters of a Kmax device; 'kmax load FILE' sets them, 'kmax diff FILE' compares.\n";
/// Whoever edits a dump may change all but these two lines.
constexpr std::string_view dump_end = "# End of the parameters.\n";

class FileReader {
 public:
  explicit FileReader(const std::string& source) : source_(source) {}

  std::vector<FileSetting> read(std::string_view text) {
    refuse_cut_off(text);
    const toml::table root = base::parsed_toml<base::ValueError>(text, source_);
    read_table(root, "");
    std::sort(settings_.begin(), settings_.end(),
              [](const Placed& a, const Placed& b) { return a.place < b.place; });
    refuse_repeated();
    if (!problems_.empty()) throw base::ValueError(all_messages());
    if (settings_.empty())
      throw base::ValueError(fmt::format(
          "{}: it has no parameters; 'kmax dump FILE' writes a file that shows how they are written",
          source_));
    std::vector<FileSetting> found;
    for (const Placed& one : settings_) found.push_back({one.assignment, one.place.line});
    return found;
  }

 private:
  struct Place {
    std::size_t line, column;
    friend auto operator<=>(const Place&, const Place&) = default;
  };
  struct Placed {
    Place place;
    Assignment assignment;
  };
  struct Problem {
    Place place;
    std::string what;
  };

  /// A file that begins as a dump does and lacks a dump's end has lost what was in between.
  void refuse_cut_off(std::string_view text) const {
    if (!text.starts_with(dump_begin.substr(0, dump_begin.size() - 1))) return;
    if (text.find(dump_end.substr(0, dump_end.size() - 1)) != std::string_view::npos) return;
    throw base::ValueError(fmt::format(
        "{}: it was cut off: it begins as a file of 'kmax dump', and the last line of one, '{}', is missing; "
        "dump it again, or take away its first line if this is all that you want",
        source_, dump_end.substr(0, dump_end.size() - 1)));
  }

  static Place place_of(const toml::source_region& where) { return {where.begin.line, where.begin.column}; }

  void read_table(const toml::table& table, const std::string& prefix) {
    for (const auto& [key, node] : table) {
      const std::string name = prefix + std::string(key.str());
      const Place place = place_of(key.source());
      try {
        if (const toml::table* inner = node.as_table()) {
          if (inner->empty()) check_group(name);
          read_table(*inner, name + ".");
        } else {
          settings_.push_back({place, assignment_of(name, node)});
        }
      } catch (const base::ValueError& error) {
        problems_.push_back({place, error.what()});
      }
    }
  }

  static void check_group(const std::string& name) {
    if (std::find(groups().begin(), groups().end(), name) != groups().end()) return;
    throw base::ValueError(
        fmt::format("there is no group of parameters '{}'{}", name, base::did_you_mean(name, groups())));
  }

  static std::string text_of(const Parameter& parameter, const toml::node& node) {
    if (const auto* truth = node.as_boolean()) return truth->get() ? "true" : "false";
    if (const auto* whole = node.as_integer()) return fmt::format("{}", whole->get());
    if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
    if (const auto* text = node.as_string()) return text->get();
    throw base::ValueError(fmt::format("{}: a {} is not a value; allowed is {}", parameter.name(),
                                       node.is_array() ? "list" : "date or time", allowed_text(parameter)));
  }

  static Assignment assignment_of(const std::string& name, const toml::node& node) {
    const Parameter parameter = resolve(name);
    const Assignment assignment = parse_assignments({name + "=" + text_of(parameter, node)}).front();
    if (!parameter.definition().persistent)
      throw base::ValueError(
          fmt::format("{}: 'kmax save' does not keep it, so it has no place in a file of parameters; set it "
                      "with 'kmax set'",
                      parameter.name()));
    return assignment;
  }

  void refuse_repeated() {
    for (auto one = settings_.begin(); one != settings_.end(); ++one) {
      const auto earlier = std::find_if(settings_.begin(), one, [one](const Placed& other) {
        return other.assignment.parameter == one->assignment.parameter;
      });
      if (earlier != one)
        problems_.push_back(
            {one->place, fmt::format("{}: it is given twice, before in line {}; remove one of them",
                                     one->assignment.parameter.name(), earlier->place.line)});
    }
  }

  std::string message(const Problem& problem) const {
    return fmt::format("{}:{}:{}: {}", source_, problem.place.line, problem.place.column, problem.what);
  }

  std::string all_messages() {
    std::sort(problems_.begin(), problems_.end(),
              [](const Problem& a, const Problem& b) { return a.place < b.place; });
    std::string text;
    for (std::size_t i = 0; i < std::min(problems_.size(), shown_problems_max); ++i)
      text += (i == 0 ? "" : "\n") + message(problems_[i]);
    if (problems_.size() > shown_problems_max)
      text += fmt::format("\nand {} more", problems_.size() - shown_problems_max);
    return text;
  }

  std::string source_;
  std::vector<Placed> settings_;
  std::vector<Problem> problems_;
};
}  // namespace

std::vector<Parameter> file_parameters() {
  std::vector<Parameter> chosen;
  for (const Parameter& parameter : all_parameters()) {
    if (parameter.definition().persistent && parameter.writable()) chosen.push_back(parameter);
  }
  return chosen;
}

std::string parameter_file_text(const FileOrigin& origin, std::span<const Assignment> assignments) {
  std::string text(dump_begin);
  text +=
      fmt::format("# device: {}\n# firmware {}\n", in_comment(origin.device), in_comment(origin.firmware));
  text += "# What is left out here stays as it is on the device. CANopen's own settings are never in here.\n";

  std::vector<std::string> order;
  for (const Assignment& one : assignments) {
    const std::string group = group_of(one.parameter);
    if (std::find(order.begin(), order.end(), group) == order.end()) order.push_back(group);
  }
  for (const std::string& group : order) {
    text += fmt::format("\n[{}]\n", group);
    for (const Assignment& one : assignments) {
      if (group_of(one.parameter) != group) continue;
      const std::string remark = remark_on(one.parameter);
      text += fmt::format("{} = {}{}\n", one.parameter.name().substr(group.size() + 1), toml_value(one),
                          remark.empty() ? "" : "  # " + remark);
    }
  }
  return text + "\n" + std::string(dump_end);
}

std::vector<FileSetting> parse_parameter_file(std::string_view text, const std::string& source) {
  return FileReader(source).read(text);
}

std::vector<FileSetting> read_parameter_file(const std::string& path) {
  return parse_parameter_file(
      base::text_of<base::ValueError>(
          path, "give the path of a file of parameters (TOML), as 'kmax dump FILE' writes it"),
      path);
}

}  // namespace kmax::device
