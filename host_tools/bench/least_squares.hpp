#pragma once
// Small dense least squares with standard errors, for the fits of this folder.
//
// LinearFit: minimises sum (y - x b)^2, by a column-scaled QR decomposition; covariance = s^2 (X^T X)^-1 with
// s^2 = residual variance. A column that the data do not determine gets an infinite standard error.
//
// minimise(): Gauss-Newton with Levenberg-Marquardt damping on residuals that are given as a function,
// Jacobian by one-sided differences of 1e-6 of `scale`. At most 60 iterations; ends when the sum of squares
// falls by less than 1e-9 of itself.

#include <Eigen/Dense>
#include <functional>

namespace kmax::bench {

struct LinearFit {
  Eigen::VectorXd value;
  Eigen::VectorXd standard_error;
  double residual = 0.0;  // rms, with the degrees of freedom taken off
  double square_sum = 0.0;
};

LinearFit solve_least_squares(const Eigen::MatrixXd& columns, const Eigen::VectorXd& right);

using ResidualFunction = std::function<void(const Eigen::VectorXd& parameters, Eigen::VectorXd& residuals)>;

struct NonlinearFit {
  Eigen::VectorXd value;
  Eigen::VectorXd standard_error;
  double residual = 0.0;
  bool converged = false;
};

// `scale`: what each parameter may sensibly change by, > 0. `residual_count`: of the function.
NonlinearFit minimise(const ResidualFunction& function, Eigen::VectorXd start, const Eigen::VectorXd& scale,
                      Eigen::Index residual_count);

}  // namespace kmax::bench
