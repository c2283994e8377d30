#pragma once
// What an experiment answers to a claim: that it holds, that it does not, or that nothing it did tests it.
// The third is no finding, and a "no" in its place would be one.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

namespace kmax::experiment {

/// Nothing: not tested. Compare with `== true` or `== false`: as a condition it tells only whether it was.
using TestedClaim = std::optional<bool>;

/// Does each of them hold? One that does not is enough for a no; without one, the answer is open as long as
/// any is, and when there are none.
inline TestedClaim all_hold(const std::vector<TestedClaim>& claims) {
  const auto contains = [&](const TestedClaim& claim) {
    return std::find(claims.begin(), claims.end(), claim) != claims.end();
  };
  if (contains(false)) return false;
  if (claims.empty() || contains(std::nullopt)) return std::nullopt;
  return true;
}

// How alike two sets of numbers are ordered, whatever their sizes: Spearman's rank correlation, with the mean
// rank for equal values (C. Spearman, "The proof and measurement of association between two things", 1904).
// +1: the same order, -1: the opposite one.

/// Ranks from 1 on; equal values share the mean of theirs.
inline std::vector<double> ranks(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> result(values.size());
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first + 1;
    while (end < order.size() && values[order[end]] == values[order[first]]) ++end;
    const double mean = 0.5 * static_cast<double>(first + 1 + end);
    for (; first < end; ++first) result[order[first]] = mean;
  }
  return result;
}

/// Nothing for fewer than two pairs, and where one side has only one value: there is no order to compare.
/// Throws std::invalid_argument for different lengths or a value that is NaN.
inline std::optional<double> rank_correlation(std::span<const double> a, std::span<const double> b) {
  if (a.size() != b.size()) throw std::invalid_argument("rank correlation of two lists of different length");
  const auto is_nan = [](double value) { return std::isnan(value); };
  if (std::any_of(a.begin(), a.end(), is_nan) || std::any_of(b.begin(), b.end(), is_nan))
    throw std::invalid_argument("rank correlation of a list with a value that is not a number");
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double mean = 0.5 * static_cast<double>(a.size() + 1);
  double xy = 0, xx = 0, yy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - mean) * (y[i] - mean);
    xx += (x[i] - mean) * (x[i] - mean);
    yy += (y[i] - mean) * (y[i] - mean);
  }
  if (xx == 0.0 || yy == 0.0) return std::nullopt;
  return xy / std::sqrt(xx * yy);
}

// What paper 1 claims of its tables I and II: a number falls when the background force F_B increases.

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
