#include "host_tools/kmax/recording/watch_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware/parameters/refusal.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/terminal_text.hpp"

namespace kmax::cli {

namespace {
constexpr const char* red = "\x1b[31m";
constexpr const char* green = "\x1b[32m";
constexpr const char* yellow = "\x1b[33m";

std::string joined(const std::vector<std::string>& words) {
  return words.empty() ? "none" : fmt::format("{}", fmt::join(words, ", "));
}

const char* colour_of(const WatchedAxis& axis) {
  if (axis.status.faulty()) return red;
  return axis.status.armed() ? green : nullptr;
}

/// Cut to `width` before the colour, whose letters take no place.
std::string coloured(std::string line, std::size_t width, const char* colour) {
  line.erase(line.find_last_not_of(' ') + 1);
  line.resize(base::beginning(line, width).size());
  return colour == nullptr ? line : colour + line + "\x1b[0m";
}
}  // namespace

std::string trouble_of(const WatchedAxis& axis) {
  const device::DriveStatus& status = axis.status;
  if (status.faulty()) return fmt::format("{}; then 'kmax clear --axis {}'", status.fault_words(), axis.axis);
  if (!status.armed() && status.refusal != firmware::Refusal::none)
    return fmt::format("the last attempt to arm was refused: {}", firmware::to_string(status.refusal));
  return {};
}

std::string bar(float value, float end, std::size_t half) {
  const bool beyond = !(std::abs(value) <= end);
  const float part = beyond ? 1.0F : end > 0 ? std::abs(value) / end : 0.0F;
  const auto filled = static_cast<std::size_t>(std::lround(part * static_cast<float>(half)));
  std::string lower(half, ' '), upper(half, ' ');
  if (value < 0) {
    std::fill_n(lower.rbegin(), filled, '#');
    if (beyond && half > 0) lower.front() = '!';
  } else {
    std::fill_n(upper.begin(), filled, '#');
    if (beyond && half > 0) upper.back() = '!';
  }
  return fmt::format("[{}|{}]", lower, upper);
}

std::vector<std::string> watch_table(const std::vector<WatchedAxis>& axes, std::size_t width, bool colour) {
  // Beside name, value, end and their units.
  const std::size_t half = std::clamp<std::size_t>(width, 41, 67) / 2 - 19;
  std::vector<std::string> lines;
  const auto add = [&](const std::string& line, const char* its_colour = nullptr) {
    lines.push_back(coloured(line, width, colour ? its_colour : nullptr));
  };
  const auto with_bar = [half](std::string line, float value, float end, std::string_view unit) {
    if (end > 0) line += fmt::format("  {} {:.3g} {}", bar(value, end, half), end, unit);
    return line;
  };
  for (const WatchedAxis& axis : axes) {
    const auto& measured = axis.measured;
    const firmware::DriveState state = axis.status.state();
    add(fmt::format("axis {}: {} ({})", axis.axis, device::plain_words(state), device::to_string(state)),
        colour_of(axis));
    add(fmt::format("  position {:+12.3f} mm", measured.position * 1e3F));
    add(fmt::format("  velocity {:+12.1f} mm/s", measured.velocity * 1e3F));
    add(with_bar(fmt::format("  force    {:+12.3f} N ", measured.force), measured.force, axis.force_limit,
                 "N"));
    add(with_bar(fmt::format("  current  {:+12.3f} A ", measured.current), measured.current,
                 axis.current_limit, "A"));
    const std::string flags = joined(record::flag_words(measured.flags));
    add("  flags    " + flags, flags.find("wall ") != std::string::npos ? yellow : nullptr);
    if (const std::string trouble = trouble_of(axis); !trouble.empty()) {
      for (const std::string& line : base::lines_of(trouble, width > 4 ? width - 2 : width))
        add("  " + line, yellow);
    }
  }
  return lines;
}

std::string watch_line(double seconds, const std::vector<WatchedAxis>& axes) {
  std::string line = fmt::format("{:.1f} s", seconds);
  for (const WatchedAxis& axis : axes) {
    line += fmt::format(" | axis {}: {}, {:+.3f} mm, {:+.1f} mm/s, {:+.4f} N, {:+.4f} A, flags: {}",
                        axis.axis, device::plain_words(axis.status.state()), axis.measured.position * 1e3F,
                        axis.measured.velocity * 1e3F, axis.measured.force, axis.measured.current,
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
          {"position_m", base::shortest_double(axis.measured.position)},
          {"velocity_m_per_s", base::shortest_double(axis.measured.velocity)},
          {"force_n", base::shortest_double(axis.measured.force)},
          {"current_a", base::shortest_double(axis.measured.current)},
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
