#include "host_tools/kmax/parameters/parameter_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "host_tools/base/numbers.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::cli {

namespace {
constexpr std::size_t range_width_max = 24;
constexpr std::size_t help_width_min = 24;
constexpr std::size_t help_indent = 4;
/// Narrower terminals have no room for a column of defaults beside one of help.
constexpr std::size_t width_for_defaults = 120;

struct Cells {
  std::string name, value, unit, range, default_value, help;
};

std::string range_text(const firmware::Entry& entry) {
  if (entry.access == firmware::Access::read_only) return "read only";
  if (entry.access == firmware::Access::communication) return "set over CANopen";
  if (!entry.values.empty()) {
    std::vector<std::string_view> names;
    for (const auto& value : entry.values) names.push_back(value.name);
    return fmt::format("{}", fmt::join(names, "|"));
  }
  if (entry.type != firmware::Type::float32)
    return fmt::format("{:.0f} .. {:.0f}", entry.minimum, entry.maximum);
  return fmt::format("{} .. {}", base::number_text(entry.minimum), base::number_text(entry.maximum));
}

Cells cells_of(const ParameterRow& row) {
  const auto& entry = row.parameter.definition();
  const bool changed = row.parameter.writable() && entry.persistent &&
                       !same_value(row.parameter, row.raw, row.parameter.default_raw());
  return {row.parameter.name(),
          (changed ? "*" : "") + value_text(row.parameter, row.raw),
          std::string(entry.unit),
          range_text(entry),
          row.parameter.writable() ? value_text(row.parameter, row.parameter.default_raw()) : "",
          std::string(entry.help)};
}

std::string cut(const std::string& text, std::size_t length) {
  if (text.size() <= length) return text;
  return length < 4 ? std::string() : text.substr(0, length - 3) + "...";
}

void print_indented(std::ostream& out, std::string_view text, std::size_t width) {
  base::print(out, "{:{}}{}\n", "", help_indent, base::wrapped(text, width - help_indent, help_indent));
}
}  // namespace

void print_parameter_table(std::ostream& out, std::span<const ParameterRow> rows,
                           std::optional<base::TerminalSize> terminal, bool whole_texts) {
  constexpr std::size_t unlimited = std::numeric_limits<std::size_t>::max();
  const std::size_t width = terminal      ? std::max<std::size_t>(terminal->columns, 60)
                            : whole_texts ? 100
                                          : unlimited;
  const bool shows_defaults = width >= width_for_defaults;
  std::vector<Cells> table{{"name", "value", "unit", "range", shows_defaults ? "default" : "", "help"}};
  for (const ParameterRow& row : rows) table.push_back(cells_of(row));

  const auto widest = [&table](std::string Cells::*cell) {
    std::size_t most = 0;
    for (const Cells& cells : table) most = std::max(most, (cells.*cell).size());
    return most;
  };
  const std::size_t name = widest(&Cells::name), value = widest(&Cells::value), unit = widest(&Cells::unit);
  const std::size_t before_range = name + value + unit + 6;
  const std::size_t room = width == unlimited ? unlimited : width - std::min(width, before_range);
  // A few letters of help say nothing: then ranges have the room.
  const bool shows_help = !whole_texts && room >= range_width_max + help_width_min;
  const std::size_t range = std::min({widest(&Cells::range), shows_help ? range_width_max : unlimited, room});
  if (!shows_help) table.front().help.clear();

  for (const Cells& cells : table) {
    std::string line =
        fmt::format("{:<{}}  {:>{}}  {:<{}}  {:<{}}", cells.name, name, cells.value, value, cells.unit, unit,
                    width == unlimited ? cells.range : cut(cells.range, range), range);
    if (shows_defaults) line += fmt::format("  {:>{}}", cells.default_value, widest(&Cells::default_value));
    if (shows_help)
      line +=
          "  " + cut(cells.help, width == unlimited ? unlimited : width - std::min(width, line.size() + 2));
    line.erase(line.find_last_not_of(' ') + 1);
    base::print(out, "{}\n", cut(line, width));
    if (!whole_texts || &cells == &table.front()) continue;
    if (cells.range.size() > range) print_indented(out, cells.range, width);
    if (!shows_defaults && !cells.default_value.empty())
      print_indented(out, "default " + cells.default_value, width);
    print_indented(out, cells.help, width);
  }
}

}  // namespace kmax::cli
