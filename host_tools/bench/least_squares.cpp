#include "host_tools/bench/least_squares.hpp"

#include <cmath>
#include <limits>

namespace kmax::bench {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double undetermined = 1e-10;  // of the largest eigenvalue of the scaled normal matrix

// Square roots of the diagonal of (X^T X)^-1; infinite where a direction that the data leave open touches it.
Eigen::VectorXd unit_errors(const Eigen::MatrixXd& normal) {
  const Eigen::Index count = normal.rows();
  Eigen::VectorXd scale(count);
  for (Eigen::Index j = 0; j < count; ++j) scale[j] = normal(j, j) > 0.0 ? std::sqrt(normal(j, j)) : 1.0;
  const Eigen::MatrixXd scaled =
      scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const Eigen::VectorXd& values = eigen.eigenvalues();
  Eigen::VectorXd errors(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    double sum = 0.0;
    for (Eigen::Index k = 0; k < count; ++k) {
      const double part = eigen.eigenvectors()(j, k);
      if (values[k] > undetermined * values[count - 1])
        sum += part * part / values[k];
      else if (std::abs(part) > 1e-6)
        sum = infinite;
    }
    errors[j] = std::sqrt(sum) / scale[j];
  }
  return errors;
}

double deviation(double square_sum, Eigen::Index equations, Eigen::Index unknowns) {
  return equations > unknowns ? std::sqrt(square_sum / static_cast<double>(equations - unknowns)) : infinite;
}

}  // namespace

LinearFit solve_least_squares(const Eigen::MatrixXd& columns, const Eigen::VectorXd& right) {
  Eigen::VectorXd scale = columns.colwise().norm().transpose();
  for (double& s : scale) s = s > 0.0 ? s : 1.0;
  const Eigen::MatrixXd scaled = columns * scale.cwiseInverse().asDiagonal();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
  qr.setThreshold(1e-9);
  const Eigen::VectorXd solution = qr.solve(right);
  LinearFit fit;
  fit.value = solution.cwiseQuotient(scale);
  fit.square_sum = (right - scaled * solution).squaredNorm();
  fit.residual = deviation(fit.square_sum, columns.rows(), columns.cols());
  fit.standard_error = fit.residual * unit_errors(columns.transpose() * columns);
  return fit;
}

NonlinearFit minimise(const ResidualFunction& function, Eigen::VectorXd start, const Eigen::VectorXd& scale,
                      Eigen::Index residual_count) {
  const Eigen::Index count = start.size();
  NonlinearFit fit;
  fit.value = std::move(start);
  Eigen::VectorXd residuals(residual_count), moved(residual_count);
  Eigen::MatrixXd jacobian(residual_count, count);
  function(fit.value, residuals);
  double sum = residuals.squaredNorm();
  double damping = 1e-3;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(count, count);
  for (int iteration = 0; iteration < 60 && std::isfinite(sum); ++iteration) {
    for (Eigen::Index j = 0; j < count; ++j) {
      Eigen::VectorXd shifted = fit.value;
      const double step = 1e-6 * scale[j];
      shifted[j] += step;
      function(shifted, moved);
      jacobian.col(j) = (moved - residuals) * (scale[j] / step);  // per scale
    }
    normal = jacobian.transpose() * jacobian;
    const Eigen::VectorXd gradient = jacobian.transpose() * residuals;
    const double before = sum;
    bool improved = false;
    for (int attempt = 0; attempt < 12 && !improved; ++attempt) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() += damping * normal.diagonal() +
                           Eigen::VectorXd::Constant(count, 1e-14 * normal.diagonal().maxCoeff() + 1e-300);
      const Eigen::VectorXd step = damped.ldlt().solve(gradient);
      const Eigen::VectorXd candidate = fit.value - step.cwiseProduct(scale);
      function(candidate, moved);
      const double candidate_sum = moved.squaredNorm();
      if (std::isfinite(candidate_sum) && candidate_sum <= sum) {
        fit.value = candidate;
        residuals = moved;
        sum = candidate_sum;
        damping = std::max(damping * 0.2, 1e-9);
        improved = true;
      } else {
        damping *= 6.0;
      }
    }
    if (!improved || before - sum <= 1e-9 * before) {
      fit.converged = true;
      break;
    }
  }
  fit.residual = deviation(sum, residual_count, count);
  fit.standard_error = fit.residual * unit_errors(normal).cwiseProduct(scale);
  return fit;
}

}  // namespace kmax::bench
