#pragma once

#include <cstdint>

#include "host_tools/selftest/axis_facts.hpp"

namespace kmax::selftest {

/// A square wave of voltage that begins with a whole half at +voltage.
struct Pulse {
  double voltage = 0.0;           ///< V, amplitude; its sign is that of the first half
  std::uint32_t half_period = 0;  ///< ticks
  std::uint32_t duration = 0;     ///< ticks
  std::uint32_t ramp = 0;         ///< ticks in which the amplitude comes up
  double angle = 0.0;             ///< rad, electrical, in the stator's frame; a DC motor has none
};

/// How far a free handle without friction would go, m, if the current had this amplitude (A) at once.
///
/// Without ramp: the velocity rises to a T and falls back to zero (a acceleration, T half period): it moves
/// by a T^2 in every whole period and is at rest afterwards. With a ramp over several halves the velocity
/// swings evenly about zero, within +-a T/2, and the handle within a T^2/4. Real currents rise more slowly
/// and real handles have friction: both move less.
double bound_on_displacement(const AxisFacts& facts, const Pulse& pulse, double current);

/// A single period that moves a free handle by at most `displacement` (m) at `current` (A): its halves as
/// long as that allows, from 0.25 ms to 1 ms. If that is still too far, the voltage is smaller. The voltage
/// is what the claimed resistance asks for, at most 40 % of the supply.
Pulse plan_pulse(const AxisFacts& facts, double current, double displacement, double supply);

/// A long even swing of at most `displacement`: 20 halves of 0.5 to 4 ms, half of them the ramp. It ends in
/// the middle of a half, where the velocity is zero.
///
/// A synchronous motor has 12: in the stator's frame the force depends on where the rotor is, and a swing
/// pushes it, on average, to where there is none: by (2 pi n x)^2 / (8 l) at most in n periods of amplitude
/// x, l metres of handle per electrical radian. (Kapitza's pendulum; the swing also takes away the friction
/// that would hold it.)
Pulse plan_swing(const AxisFacts& facts, double current, double displacement, double supply);

}  // namespace kmax::selftest
