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

std::string terminal_text(const Table& table) {
  const std::vector<bool> right = number_columns(table);
  std::string text;
  if (!table.caption.empty()) add_line(text, printable(table.caption));
  if (table.columns.empty()) return text;

  std::vector<std::vector<std::string>> lines{table.columns};
  lines.insert(lines.end(), table.rows.begin(), table.rows.end());
  std::vector<std::size_t> widths(table.columns.size(), 0);
  for (auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      line[i] = printable(line[i]);
      widths[i] = std::max(widths[i], display_width(line[i]));
    }
  }
  for (std::size_t number = 0; number < lines.size(); ++number) {
    std::string written, rule;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      const std::string gap(i == 0 ? 0 : 2, ' ');
      const std::string padding(widths[i] - display_width(lines[number][i]), ' ');
      written += gap + (right[i] ? padding + lines[number][i] : lines[number][i] + padding);
      rule += gap + std::string(widths[i], '-');
    }
    add_line(text, written);
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
