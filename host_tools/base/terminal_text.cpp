#include "host_tools/base/terminal_text.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iostream>

namespace kmax::base {

std::optional<TerminalSize> terminal_size(int descriptor) {
  if (isatty(descriptor) != 1) return std::nullopt;
  TerminalSize size;
  winsize window{};
  if (ioctl(descriptor, TIOCGWINSZ, &window) != 0) return size;
  if (window.ws_col > 0) size.columns = window.ws_col;
  if (window.ws_row > 0) size.rows = window.ws_row;
  return size;
}

std::optional<TerminalSize> terminal_behind(const std::ostream& out) {
  if (&out == &std::cout) return terminal_size(STDOUT_FILENO);
  if (&out == &std::cerr) return terminal_size(STDERR_FILENO);
  return std::nullopt;
}

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

std::size_t columns_of(std::uint32_t character) {
  if (in_any(without_width, character)) return 0;
  return in_any(twice_as_wide, character) ? 2 : 1;
}
}  // namespace

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

std::size_t display_width(std::string_view text) {
  std::size_t width = 0;
  for (std::size_t at = 0; at < text.size();) width += columns_of(take_character(text, at));
  return width;
}

std::string_view beginning(std::string_view text, std::size_t width) {
  std::size_t end = 0;
  for (std::size_t at = 0, used = 0; at < text.size(); end = at) {
    used += columns_of(take_character(text, at));
    if (used > width) break;
  }
  return text.substr(0, end);
}

std::vector<std::string> lines_of(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  do {
    const std::string_view line = text.substr(0, text.find('\n'));
    std::size_t end = beginning(line, width).size();
    if (end < line.size()) {
      const std::size_t space = line.rfind(' ', end);
      if (space != std::string_view::npos && space > 0) end = space;
      if (end == 0) take_character(line, end);  // wider than a line
    }
    lines.emplace_back(text.substr(0, end));
    // What a line ends with does not begin the next one.
    if (end < text.size() && (text[end] == ' ' || text[end] == '\n')) ++end;
    text.remove_prefix(end);
  } while (!text.empty());
  return lines;
}

std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  if (width == 0) return std::string(text);
  return fmt::format("{}", fmt::join(lines_of(text, width), "\n" + std::string(indent, ' ')));
}

}  // namespace kmax::base
