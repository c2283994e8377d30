#include "host_tools/kmax/parameters/parameter_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "host_tools/base/numbers.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::cli {

namespace {
constexpr std::size_t table_width = 120;
constexpr std::size_t range_width_max = 24;
constexpr std::size_t help_indent = 4;

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
  return fmt::format("{} .. {}", device::number_text(entry.minimum), device::number_text(entry.maximum));
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

void print_wrapped(std::ostream& out, std::string_view text) {
  while (!text.empty()) {
    std::size_t end = text.size();
    if (end > table_width - help_indent) {
      end = text.rfind(' ', table_width - help_indent);
      if (end == std::string_view::npos) end = table_width - help_indent;
    }
    print(out, "{:{}}{}\n", "", help_indent, text.substr(0, end));
    text.remove_prefix(std::min(text.size(), end + 1));
  }
}
}  // namespace

void print_parameter_table(std::ostream& out, std::span<const ParameterRow> rows, bool whole_texts) {
  std::vector<Cells> table{{"name", "value", "unit", "range", "default", "help"}};
  for (const ParameterRow& row : rows) table.push_back(cells_of(row));

  const auto widest = [&table](std::string Cells::*cell, std::size_t limit) {
    std::size_t most = 0;
    for (const Cells& cells : table) most = std::max(most, (cells.*cell).size());
    return std::min(most, limit);
  };
  const std::size_t name = widest(&Cells::name, table_width), value = widest(&Cells::value, table_width);
  const std::size_t unit = widest(&Cells::unit, table_width), range = widest(&Cells::range, range_width_max);
  const std::size_t default_value = widest(&Cells::default_value, table_width);
  const std::size_t used = name + value + unit + range + default_value + 10;
  const std::size_t help = used < table_width && !whole_texts ? table_width - used : 0;

  for (const Cells& cells : table) {
    std::string line = fmt::format("{:<{}}  {:>{}}  {:<{}}  {:<{}}  {:>{}}  {}", cells.name, name,
                                   cells.value, value, cells.unit, unit, cut(cells.range, range), range,
                                   cells.default_value, default_value, cut(cells.help, help));
    line.erase(line.find_last_not_of(' ') + 1);
    print(out, "{}\n", line);
    if (!whole_texts || &cells == &table.front()) continue;
    if (cells.range.size() > range) print_wrapped(out, cells.range);
    print_wrapped(out, cells.help);
  }
}

}  // namespace kmax::cli
