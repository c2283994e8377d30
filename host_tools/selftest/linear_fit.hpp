#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace kmax::selftest {

/// Least squares for a handful of unknowns by the normal equations: add() every sample, then solve().
///
/// The columns are scaled to length one before the elimination, so that their units do not matter. No
/// solution if they depend on each other (a pivot below 1e-10) or there are not more samples than unknowns.
template <std::size_t unknowns>
class LinearFit {
 public:
  struct Solution {
    std::array<double, unknowns> value{};
    std::array<double, unknowns> deviation{};  ///< standard deviation, from the residuals
    double residual = 0.0;                     ///< root mean square
  };

  void add(const std::array<double, unknowns>& row, double target) {
    for (std::size_t i = 0; i < unknowns; ++i) {
      for (std::size_t j = 0; j < unknowns; ++j) normal_[i][j] += row[i] * row[j];
      right_[i] += row[i] * target;
    }
    square_ += target * target;
    ++samples_;
  }

  std::optional<Solution> solve() const {
    if (samples_ <= unknowns) return std::nullopt;
    std::array<double, unknowns> scale{};
    for (std::size_t i = 0; i < unknowns; ++i) {
      if (!(normal_[i][i] > 0.0)) return std::nullopt;
      scale[i] = 1.0 / std::sqrt(normal_[i][i]);
    }
    // Gauss-Jordan on [normal | identity], with the largest pivot of the column.
    std::array<std::array<double, 2 * unknowns>, unknowns> rows{};
    for (std::size_t i = 0; i < unknowns; ++i) {
      for (std::size_t j = 0; j < unknowns; ++j) rows[i][j] = normal_[i][j] * scale[i] * scale[j];
      rows[i][unknowns + i] = 1.0;
    }
    for (std::size_t column = 0; column < unknowns; ++column) {
      std::size_t best = column;
      for (std::size_t i = column + 1; i < unknowns; ++i) {
        if (std::abs(rows[i][column]) > std::abs(rows[best][column])) best = i;
      }
      if (!(std::abs(rows[best][column]) > 1e-10)) return std::nullopt;
      std::swap(rows[best], rows[column]);
      const double pivot = 1.0 / rows[column][column];
      for (double& entry : rows[column]) entry *= pivot;
      for (std::size_t i = 0; i < unknowns; ++i) {
        if (i == column) continue;
        const double factor = rows[i][column];
        for (std::size_t j = 0; j < 2 * unknowns; ++j) rows[i][j] -= factor * rows[column][j];
      }
    }
    Solution solution;
    double explained = 0.0;
    for (std::size_t i = 0; i < unknowns; ++i) {
      for (std::size_t j = 0; j < unknowns; ++j)
        solution.value[i] += rows[i][unknowns + j] * scale[i] * scale[j] * right_[j];
      explained += solution.value[i] * right_[i];
    }
    const double left = square_ > explained ? square_ - explained : 0.0;
    const double variance = left / static_cast<double>(samples_ - unknowns);
    solution.residual = std::sqrt(left / static_cast<double>(samples_));
    for (std::size_t i = 0; i < unknowns; ++i)
      solution.deviation[i] = std::sqrt(std::abs(rows[i][unknowns + i]) * variance) * scale[i];
    return solution;
  }

 private:
  std::array<std::array<double, unknowns>, unknowns> normal_{};
  std::array<double, unknowns> right_{};
  double square_ = 0.0;
  std::size_t samples_ = 0;
};

}  // namespace kmax::selftest
