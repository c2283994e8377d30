#include "host_tools/experiment/progress_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace kmax::experiment {

std::optional<double> RemainingTime::seconds(double now, std::size_t done, std::size_t count) const {
  if (done >= count) return 0.0;
  if (done <= before_) return std::nullopt;
  const double elapsed = std::max(0.0, now - begin_);
  return elapsed / static_cast<double>(done - before_) * static_cast<double>(count - done);
}

std::string duration_words(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0.0) return "some time";
  const double minutes = std::round(seconds / 60.0);
  const double tens_of_minutes = std::round(seconds / 600.0);
  if (seconds < 9.5) return fmt::format("{:.0f} s", std::max(1.0, std::round(seconds)));
  if (seconds < 85.0) return fmt::format("{:.0f} s", 10.0 * std::round(seconds / 10.0));
  if (minutes < 60.0) return fmt::format("{:.0f} min", std::max(minutes, 1.0));
  if (tens_of_minutes < 6.0 * 48.0) {
    const double hours = std::floor(tens_of_minutes / 6.0);
    const double rest = 10.0 * (tens_of_minutes - 6.0 * hours);
    return rest > 0.0 ? fmt::format("{:.0f} h {:.0f} min", hours, rest) : fmt::format("{:.0f} h", hours);
  }
  return fmt::format("{:.0f} days", std::round(seconds / 86400.0));
}

std::string progress_words(std::size_t done, std::size_t count, const std::optional<double>& remaining) {
  const std::string far = fmt::format("{} of {} done", done, count);
  if (done >= count || !remaining) return far;
  return fmt::format("{}, {} left", far, duration_words(*remaining));
}

}  // namespace kmax::experiment
