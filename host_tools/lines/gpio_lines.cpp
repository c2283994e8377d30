#include "host_tools/lines/gpio_lines.hpp"

#include <fmt/format.h>

namespace kmax::lines {

std::string text_of(const LineSettings& settings) {
  if (settings.offset) return fmt::format("{} line {}", settings.chip, *settings.offset);
  if (settings.chip.empty()) return fmt::format("line \"{}\"", settings.name);
  return fmt::format("{} line \"{}\"", settings.chip, settings.name);
}

}  // namespace kmax::lines
