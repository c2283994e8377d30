#include "host_tools/selftest/recording.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kmax::selftest {

MeanAndDeviation mean_and_deviation(const std::vector<double>& values, std::size_t first, std::size_t last) {
  last = std::min(last, values.size());
  if (first >= last) return {};
  const auto count = static_cast<double>(last - first);
  MeanAndDeviation result;
  for (std::size_t k = first; k < last; ++k) result.mean += values[k] / count;
  for (std::size_t k = first; k < last; ++k)
    result.deviation += (values[k] - result.mean) * (values[k] - result.mean) / count;
  result.deviation = std::sqrt(result.deviation);
  return result;
}

std::size_t end_of_pulse(const Recording& recording) {
  std::size_t end = recording.size();
  if (!recording.tripped()) return std::min(end, recording.before + recording.pulse.duration + 2);
  while (end > recording.before && recording.voltage[end - 1] == 0.0) --end;
  return std::min(end + 1, recording.size());
}

std::vector<double> current_along(const Recording& recording, bool synchronous) {
  const double offset_b = mean_and_deviation(recording.current_b, 0, recording.before).mean;
  const double offset_c = mean_and_deviation(recording.current_c, 0, recording.before).mean;
  const double cosine = std::cos(recording.pulse.angle), sine = std::sin(recording.pulse.angle);
  std::vector<double> along(recording.size());
  for (std::size_t k = 0; k < along.size(); ++k) {
    const double b = recording.current_b[k] - offset_b, c = recording.current_c[k] - offset_c;
    along[k] = synchronous ? -(b + c) * cosine + (b - c) / std::numbers::sqrt3 * sine : 0.5 * (b - c);
  }
  return along;
}

}  // namespace kmax::selftest
