#pragma once

#include <cstdint>
#include <limits>

#include "control/finite.hpp"

namespace kmax::control {

/// Regions of a sampled, quantized spring on a mass with viscous and Coulomb friction (Diolaiti, Niemeyer,
/// Barbagli & Salisbury, "Stability of haptic rendering: discretization, quantization, time delay, and
/// Coulomb effects", IEEE Trans. Robotics 22(2), 2006), by two numbers without dimension:
///
///   beta = b/(K T)         viscous damping against what the hold injects
///   sigma = f_c/(K Delta)  friction against one step of the force
enum class DiolaitiRegion : std::uint8_t {
  passive,         ///< beta >= 1/2, sigma >= 1/2: no energy is made at any speed
  limit_cycle,     ///< beta >= 1/2, sigma < 1/2: the handle buzzes with a bounded amplitude
  locally_stable,  ///< beta < 1/2, sigma >= 1/2: comes to rest if slower than the escape speed
  unstable,        ///< both below 1/2
};

/// The period that injects as much as one of `period` with a `delay` beyond the hold: a force that is on the
/// average T/2 + Td old injects K (T/2 + Td) v^2.
template <typename Scalar>
constexpr Scalar period_with_delay(Scalar period, Scalar delay) {
  return saturate(period + saturate(Scalar(2) * delay));
}

/// b, f_c of the device, N s/m and N; K, N/m; T, s; Delta, m. Nothing is divided: K = 0, T = 0, Delta = 0 are
/// passive in their part. Assumes: a rigid device, no wall damping, nobody holding it; a hand adds damping
/// and enlarges the stable regions. A delay Td is counted by giving period_with_delay() for T.
template <typename Scalar>
constexpr DiolaitiRegion diolaiti_region(Scalar stiffness, Scalar damping, Scalar friction, Scalar period,
                                         Scalar quantum) {
  const bool slow_enough = damping >= stiffness * (period * Scalar(0.5));
  const bool fine_enough = friction >= stiffness * (quantum * Scalar(0.5));
  if (slow_enough) return fine_enough ? DiolaitiRegion::passive : DiolaitiRegion::limit_cycle;
  return fine_enough ? DiolaitiRegion::locally_stable : DiolaitiRegion::unstable;
}

/// The speed from which friction no longer brings the handle to rest, m/s: the hold injects K T/2 v^2 on the
/// average, viscous damping takes b v^2 and friction f_c v, equal at
///
///   v* = f_c/(K T/2 - b)
///
/// Own derivation from that balance, for a steady speed. The peak of an oscillation escapes from 4/pi v* on,
/// because friction then takes f_c V 2/pi and the rest goes with V^2/2; a simulation without quantization
/// comes to rest from 0.9 and runs away from 1.1 times that
/// (tests/host_tools/simulation/sampled_stability_against_simulation_test.cpp), so v* errs to the safe side
/// by a fifth. The largest number if K T/2 <= b (nothing to escape from); 0 if sigma < 1/2, where the handle
/// does not rest.
template <typename Scalar>
constexpr Scalar escape_speed(Scalar stiffness, Scalar damping, Scalar friction, Scalar period,
                              Scalar quantum) {
  constexpr Scalar largest = std::numeric_limits<Scalar>::max();
  switch (diolaiti_region(stiffness, damping, friction, period, quantum)) {
    case DiolaitiRegion::passive:
      return largest;
    case DiolaitiRegion::locally_stable: {
      const Scalar injected = saturate(stiffness * (period * Scalar(0.5))) - damping;
      return saturate(friction / injected);
    }
    case DiolaitiRegion::limit_cycle:
    case DiolaitiRegion::unstable:
      break;
  }
  return Scalar(0);
}

}  // namespace kmax::control
