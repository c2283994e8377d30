#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/calibration/estimate.hpp"
#include "host_tools/calibration/recording.hpp"
#include "host_tools/calibration/step_report.hpp"

namespace kmax::calibration {

// A value that was measured several times: the mean, and how far a single measurement scatters around it. A
// fit that is less sure of itself than the scatter says is believed.
inline IdentifiedValue repeated_value(std::string name, std::span<const Estimate> repetitions,
                                      std::string unit, std::optional<double> previous) {
  IdentifiedValue value{std::move(name), 0.0, 0.0, std::move(unit), previous};
  std::vector<double> values;
  double error = 0.0;
  for (const Estimate& one : repetitions) {
    values.push_back(one.value);
    if (std::isfinite(one.standard_error)) error = std::max(error, one.standard_error);
  }
  value.value = mean_of(values);
  value.spread = std::max(deviation_of(values), error);
  return value;
}

// The bound on how far single measurements of a value may scatter, for all that is taken as a parameter.
inline constexpr double largest_scatter = 0.15;  // of the value

// Throws StepFailed if they scatter by more, and by more than `fine` (in the value's unit), below which it
// does not matter.
inline void require_repeatable(const IdentifiedValue& value, double fine, const std::string& cause) {
  if (value.spread <= std::max(largest_scatter * std::abs(value.value), fine)) return;
  throw StepFailed({cause,
                    fmt::format("{}: {:.3g} {} scatters by {:.2g} {} from one measurement to the next",
                                value.name, value.value, value.unit, value.spread, value.unit),
                    "raise --current or --travel; nobody may hold the handle"});
}

}  // namespace kmax::calibration
