#include "host_tools/report/page.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <regex>

namespace kmax::report {

namespace {
struct Range {
  std::uint32_t first, last;
};

template <std::size_t Count>
bool in_any(const std::array<Range, Count>& ranges, std::uint32_t character) {
  return std::any_of(ranges.begin(), ranges.end(),
                     [=](const Range& range) { return character >= range.first && character <= range.last; });
}

// General categories Mn, Me and Cf of the scripts that a unit or a name is likely to be written in.
constexpr std::array without_width = {Range{0x0300, 0x036F}, Range{0x0483, 0x0489}, Range{0x0591, 0x05BD},
                                      Range{0x0610, 0x061A}, Range{0x064B, 0x065F}, Range{0x093C, 0x093C},
                                      Range{0x0941, 0x0948}, Range{0x094D, 0x094D}, Range{0x0E31, 0x0E31},
                                      Range{0x0E34, 0x0E3A}, Range{0x0E47, 0x0E4E}, Range{0x1AB0, 0x1AFF},
                                      Range{0x1DC0, 0x1DFF}, Range{0x200B, 0x200F}, Range{0x202A, 0x202E},
                                      Range{0x2060, 0x2064}, Range{0x20D0, 0x20FF}, Range{0xFE00, 0xFE0F},
                                      Range{0xFE20, 0xFE2F}, Range{0xFEFF, 0xFEFF}, Range{0xE0100, 0xE01EF}};
// East_Asian_Width W and F.
constexpr std::array twice_as_wide = {
    Range{0x1100, 0x115F},   Range{0x231A, 0x231B},   Range{0x2E80, 0x303E},  Range{0x3041, 0xA4CF},
    Range{0xA960, 0xA97F},   Range{0xAC00, 0xD7A3},   Range{0xF900, 0xFAFF},  Range{0xFE10, 0xFE19},
    Range{0xFE30, 0xFE6F},   Range{0xFF00, 0xFF60},   Range{0xFFE0, 0xFFE6},  Range{0x1F300, 0x1F64F},
    Range{0x1F680, 0x1F6FF}, Range{0x1F900, 0x1F9FF}, Range{0x20000, 0x3FFFD}};

/// The character at `at`, which moves past it; a byte that begins none is a character by itself.
std::uint32_t take_character(std::string_view text, std::size_t& at) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(at);
  const std::size_t length = lead < 0x80           ? 1
                             : (lead >> 5) == 0x06 ? 2
                             : (lead >> 4) == 0x0E ? 3
                             : (lead >> 3) == 0x1E ? 4
                                                   : 0;
  constexpr std::uint32_t replacement = 0xFFFD;
  bool whole = length > 0 && at + length <= text.size();
  for (std::size_t i = 1; whole && i < length; ++i) whole = (byte(at + i) >> 6) == 2;
  if (!whole) {
    ++at;
    return replacement;
  }
  std::uint32_t character = length == 1 ? lead : lead & (0x7Fu >> length);
  for (std::size_t i = 1; i < length; ++i) character = (character << 6) | (byte(at + i) & 0x3Fu);
  at += length;
  return character;
}

/// What may be sent to a terminal.
std::string printable(std::string_view text) {
  std::string clean;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    const std::uint32_t character = take_character(text, at);
    const bool control = character < 0x20 || (character >= 0x7F && character < 0xA0);
    clean += control ? std::string_view(" ") : text.substr(begin, at - begin);
  }
  return clean;
}

void add_line(std::string& text, std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  text += line + '\n';
}
}  // namespace

std::size_t display_width(std::string_view text) {
  std::size_t width = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::uint32_t character = take_character(text, at);
    if (in_any(without_width, character)) continue;
    width += in_any(twice_as_wide, character) ? 2 : 1;
  }
  return width;
}

namespace {
std::vector<std::string> lines_of(std::string_view text, std::size_t width) {
  std::vector<std::string> lines(1);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = text.find_first_not_of(' ', at);
    if (begin == std::string_view::npos) break;
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::string word(text.substr(begin, end - begin));
    if (!lines.back().empty() && display_width(lines.back()) + 1 + display_width(word) > width)
      lines.emplace_back();
    lines.back() += lines.back().empty() ? word : ' ' + word;
    at = end;
  }
  return lines;
}

std::size_t widest_word(std::string_view text) {
  std::size_t widest = 0;
  for (const std::string& word : lines_of(text, 0)) widest = std::max(widest, display_width(word));
  return widest;
}

std::size_t sum_of(const std::vector<std::size_t>& widths) {
  std::size_t sum = widths.empty() ? 0 : 2 * (widths.size() - 1);
  for (const std::size_t width : widths) sum += width;
  return sum;
}
}  // namespace

std::string wrapped(std::string_view text, std::size_t width) {
  if (width == 0) return std::string(text);
  std::string result;
  for (const std::string& line : lines_of(text, width)) result += (result.empty() ? "" : "\n") + line;
  return result;
}

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
