#pragma once
// What paper 1 claims of its tables I and II: a number falls when the background force F_B increases.

#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "host_tools/experiment/rank_correlation.hpp"

namespace kmax::experiment {

/// A number of one interference force F_I at the least and at the largest F_B.
struct BackgroundTrend {
  double interference;         ///< N
  double without, with;        ///< at the least F_B, which is 0 in both tables, and at the largest
  std::optional<double> rank;  ///< correlation with F_B
  /// By a tenth at least.
  bool falls() const { return without > 0.0 && with <= 0.9 * without; }
};

/// False without any trend: nothing has been shown then.
inline bool all_fall(const std::vector<BackgroundTrend>& trends) {
  return !trends.empty() && std::all_of(trends.begin(), trends.end(),
                                        [](const BackgroundTrend& trend) { return trend.falls(); });
}

/// Of the results at this F_I that have a touch; zeros without a rank where there is none. A Result is of one
/// cell of a table, `paper` (forces in N), and counts its `touches`; `number` is a member or a function of
/// it.
template <typename Result, typename Number>
BackgroundTrend background_trend(double interference, std::span<const Result> results, Number number) {
  std::vector<double> forces, values;
  for (const Result& result : results) {
    if (result.paper.interference != interference || result.touches == 0) continue;
    forces.push_back(result.paper.background);
    values.push_back(std::invoke(number, result));
  }
  BackgroundTrend trend{interference, 0.0, 0.0, rank_correlation(forces, values)};
  if (forces.empty()) return trend;
  const auto [least, most] = std::minmax_element(forces.begin(), forces.end());
  trend.without = values[static_cast<std::size_t>(least - forces.begin())];
  trend.with = values[static_cast<std::size_t>(most - forces.begin())];
  return trend;
}

}  // namespace kmax::experiment
