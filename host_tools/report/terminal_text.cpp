#include "host_tools/report/page.hpp"

#include <algorithm>
#include <regex>

#include "host_tools/base/terminal_text.hpp"

namespace kmax::report {

using base::display_width;
using base::lines_of;
using base::printable;
using base::wrapped;

namespace {
void add_line(std::string& text, std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  text += line + '\n';
}

std::size_t widest_word(std::string_view text) {
  std::size_t widest = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    widest = std::max(widest, display_width(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return widest;
}

std::size_t sum_of(const std::vector<std::size_t>& widths) {
  std::size_t sum = widths.empty() ? 0 : 2 * (widths.size() - 1);
  for (const std::size_t width : widths) sum += width;
  return sum;
}
}  // namespace

std::string terminal_text(const Table& table, std::size_t width) {
  const std::vector<bool> right = number_columns(table);
  std::string text;
  if (!table.caption.empty()) add_line(text, wrapped(printable(table.caption), width));
  if (table.columns.empty()) return text;

  std::vector<std::vector<std::string>> rows{table.columns};
  rows.insert(rows.end(), table.rows.begin(), table.rows.end());
  std::vector<std::size_t> widths(table.columns.size(), 0), least(table.columns.size(), 0);
  for (std::size_t number = 0; number < rows.size(); ++number) {
    for (std::size_t i = 0; i < widths.size(); ++i) {
      std::string& cell = rows[number][i];
      cell = printable(cell);
      const std::size_t whole = display_width(cell);
      widths[i] = std::max(widths[i], whole);
      least[i] = std::max(least[i], number > 0 && right[i] ? whole : widest_word(cell));
    }
  }
  // The widest gives way first, as most words are there; the first column, what a row is about, last.
  while (width > 0 && sum_of(widths) > width) {
    std::size_t widest = 0;
    for (std::size_t i = 1; i < widths.size(); ++i) {
      if (widths[i] > least[i] && (widest == 0 || widths[i] > widths[widest])) widest = i;
    }
    if (widths[widest] <= least[widest]) break;
    --widths[widest];
  }
  for (std::size_t number = 0; number < rows.size(); ++number) {
    std::vector<std::vector<std::string>> cells;
    std::size_t height = 1;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      const bool fits = display_width(rows[number][i]) <= widths[i];
      cells.push_back(fits ? std::vector{rows[number][i]} : lines_of(rows[number][i], widths[i]));
      height = std::max(height, cells.back().size());
    }
    std::string rule;
    for (std::size_t line = 0; line < height; ++line) {
      std::string written;
      for (std::size_t i = 0; i < widths.size(); ++i) {
        // Headings stand on their rule.
        const std::size_t above = number == 0 ? height - cells[i].size() : 0;
        const bool there = line >= above && line - above < cells[i].size();
        const std::string part = there ? cells[i][line - above] : "";
        const std::string gap(i == 0 ? 0 : 2, ' ');
        const std::string padding(widths[i] - display_width(part), ' ');
        written += gap + (right[i] ? padding + part : part + padding);
        if (line == 0) rule += gap + std::string(widths[i], '-');
      }
      add_line(text, written);
    }
    if (number == 0) add_line(text, rule);
  }
  return text;
}

bool reads_as_number(std::string_view text) {
  // Perhaps "at least"; the number; a unit, which has no digit in front and no words, or a spread.
  static const std::regex number(R"([<>= ]*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?(?: (.+))?)");
  std::cmatch match;
  if (!std::regex_match(text.data(), text.data() + text.size(), match, number)) return false;
  const std::string unit = match[3];
  if (unit.size() > 2 && unit.front() == '(' && unit.back() == ')')
    return reads_as_number(std::string_view(unit).substr(1, unit.size() - 2));
  static const std::regex no_unit(R"([-+(\d].*|(of|to|or|and|x)( .*)?)");
  return unit.size() <= 8 && !std::regex_match(unit, no_unit);
}

std::vector<bool> number_columns(const Table& table) {
  require_rectangular(table);
  std::vector<bool> numbers(table.columns.size(), false);
  for (std::size_t column = 0; column < numbers.size(); ++column) {
    bool any = false, other = false;
    for (const auto& row : table.rows) {
      const std::string& cell = row[column];
      if (cell.empty() || cell == "-" || cell == "NA") continue;
      (reads_as_number(cell) ? any : other) = true;
    }
    numbers[column] = any && !other;
  }
  return numbers;
}

}  // namespace kmax::report
