#pragma once

#include <limits>

#include "control/finite.hpp"
#include "control/saturated_quotient.hpp"

namespace kmax::control {

/// Passivity of a sampled and quantized virtual spring.
///
///   K <= min(2 b/T, 2 f_c/Delta)   Abbott & Okamura, "Effects of position quantization and sampling rate on
///                                  virtual-wall passivity", IEEE Trans. Robotics 21(5), 2005
///
/// b: viscous damping of the device, N s/m; f_c: its Coulomb friction, N; T: sample period, s; Delta: the
/// step of the position in use, m (after re-sampling, not the encoder's).
///
/// Assumes: a rigid mass with Coulomb and viscous friction, a spring only (no wall damping), no delay, force
/// held over the sample. Nothing is assumed of the person. The two parts fail in different ways: beyond 2 b/T
/// the spring's delay feeds an oscillation that grows, beyond 2 f_c/Delta the steps of the force overcome the
/// friction and the handle buzzes by about a count.
///
/// Does not hold with wall damping or delay (colgate_criterion.hpp has those).
///
/// Returns the largest K that is passive, N/m; a part whose T or Delta is 0 does not limit.
template <typename Scalar>
constexpr Scalar abbott_okamura_stiffness_limit(Scalar damping, Scalar friction, Scalar period,
                                                Scalar quantum) {
  constexpr Scalar largest = std::numeric_limits<Scalar>::max();
  const Scalar by_hold = period == Scalar(0) ? largest : saturated_quotient(damping, period * Scalar(0.5));
  const Scalar by_step = quantum == Scalar(0) ? largest : saturated_quotient(friction, quantum * Scalar(0.5));
  return by_step < by_hold || !is_finite(by_step) ? by_step : by_hold;
}

}  // namespace kmax::control
