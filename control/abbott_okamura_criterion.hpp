#pragma once

#include <limits>

#include "control/finite.hpp"
#include "control/saturated_quotient.hpp"

namespace kmax::control {

/// The part of the condition below that the position's step asks for, 2 (f_c/Delta - |B|/T), N/m; the largest
/// number if Delta is 0.
template <typename Scalar>
constexpr Scalar position_step_stiffness_limit(Scalar friction, Scalar wall_damping, Scalar period,
                                               Scalar quantum) {
  if (quantum == Scalar(0)) return std::numeric_limits<Scalar>::max();
  const Scalar by_damper = saturate(magnitude(wall_damping) * saturated_quotient(quantum, period));
  return saturated_quotient(saturate(friction - by_damper), quantum * Scalar(0.5));
}

/// Passivity of a sampled and quantized virtual spring.
///
///   K <= min(2 b/T, 2 f_c/Delta)   Abbott & Okamura, "Effects of position quantization and sampling rate on
///                                  virtual-wall passivity", IEEE Trans. Robotics 21(5), 2005
///
/// b: viscous damping of the device, N s/m; f_c: its Coulomb friction, N; T: sample period, s; Delta: the
/// step of the position in use, m (after re-sampling, not the encoder's).
///
/// With a damper B the step part is smaller, 2 (f_c/Delta - |B|/T): the position in use is off by up to half
/// a step and the difference of two by a whole one, so the force by up to (K/2 + |B|/T) Delta, which friction
/// must hold (own derivation; also for a low-passed difference, whose error is no larger). At B = 1 N s/m and
/// 1 kHz, 0.055 mm are 55 mN.
///
/// Assumes: a rigid mass with Coulomb and viscous friction, no delay, force held over the sample; with B, a
/// velocity by difference. Nothing is assumed of the person. The two parts fail in different ways: beyond 2
/// b/T the spring's delay feeds an oscillation that grows, beyond 2 f_c/Delta the steps of the force overcome
/// the friction and the handle buzzes by about a count.
///
/// The part 2 b/T does not hold with wall damping or delay (colgate_criterion.hpp has those).
///
/// Returns the largest K that is passive, N/m; negative if the damper alone steps beyond the friction. A part
/// whose T or Delta is 0 does not limit.
template <typename Scalar>
constexpr Scalar abbott_okamura_stiffness_limit(Scalar damping, Scalar friction, Scalar period,
                                                Scalar quantum, Scalar wall_damping = Scalar(0)) {
  constexpr Scalar largest = std::numeric_limits<Scalar>::max();
  const Scalar by_hold = period == Scalar(0) ? largest : saturated_quotient(damping, period * Scalar(0.5));
  const Scalar by_step = position_step_stiffness_limit(friction, wall_damping, period, quantum);
  return by_step < by_hold || !is_finite(by_step) ? by_step : by_hold;
}

}  // namespace kmax::control
