#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kmax::cli {

struct TerminalSize {
  std::size_t columns = 80, rows = 24;
};

/// Of the terminal behind an open file; nothing: that is a file, a pipe, or closed. A terminal that does not
/// know its size is taken to have 80 columns and 24 rows.
std::optional<TerminalSize> terminal_size(int descriptor);

/// Of the terminal on standard output if `out` is standard output.
std::optional<TerminalSize> terminal_behind(const std::ostream& out);

/// `text` in lines of at most `width` characters, broken at spaces and at its own line breaks. A longer word
/// is broken where the line ends. At least one line; `width` is at least 1.
std::vector<std::string> lines_of(std::string_view text, std::size_t width);

/// The same as one text, with `indent` spaces before every line but the first. `width` is that of the text,
/// without them.
std::string wrapped(std::string_view text, std::size_t width, std::size_t indent);

}  // namespace kmax::cli
