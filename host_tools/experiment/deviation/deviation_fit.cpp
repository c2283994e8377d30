#include "host_tools/experiment/deviation/deviation_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "host_tools/bench/least_squares.hpp"

namespace kmax::experiment {

double quasi_static_deviation(const HandResistance& hand, double background, double interference) {
  const double left = interference - hand.threshold - hand.threshold_rise * background;
  return std::max(0.0, left) / (hand.stiffness * (1.0 + hand.stiffening * background));
}

namespace {
constexpr std::array members{&HandResistance::stiffness, &HandResistance::threshold,
                             &HandResistance::stiffening, &HandResistance::threshold_rise};
// What each may sensibly change by.
constexpr std::array scales{100.0, 1.0, 0.3, 0.3};

class Problem {
 public:
  Problem(std::span<const paper::DeviationCell> cells, const FitKind& kind) : cells_(cells) {
    if (kind.stiffening) fitted_.push_back(2);
    if (kind.threshold_rise) fitted_.push_back(3);
  }
  std::size_t size() const { return fitted_.size(); }

  HandResistance hand(const Eigen::VectorXd& numbers) const {
    HandResistance hand{0.0, 0.0, 0.0, 0.0};
    for (std::size_t i = 0; i < fitted_.size(); ++i)
      hand.*members[fitted_[i]] = numbers(static_cast<Eigen::Index>(i));
    return hand;
  }
  Eigen::VectorXd numbers_of(const auto& all) const {
    Eigen::VectorXd numbers(static_cast<Eigen::Index>(fitted_.size()));
    for (std::size_t i = 0; i < fitted_.size(); ++i) numbers(static_cast<Eigen::Index>(i)) = all(fitted_[i]);
    return numbers;
  }
  /// mm; infinite for a hand that there cannot be
  void residuals(const Eigen::VectorXd& numbers, Eigen::VectorXd& result) const {
    const HandResistance found = hand(numbers);
    const bool possible = found.stiffness > 1.0 && found.threshold >= 0.0 && found.stiffening >= -0.2 &&
                          found.threshold_rise > -10.0;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const double deviation = quasi_static_deviation(found, cells_[i].background, cells_[i].interference);
      result(static_cast<Eigen::Index>(i)) =
          possible ? 1e3 * (deviation - cells_[i].deviation) : std::numeric_limits<double>::infinity();
    }
  }

 private:
  std::span<const paper::DeviationCell> cells_;
  std::vector<std::size_t> fitted_{0, 1};
};
}  // namespace

DeviationFit fit_deviation(std::span<const paper::DeviationCell> cells, const FitKind& kind) {
  const Problem problem(cells, kind);
  if (cells.size() < problem.size())
    throw std::invalid_argument(fmt::format("{} cells for {} fitted numbers: give at least as many cells",
                                            cells.size(), problem.size()));
  const auto count = static_cast<Eigen::Index>(cells.size());
  const Eigen::VectorXd scale = problem.numbers_of([](std::size_t i) { return scales[i]; });
  const auto residuals = [&](const Eigen::VectorXd& numbers, Eigen::VectorXd& result) {
    problem.residuals(numbers, result);
  };
  bench::NonlinearFit best;
  Eigen::VectorXd left(count);
  double least = std::numeric_limits<double>::infinity();
  for (const double stiffness : {150.0, 300.0, 600.0}) {
    for (const double threshold : {0.5, 2.0, 2.9}) {
      for (const double rise : {0.05, 0.4}) {
        const HandResistance start{stiffness, threshold, rise, rise};
        const bench::NonlinearFit found = bench::minimise(
            residuals, problem.numbers_of([&](std::size_t i) { return start.*members[i]; }), scale, count);
        problem.residuals(found.value, left);
        if (left.squaredNorm() >= least) continue;
        least = left.squaredNorm();
        best = found;
      }
    }
  }
  DeviationFit fit{kind, problem.hand(best.value), {0, 0, 0, 0}, 0.0, cells.size()};
  fit.rms = 1e-3 * std::sqrt(least / static_cast<double>(cells.size()));
  if (cells.size() > problem.size()) fit.error = problem.hand(best.standard_error);
  return fit;
}

std::vector<DeviationFit> fit_table_2() {
  std::vector<DeviationFit> fits;
  for (const FitKind& kind : {fit_neither, fit_stiffening, fit_threshold, fit_both})
    fits.push_back(fit_deviation(paper::table_2, kind));
  return fits;
}

}  // namespace kmax::experiment
