#include "host_tools/base/terminal_text.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

namespace kmax::cli {

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

std::vector<std::string> lines_of(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  do {
    const std::size_t line_break = std::min(text.find('\n'), text.size());
    std::size_t end = line_break;
    if (end > width) {
      end = text.rfind(' ', width);
      if (end == std::string_view::npos || end == 0) end = width;
    }
    lines.emplace_back(text.substr(0, end));
    // What a line ends with does not begin the next one.
    if (end < text.size() && (text[end] == ' ' || text[end] == '\n')) ++end;
    text.remove_prefix(end);
  } while (!text.empty());
  return lines;
}

std::string wrapped(std::string_view text, std::size_t width, std::size_t indent) {
  return fmt::format("{}", fmt::join(lines_of(text, width), "\n" + std::string(indent, ' ')));
}

}  // namespace kmax::cli
