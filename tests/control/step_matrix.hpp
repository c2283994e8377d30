#pragma once

#include <cmath>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <unsupported/Eigen/MatrixFunctions>

#include "control/sampled_loop.hpp"

namespace kmax::control {

// The same loop without a characteristic polynomial: the step from one sample to the next as a matrix on the
// state of the continuous part, the last position, and the forces under way; matrix exponential (Pade) and
// eigenvalues (QR) by Eigen. `rate`: of the continuous part, its places and velocities in turn, SI, the
// handle's first; the last column is what 1 N does to them.
template <typename Scalar>
using Square = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

template <typename Scalar>
Square<Scalar> step_matrix_of(const Square<Scalar>& rate, const SampledLoop<double>& l, double stiffness) {
  using Column = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  const auto n = rate.rows() - 1;
  const Scalar period = l.period, damping = l.wall_damping;
  const int whole = static_cast<int>(std::floor(l.delay / l.period));
  const Scalar late = Scalar(l.delay) - whole * period;
  const Square<Scalar> early = (rate * late).exp(), after = (rate * (period - late)).exp();
  const Square<Scalar> both = after.topLeftCorner(n, n) * early.topLeftCorner(n, n);
  const Column old_force = after.topLeftCorner(n, n) * early.topRightCorner(n, 1);
  const Column new_force = after.topRightCorner(n, 1);

  // state: continuous, x_{k-1}, F_{k-1} .. F_{k-whole-1}
  const auto size = n + 1 + whole + 1;
  Square<Scalar> step = Square<Scalar>::Zero(size, size);
  Eigen::Matrix<Scalar, 1, Eigen::Dynamic> force = Eigen::Matrix<Scalar, 1, Eigen::Dynamic>::Zero(size);
  force(0) = -Scalar(stiffness) - damping / period;
  force(n) = damping / period;
  step.topLeftCorner(n, n) = both;
  step.block(0, n + 1 + whole, n, 1) += old_force;
  if (whole == 0)
    step.topRows(n) += new_force * force;
  else
    step.block(0, n + whole, n, 1) += new_force;
  step(n, 0) = 1;
  step.row(n + 1) = force;
  for (int i = 1; i <= whole; ++i) step(n + 1 + i, n + i) = 1;
  // Metres, metres per sample, and forces by the metres they move the device in a sample: in SI units QR
  // alone errs by 1e-5.
  Column unit = Column::Ones(size);
  for (Eigen::Index i = 1; i < n; i += 2) unit(i) = 1 / period;
  unit.tail(whole + 1).setConstant(Scalar(l.mass) / (period * period));
  return unit.cwiseInverse().asDiagonal() * step * unit.asDiagonal();
}

inline Eigen::MatrixXd step_matrix(const SampledLoop<double>& l, double stiffness) {
  const Hand<double>& h = l.hand;
  const bool held = h.hand_mass > 0.0;
  const int n = held ? 4 : 2;  // x, v, y, w
  Eigen::MatrixXd rate = Eigen::MatrixXd::Zero(n + 1, n + 1);
  rate(0, 1) = 1.0;
  rate(1, 1) = -l.damping / l.mass;
  rate(1, n) = 1.0 / l.mass;
  if (held) {
    rate(1, 0) -= h.grip_stiffness / l.mass;
    rate(1, 1) -= h.grip_damping / l.mass;
    rate(1, 2) += h.grip_stiffness / l.mass;
    rate(1, 3) += h.grip_damping / l.mass;
    rate(2, 3) = 1.0;
    rate(3, 0) = h.grip_stiffness / h.hand_mass;
    rate(3, 1) = h.grip_damping / h.hand_mass;
    rate(3, 2) = -(h.grip_stiffness + h.arm_stiffness) / h.hand_mass;
    rate(3, 3) = -(h.grip_damping + h.arm_damping) / h.hand_mass;
  }
  return step_matrix_of<double>(rate, l, stiffness);
}

inline double radius_by_eigenvalues(const SampledLoop<double>& loop, double stiffness) {
  return step_matrix(loop, stiffness).eigenvalues().cwiseAbs().maxCoeff();
}

}  // namespace kmax::control
