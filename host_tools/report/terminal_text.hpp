#pragma once

#include <string>
#include <string_view>

#include "host_tools/report/page.hpp"

namespace kmax::report {

/// Columns that a terminal of `text` needs for it: accents that join the letter before them none, characters
/// of East Asian width two (Unicode Standard Annex 11), all others one, each byte that is no UTF-8 one too.
/// Characters of one of these widths only in some newer version of Unicode count as one.
std::size_t display_width(std::string_view text);

/// The table in columns two spaces apart, numbers with a straight right edge (column_alignment.hpp), the
/// headings over a line, the caption before them. No space at the end of a line. A control character in a
/// cell (a line's end, an escape sequence) becomes a space. A table without columns is its caption alone.
std::string terminal_text(const Table& table);

}  // namespace kmax::report
