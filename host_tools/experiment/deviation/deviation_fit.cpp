#include "host_tools/experiment/deviation/deviation_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace kmax::experiment {

double quasi_static_deviation(const HandResistance& hand, double background, double interference) {
  const double left = interference - hand.threshold - hand.threshold_rise * background;
  return std::max(0.0, left) / (hand.stiffness * (1.0 + hand.stiffening * background));
}

namespace {
constexpr std::array members{&HandResistance::stiffness, &HandResistance::threshold,
                             &HandResistance::stiffening, &HandResistance::threshold_rise};
// Steps and scales that make the four numbers comparable.
constexpr std::array scales{100.0, 1.0, 0.3, 0.3};

class Problem {
 public:
  Problem(std::span<const paper::DeviationCell> cells, const FitKind& kind) : cells_(cells) {
    if (kind.stiffening) fitted_.push_back(2);
    if (kind.threshold_rise) fitted_.push_back(3);
  }
  std::size_t size() const { return fitted_.size(); }

  HandResistance hand(const Eigen::VectorXd& at) const {
    HandResistance hand;
    for (std::size_t i = 0; i < fitted_.size(); ++i)
      hand.*members[fitted_[i]] = at(static_cast<Eigen::Index>(i)) * scales[fitted_[i]];
    return hand;
  }
  Eigen::VectorXd point(const HandResistance& hand) const {
    Eigen::VectorXd at(static_cast<Eigen::Index>(fitted_.size()));
    for (std::size_t i = 0; i < fitted_.size(); ++i)
      at(static_cast<Eigen::Index>(i)) = hand.*members[fitted_[i]] / scales[fitted_[i]];
    return at;
  }
  bool allowed(const Eigen::VectorXd& at) const {
    const HandResistance found = hand(at);
    return found.stiffness > 1.0 && found.threshold >= 0.0 && found.stiffening >= -0.2 &&
           found.threshold_rise > -10.0;
  }
  /// mm
  Eigen::VectorXd residuals(const Eigen::VectorXd& at) const {
    const HandResistance found = hand(at);
    Eigen::VectorXd result(static_cast<Eigen::Index>(cells_.size()));
    for (std::size_t i = 0; i < cells_.size(); ++i)
      result(static_cast<Eigen::Index>(i)) =
          1e3 *
          (quasi_static_deviation(found, cells_[i].background, cells_[i].interference) - cells_[i].deviation);
    return result;
  }
  Eigen::MatrixXd slopes(const Eigen::VectorXd& at) const {
    Eigen::MatrixXd result(static_cast<Eigen::Index>(cells_.size()), at.size());
    constexpr double step = 1e-6;
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      Eigen::VectorXd up = at, down = at;
      up(i) += step;
      down(i) -= step;
      result.col(i) = (residuals(up) - residuals(down)) / (2.0 * step);
    }
    return result;
  }

 private:
  std::span<const paper::DeviationCell> cells_;
  std::vector<std::size_t> fitted_{0, 1};
};

Eigen::VectorXd descend(const Problem& problem, Eigen::VectorXd at) {
  double damping = 1e-3;
  double cost = problem.residuals(at).squaredNorm();
  for (int round = 0; round < 500 && damping < 1e12; ++round) {
    const Eigen::MatrixXd slopes = problem.slopes(at);
    const Eigen::MatrixXd normal = slopes.transpose() * slopes;
    const Eigen::VectorXd gradient = slopes.transpose() * problem.residuals(at);
    const Eigen::MatrixXd damped =
        normal + damping * (Eigen::MatrixXd(normal.diagonal().asDiagonal()) +
                            1e-9 * Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
    const Eigen::VectorXd next = at - damped.ldlt().solve(gradient);
    const double next_cost = next.allFinite() && problem.allowed(next)
                                 ? problem.residuals(next).squaredNorm()
                                 : std::numeric_limits<double>::infinity();
    if (next_cost < cost) {
      const bool done = cost - next_cost < 1e-14 * cost;
      at = next;
      cost = next_cost;
      damping *= 0.3;
      if (done) break;
    } else {
      damping *= 5.0;
    }
  }
  return at;
}
}  // namespace

DeviationFit fit_deviation(std::span<const paper::DeviationCell> cells, const FitKind& kind) {
  const Problem problem(cells, kind);
  if (cells.size() < problem.size())
    throw std::invalid_argument(fmt::format("{} cells for {} fitted numbers: give at least as many cells",
                                            cells.size(), problem.size()));
  Eigen::VectorXd best;
  double least = std::numeric_limits<double>::infinity();
  for (const double stiffness : {150.0, 300.0, 600.0}) {
    for (const double threshold : {0.5, 2.0, 2.9}) {
      for (const double rise : {0.05, 0.4}) {
        const Eigen::VectorXd found = descend(problem, problem.point({stiffness, threshold, rise, rise}));
        const double cost = problem.residuals(found).squaredNorm();
        if (cost >= least) continue;
        least = cost;
        best = found;
      }
    }
  }
  DeviationFit fit{kind, problem.hand(best), {0, 0, 0, 0}, 0.0, cells.size()};
  fit.rms = 1e-3 * std::sqrt(least / static_cast<double>(cells.size()));
  if (cells.size() > problem.size()) {
    const Eigen::MatrixXd slopes = problem.slopes(best);
    const double variance = least / static_cast<double>(cells.size() - problem.size());
    const Eigen::MatrixXd covariance =
        variance * (slopes.transpose() * slopes).completeOrthogonalDecomposition().pseudoInverse();
    const HandResistance none = fit.error;
    fit.error = problem.hand(covariance.diagonal().cwiseMax(0.0).cwiseSqrt());
    if (!kind.stiffening) fit.error.stiffening = none.stiffening;
    if (!kind.threshold_rise) fit.error.threshold_rise = none.threshold_rise;
  }
  return fit;
}

std::vector<DeviationFit> fit_table_2() {
  std::vector<DeviationFit> fits;
  for (const FitKind& kind : {fit_neither, fit_stiffening, fit_threshold, fit_both})
    fits.push_back(fit_deviation(paper::table_2, kind));
  return fits;
}

}  // namespace kmax::experiment
