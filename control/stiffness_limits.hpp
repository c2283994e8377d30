#pragma once

#include <limits>

#include "control/finite.hpp"

// Stiffnesses that a wall must not reach, by the criteria of the literature that have a closed form.

namespace kmax::control {

/// Passivity of a sampled virtual wall.
///
///   b > K T/2 + |B|
///   b > K (T/2 + Td) + |B|   with a loop delay Td
///
/// Colgate & Schenkel, "Passivity of a class of sampled-data systems: application to haptic interfaces", J.
/// Robotic Systems 14(1), 1997.
///
/// b: viscous damping that the device itself has, N s/m. K, B: stiffness and damping of the wall, N/m and
/// N s/m; |B|, because a negative virtual damping costs as much as a positive one. T: sample period, s. Td:
/// from a sample to its force at the handle beyond the hold (computation, current loop), s.
///
/// Assumes: a rigid device, force held over the sample, B times the backward difference of the position, no
/// quantization, no Coulomb friction. Nothing is assumed of the person, other than being passive. Without
/// delay the condition is necessary and sufficient for a two-sided spring and damper. With delay it is the
/// source's general condition, b > T/2 Re{(1 - e^-jwT) H}/(1 - cos wT), for H = (K + B (z - 1)/(T z)) z^-n:
/// for a delay of n whole samples it is necessary and sufficient with B = 0, and sufficient with B, which
/// charges high frequencies while the delay charges low ones. For parts of a sample it is a straight line
/// between those, below which thousands of random passive hands were stable (tests), but which an undamped
/// heavy hand on a soft spring is not quite: the ripple that a held force makes of the position is then not 0
/// at the samples, but acts as a damper of -K^2 T^3 (d^3 - 1.5 d^2 + 0.5 d)/(6 m), d the part of a sample.
/// Such a hand may turn unstable at a K that is lower by up to 0.008 K T^2/m T/(T/2 + Td) of it, own
/// derivation: by less than 0.1 % where b T/m is below 0.05.
///
/// Does not hold as a limit of stability: with friction or a hand, walls many times stiffer are stable
/// (sampled_stability.hpp, diolaiti_criterion.hpp). Nor is it sufficient with coarse quantization
/// (Abbott and Okamura, below).
///
/// With an elastic structure between motor and hand it stays sufficient, if the position is measured on the
/// motor's side and b is the damping of that side alone: structure, tip and hand are then together what holds
/// the mass m, and passive, and m itself does not appear. An encoder beyond the structure is not covered.
///
/// Returns the K that must not be reached, N/m: (b - |B|)/(T/2 + Td), negative if |B| > b; the largest number
/// if T and Td are 0.
template <typename Scalar>
constexpr Scalar colgate_stiffness_limit(Scalar damping, Scalar wall_damping, Scalar period, Scalar delay) {
  return saturated_quotient(saturate(damping - magnitude(wall_damping)), period * Scalar(0.5) + delay);
}

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
/// The part 2 b/T does not hold with wall damping or delay (Colgate has those).
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

/// The steepest slope of the repulsive field in front of the wall, N/m.
///
///   F = F_MC/(s/x_0 + 1)^2,  -dF/ds = 2 F_MC/x_0 at the surface s = 0     (paper 1, eq. 5 differentiated)
///
/// F_MC: field coefficient, N; x_0: field length, m. At a point the sampled loop cannot tell this slope from
/// a spring, so it must pass the bounds of one (field_slope_limit()). 2 N over 1 mm are 4000 N/m: more than
/// many walls.
///
/// Sufficient, not necessary: the slope is that steep only at the surface, an eighth of it one x_0 away. An
/// adaptive coefficient adds a damping dF/dv (of either sign) that is not in here.
///
/// 0 without a field; the largest number if x_0 is 0.
template <typename Scalar>
constexpr Scalar steepest_field_slope(Scalar magnetic_coefficient, Scalar magnetic_length) {
  return saturated_quotient(magnetic_coefficient, magnetic_length * Scalar(0.5));
}

/// What that slope must stay below, N/m: Colgate's bound, and the position's step held by friction,
/// 2 (f_c/Delta - |B|/T), since the field steps by up to its slope times Delta: 2 N over 0.2 mm by 1.1 N at
/// 0.055 mm. B acts inside only, but sets in at the surface, where the slope is.
template <typename Scalar>
constexpr Scalar field_slope_limit(Scalar damping, Scalar wall_damping, Scalar friction, Scalar period,
                                   Scalar delay, Scalar quantum) {
  const Scalar by_hold = colgate_stiffness_limit(damping, wall_damping, period, delay);
  const Scalar by_step = position_step_stiffness_limit(friction, wall_damping, period, quantum);
  return by_step < by_hold || !is_finite(by_step) ? by_step : by_hold;
}

}  // namespace kmax::control
