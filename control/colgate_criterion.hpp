#pragma once

#include "control/finite.hpp"
#include "control/saturated_quotient.hpp"

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
/// between those; thousands of random passive hands were stable below it (tests).
///
/// Does not hold as a limit of stability: with friction or a hand, walls many times stiffer are stable
/// (sampled_stability.hpp, diolaiti_criterion.hpp). Nor is it sufficient with coarse quantization
/// (abbott_okamura_criterion.hpp) or an elastic structure.
///
/// Returns the K that must not be reached, N/m: (b - |B|)/(T/2 + Td), negative if |B| > b; the largest number
/// if T and Td are 0.
template <typename Scalar>
constexpr Scalar colgate_stiffness_limit(Scalar damping, Scalar wall_damping, Scalar period, Scalar delay) {
  return saturated_quotient(saturate(damping - magnitude(wall_damping)), period * Scalar(0.5) + delay);
}

}  // namespace kmax::control
