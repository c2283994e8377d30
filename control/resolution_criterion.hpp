#pragma once

#include "control/finite.hpp"

namespace kmax::control {

/// How far the wall's force steps from one sample to the next against what a hand takes without moving
/// (paper 2, position resolution and stability, eqs. 2 to 8).
///
///   K max(eta, delta v T) <= F_h         the largest step
///   v <= F_h/(K delta T)                 the same as a limit of speed (its eq. 8)
///
/// K: stiffness, N/m; eta: the position step in use, m (>= the encoder's count); delta: the part of a sample
/// spent inside the wall before it is noticed, 0 .. 1, worst case 1; v: speed at contact, m/s; T: sample
/// period, s; F_h: the force that the person holds against, N.
///
/// A quasi-static rule of thumb, not passivity: mass, damping, delay and the hand's dynamics do not appear,
/// and F_h is not a constant of a person. Passing it proves nothing about a loop that is held lightly.
///
/// Returns the step of the force, N.
template <typename Scalar>
constexpr Scalar force_step(Scalar stiffness, Scalar quantum, Scalar detection_share, Scalar speed,
                            Scalar period) {
  const Scalar entered = saturate(saturate(detection_share * speed) * period);
  const Scalar depth = entered > quantum || !is_finite(entered) ? entered : quantum;
  return saturate(stiffness * depth);
}

/// Returns the highest speed that keeps the step within F_h, m/s; the largest number if K delta T is 0.
template <typename Scalar>
constexpr Scalar contact_speed_limit(Scalar stiffness, Scalar detection_share, Scalar period,
                                     Scalar operator_force) {
  return saturated_quotient(operator_force, saturate(stiffness * saturate(detection_share * period)));
}

}  // namespace kmax::control
