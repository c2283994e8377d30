#include "host_tools/bench/excitation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace kmax::bench {

std::vector<std::string> ExcitationPlan::assignments() const {
  const auto number = [](const char* name, double value) {
    // As many digits as a float32 has.
    return fmt::format("excitation.{}={:.9g}", name, value);
  };
  return {fmt::format("excitation.kind={}", kind),
          number("bias", bias),
          number("alternation", alternation),
          fmt::format("excitation.half_period={}", half_period),
          fmt::format("excitation.alternation_axis={}", across ? "across" : "along"),
          number("angle", std::remainder(angle, 2.0 * std::numbers::pi)),
          number("angle_rate", angle_rate),
          number("angle_span", angle_span),
          number("ramp", ramp),
          number("duration", duration),
          number("stiffness", stiffness),
          number("damping", damping),
          number("speed", speed),
          number("stroke", stroke)};
}

double mean_of(std::span<const double> values) {
  if (values.empty()) return 0.0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double deviation_of(std::span<const double> values) {
  if (values.size() < 2) return 0.0;
  const double mean = mean_of(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

double span_of(std::span<const double> values) {
  if (values.empty()) return 0.0;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return *most - *least;
}

}  // namespace kmax::bench
