#pragma once

#include "control/saturated_quotient.hpp"

namespace kmax::control {

/// Stability of the sampled loop, linear in delay and damping.
///
///   K < (b + B)/(T/2 + Td)   Gil, Sanchez, Hulin, Preusche & Hirzinger, "Stability boundary for haptic
///                            rendering: influence of damping and delay", J. Computing and Information
///                            Science in Engineering 9(1), 2009
///
/// b: damping of the device, N s/m (a hand adds to it); K, B: stiffness and damping of the wall; T: sample
/// period; Td: delay beyond the hold; SI. Here B helps, unlike in Colgate's condition: stability asks for
/// less than passivity.
///
/// Assumes: a rigid linear device, no friction, no quantization; short delay, fast sampling, low damping
/// against the mass: (b + B)(T + Td)/m well below 1. Mass does not appear because of that. Outside of it the
/// condition errs to either side: for b = 8.41 N s/m, m = 45 g, T = 2 ms the exact limit is 7 % higher; with
/// much B the exact one is lower, and beyond some B no K at all is stable (sampled_stability.hpp is exact).
///
/// Returns the K that must not be reached, N/m; negative if B < -b; the largest number if T and Td are 0.
template <typename Scalar>
constexpr Scalar gil_stiffness_limit(Scalar damping, Scalar wall_damping, Scalar period, Scalar delay) {
  return saturated_quotient(saturate(damping + wall_damping), period * Scalar(0.5) + delay);
}

}  // namespace kmax::control
