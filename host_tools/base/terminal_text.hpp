#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kmax::base {

struct TerminalSize {
  std::size_t columns = 80, rows = 24;
};

/// Of the terminal behind an open file; nothing: that is a file, a pipe, or closed. A terminal that does not
/// know its size is taken to have 80 columns and 24 rows.
std::optional<TerminalSize> terminal_size(int descriptor);

/// Of the terminal on standard output if `out` is standard output.
std::optional<TerminalSize> terminal_behind(const std::ostream& out);

/// Columns that a terminal of UTF-8 needs for `text`: accents that join the letter before them none,
/// characters of East Asian width two (Unicode Standard Annex 11), all others one, each byte that is no UTF-8
/// one too. Characters of one of these widths only in some newer version of Unicode count as one.
std::size_t display_width(std::string_view text);

/// `text` with a space in the place of every control character: a line's end, an escape sequence.
std::string printable(std::string_view text);

/// As much of the beginning of `text` as `width` columns hold, in whole characters.
std::string_view beginning(std::string_view text, std::size_t width);

/// `text` in lines of at most `width` columns, broken at spaces and at its own line breaks. A longer word is
/// broken where the line ends; a character that is wider has a line of its own. At least one line.
std::vector<std::string> lines_of(std::string_view text, std::size_t width);

/// The same as one text, with `indent` spaces before every line but the first. `width` is that of the text,
/// without them; 0: as it is.
std::string wrapped(std::string_view text, std::size_t width, std::size_t indent = 0);

}  // namespace kmax::base
