#include "host_tools/bench/least_squares.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host_tools/simulation/noise_generator.hpp"

namespace kmax::bench::least_squares_test {

TEST(LeastSquares, ALineWithItsStandardErrors) {
  double squares = 0.0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    simulation::NoiseGenerator random(seed);
    Eigen::MatrixXd columns(50, 2);
    Eigen::VectorXd right(50);
    for (int n = 0; n < 50; ++n) {
      columns(n, 0) = 1e-6 * n;  // a scale far from 1
      columns(n, 1) = 1.0;
      right[n] = 3e5 * columns(n, 0) - 2.0 + 0.1 * random.gaussian();
    }
    const LinearFit fit = solve_least_squares(columns, right);
    EXPECT_NEAR(fit.residual, 0.1, 0.05);
    squares += std::pow((fit.value[0] - 3e5) / fit.standard_error[0], 2);
  }
  EXPECT_NEAR(std::sqrt(squares / 200), 1.0, 0.15);
}

TEST(LeastSquares, WhatTheDataLeaveOpenHasAnInfiniteError) {
  Eigen::MatrixXd columns(20, 3);
  Eigen::VectorXd right(20);
  for (int n = 0; n < 20; ++n) {
    columns(n, 0) = n;
    columns(n, 1) = 2.0 * n;  // the same direction
    columns(n, 2) = n % 3;
    right[n] = n + n % 2;
  }
  const LinearFit fit = solve_least_squares(columns, right);
  EXPECT_TRUE(std::isinf(fit.standard_error[0]));
  EXPECT_TRUE(std::isinf(fit.standard_error[1]));
  EXPECT_TRUE(std::isfinite(fit.standard_error[2]));
  EXPECT_TRUE(fit.value.allFinite());
}

TEST(LeastSquares, GaussNewtonFindsAnExponentialFromFarAway) {
  const auto residuals = [](const Eigen::VectorXd& x, Eigen::VectorXd& out) {
    for (int n = 0; n < 40; ++n) out[n] = x[0] * std::exp(-x[1] * n) - 5.0 * std::exp(-0.3 * n);
  };
  Eigen::VectorXd start(2), scale(2);
  start << 1.0, 0.05;
  scale << 1.0, 0.1;
  const NonlinearFit fit = minimise(residuals, start, scale, 40);
  EXPECT_TRUE(fit.converged);
  EXPECT_NEAR(fit.value[0], 5.0, 1e-4);
  EXPECT_NEAR(fit.value[1], 0.3, 1e-5);
}

TEST(LeastSquares, ResidualsThatAreNotFiniteEndWithoutAResult) {
  const auto residuals = [](const Eigen::VectorXd&, Eigen::VectorXd& out) { out.setConstant(NAN); };
  const NonlinearFit fit = minimise(residuals, Eigen::VectorXd::Ones(1), Eigen::VectorXd::Ones(1), 3);
  EXPECT_FALSE(fit.converged);
  EXPECT_FALSE(std::isfinite(fit.standard_error[0]));
}

}  // namespace kmax::bench::least_squares_test
