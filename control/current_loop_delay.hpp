#pragma once

namespace kmax::control {

/// How long the current loop takes from a force command to the force, s, beyond the hold of the command.
///
///   1/w + 0.65 tick        w: its -3 dB bandwidth, rad/s, up to current_bandwidth_ceiling()
///
/// At low frequency a loop of gain g (current_loop_gains.hpp) follows T/g behind, T the tick, and half a tick
/// of that is the hold, which the criteria count by themselves. 1/w alone would be the delay of a first-order
/// lag; the voltage's own half ticks come on top, while the PI controller holds the -3 dB point. Over all w
/// and L/R the sum lacks at most 0.611 ticks (at 9590 rad/s and 20 kHz, for a winding with L/R much longer
/// than a tick); the constant is above that and charges a fast winding up to half a tick too much
/// (tests/control/current_loop_delay_test.cpp).
///
/// Assumes gains for the winding as it is, and low frequencies: an R and L that are wrong move it.
template <typename Scalar>
constexpr Scalar current_loop_delay(Scalar bandwidth, Scalar tick_rate) {
  return Scalar(1) / bandwidth + Scalar(0.65) / tick_rate;
}

}  // namespace kmax::control
