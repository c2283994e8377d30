#include "host_tools/kmax/recording/watch_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>

#include "firmware/parameters/refusal.hpp"
#include "host_tools/base/numbers.hpp"

namespace kmax::cli {

namespace {
constexpr std::size_t label_width = 10, column_width = 28;

std::string joined(const std::vector<std::string>& words) {
  return words.empty() ? "none" : fmt::format("{}", fmt::join(words, ", "));
}

/// Pieces of at most `width`, broken at spaces.
std::vector<std::string> wrapped(std::string text, std::size_t width) {
  std::vector<std::string> lines;
  while (text.size() > width) {
    std::size_t end = text.rfind(' ', width);
    if (end == std::string::npos || end == 0) end = width;
    lines.push_back(text.substr(0, end));
    text.erase(0, text.find_first_not_of(' ', end));
  }
  lines.push_back(std::move(text));
  return lines;
}

std::string in_column(const std::string& text) {
  return fmt::format("{:<{}}", text, column_width);
}
}  // namespace

std::string trouble_of(const WatchedAxis& axis) {
  const device::DriveStatus& status = axis.status;
  if (status.faulty()) return fmt::format("{}; then 'kmax clear --axis {}'", status.fault_words(), axis.axis);
  if (!status.armed() && status.refusal != firmware::Refusal::none)
    return fmt::format("the last attempt to arm was refused: {}", firmware::to_string(status.refusal));
  return {};
}

std::vector<std::string> watch_table(const std::vector<WatchedAxis>& axes, std::size_t width) {
  using Cell = std::function<std::string(const WatchedAxis&)>;
  const std::vector<std::pair<const char*, Cell>> rows = {
      {"", [](const auto& a) { return fmt::format("axis {}", a.axis); }},
      {"state", [](const auto& a) { return std::string(device::to_string(a.status.state())); }},
      {"position", [](const auto& a) { return fmt::format("{:+12.6f} m", a.measured.position); }},
      {"velocity", [](const auto& a) { return fmt::format("{:+12.6f} m/s", a.measured.velocity); }},
      {"force", [](const auto& a) { return fmt::format("{:+12.4f} N", a.measured.force); }},
      {"current", [](const auto& a) { return fmt::format("{:+12.4f} A", a.measured.current); }},
  };
  std::vector<std::string> lines;
  for (const auto& [label, cell] : rows) {
    std::string line = fmt::format("{:<{}}", label, label_width);
    for (const WatchedAxis& axis : axes) line += in_column(cell(axis));
    lines.push_back(line);
  }
  // As many lines as the axis with the most flags has, one flag in each.
  std::size_t most = 1;
  for (const WatchedAxis& axis : axes) most = std::max(most, record::flag_words(axis.measured.flags).size());
  for (std::size_t i = 0; i < most; ++i) {
    std::string line = fmt::format("{:<{}}", i == 0 ? "flags" : "", label_width);
    for (const WatchedAxis& axis : axes) {
      const auto words = record::flag_words(axis.measured.flags);
      line += in_column(i < words.size() ? words[i] : i == 0 ? "none" : "");
    }
    lines.push_back(line);
  }
  for (std::string& line : lines) {
    line.erase(line.find_last_not_of(' ') + 1);
    if (line.size() > width) line.resize(width);
  }
  for (const WatchedAxis& axis : axes) {
    const std::string trouble = trouble_of(axis);
    if (trouble.empty()) continue;
    for (std::string& line : wrapped(fmt::format("axis {}: {}", axis.axis, trouble), width))
      lines.push_back(std::move(line));
  }
  return lines;
}

std::string watch_line(double seconds, const std::vector<WatchedAxis>& axes) {
  std::string line = fmt::format("{:.1f} s", seconds);
  for (const WatchedAxis& axis : axes) {
    line += fmt::format(" | axis {}: {}, {:+.6f} m, {:+.6f} m/s, {:+.4f} N, {:+.4f} A, flags: {}", axis.axis,
                        device::to_string(axis.status.state()), axis.measured.position,
                        axis.measured.velocity, axis.measured.force, axis.measured.current,
                        joined(record::flag_words(axis.measured.flags)));
    const std::string trouble = trouble_of(axis);
    if (!trouble.empty()) line += ", " + trouble;
  }
  return line;
}

Json watch_json(const WatchedAxis& axis) {
  const std::string trouble = trouble_of(axis);
  return {{"axis", axis.axis},
          {"state", std::string(device::name_of(axis.status.state()))},
          {"armed", axis.status.armed()},
          {"tick", axis.measured.tick},
          {"position_m", device::shortest_double(axis.measured.position)},
          {"velocity_m_per_s", device::shortest_double(axis.measured.velocity)},
          {"force_n", device::shortest_double(axis.measured.force)},
          {"current_a", device::shortest_double(axis.measured.current)},
          {"flags", record::flag_words(axis.measured.flags)},
          {"trouble", trouble.empty() ? Json(nullptr) : Json(trouble)}};
}

void LiveLines::show(std::vector<std::string> lines, std::size_t rows) {
  lines.resize(std::min(lines.size(), std::max<std::size_t>(rows, 2) - 1));
  if (shown_ > 0) terminal_ << fmt::format("\x1b[{}F", shown_);
  for (const std::string& line : lines) terminal_ << line << "\x1b[K\n";
  terminal_ << "\x1b[J" << std::flush;
  shown_ = lines.size();
}

}  // namespace kmax::cli
