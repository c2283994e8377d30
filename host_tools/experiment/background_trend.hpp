#pragma once
// What paper 1 claims of its tables I and II: a number falls when the background force F_B increases.

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "host_tools/experiment/rank_correlation.hpp"
#include "host_tools/experiment/tested_claim.hpp"

namespace kmax::experiment {

/// A number of one interference force F_I without F_B and with the largest; nothing where nobody touched.
struct BackgroundTrend {
  double interference;            ///< N
  std::optional<double> without;  ///< at F_B = 0 itself, never at a small one
  std::optional<double> with;     ///< at the largest F_B above 0 that has a touch
  std::optional<double> rank;     ///< correlation with F_B
  /// By a tenth at least. What is 0 without F_B does not fall. Not tested while either number is missing.
  TestedClaim falls() const {
    if (!without || !with) return std::nullopt;
    return *without > 0.0 && *with <= 0.9 * *without;
  }
};

/// At every F_I; not tested without any trend.
inline TestedClaim all_fall(const std::vector<BackgroundTrend>& trends) {
  std::vector<TestedClaim> each;
  for (const BackgroundTrend& trend : trends) each.push_back(trend.falls());
  return all_hold(each);
}

/// Of the results at this F_I that have a touch. A Result is of one cell of a table, `paper` (forces in N),
/// and counts its `touches`; `number` is a member or a function of it.
template <typename Result, typename Number>
BackgroundTrend background_trend(double interference, std::span<const Result> results, Number number) {
  BackgroundTrend trend{interference, {}, {}, {}};
  std::vector<double> forces, values;
  double largest = 0.0;
  for (const Result& result : results) {
    if (result.paper.interference != interference || result.touches == 0) continue;
    const double force = result.paper.background, value = std::invoke(number, result);
    forces.push_back(force);
    values.push_back(value);
    if (force == 0.0) trend.without = value;
    if (force <= largest) continue;
    largest = force;
    trend.with = value;
  }
  trend.rank = rank_correlation(forces, values);
  return trend;
}

}  // namespace kmax::experiment
