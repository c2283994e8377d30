#pragma once

#include "control/finite.hpp"
#include "control/saturated_quotient.hpp"

namespace kmax::control {

/// How deep the handle is in the wall when the commanded force meets the force limit, m.
///
///   d = (F_limit - F_MC)/K
///
/// F_limit: N; F_MC: the field's force at and inside the surface, N; K: N/m. Deeper than d the loop has no
/// stiffness at all, so a wall that reaches the limit within a few counts of the encoder is a switch, not a
/// spring: its oscillation is bounded by the limit and looks milder than it is, and a stiffness measured
/// there says nothing about K. 3 counts is the border used here (a choice, the same that counts as
/// oscillation in the experiments): 2 N, 8410 N/m and 3.3 N give 0.155 mm, just under three counts of 0.055
/// mm.
///
/// 0 if the field alone reaches the limit; the largest number if there is no spring.
template <typename Scalar>
constexpr Scalar saturation_depth(Scalar stiffness, Scalar magnetic_coefficient, Scalar force_limit) {
  const Scalar left = saturate(force_limit - magnetic_coefficient);
  return left <= Scalar(0) ? Scalar(0) : saturated_quotient(left, stiffness);
}

/// Quanta that the wall must be deep before it saturates.
inline constexpr int saturation_quanta = 3;

}  // namespace kmax::control
