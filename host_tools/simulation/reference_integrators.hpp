#pragma once
// Three integrators from the textbooks for the equations of chain_dynamics.hpp, to compare the exact method
// of coupled_handle.hpp with. Each advances `state` by `duration` under a force that is held and an intended
// position that moves on a straight line. Coulomb friction with true stick in each: mass 0 rests, with a
// velocity of exactly 0, while what acts on it sums to no more than the friction force, and slides otherwise.
//
//   integrate_semi_implicit_euler   velocities first, then positions with the new velocities. Order 1. A step
//                                   that would turn mass 0 round ends in stick if friction can hold it, and
//                                   otherwise continues backwards from the instant of rest.
//   integrate_rk4                   the classical Runge-Kutta method. Order 4 between events. A step that
//                                   would turn mass 0 round is divided where its velocity is 0; there it
//                                   sticks or goes on. Break-away is only looked for at the beginning of a
//                                   step: order 2 where it happens.
//   integrate_adaptive              Dormand and Prince's method of order 5 with step control and dense
//                                   output, from Boost.Odeint. Stops and break-aways are both located:
//                                   bracketed on the dense output at 8 points per step and at the lowest ones
//                                   between them, then by repeating the step up to the instant.
//
// A velocity that dips through zero and back within one step of a fixed-step method is overlooked; so is, by
// the adaptive one, a dip that its 8 points do not suggest. docs/speed_and_error.md compares speed and error
// of all three with the exact method.
//
// `step` is the longest step in seconds: the duration is divided into equal ones. `tolerance` bounds the
// local error of each step, relative to each position and velocity, plus a floor of 1e-3 of it in m and m/s.
//
// Errors: std::invalid_argument for a chain, state, input or duration (0, 10] s that cannot be, for more than
// 1e9 steps, for a tolerance outside [1e-14, 1e-2]; std::runtime_error if the adaptive method needs more than
// 1e6 steps or cannot meet the tolerance because rounding is larger. The state is as before after an error.
// No heap, no state between calls: the same arguments give the same bits.

#include "host_tools/simulation/chain_dynamics.hpp"

namespace kmax::simulation {

void integrate_semi_implicit_euler(const ChainDynamics& dynamics, ChainState& state, const ChainInput& input,
                                   double duration, double step);

void integrate_rk4(const ChainDynamics& dynamics, ChainState& state, const ChainInput& input, double duration,
                   double step);

void integrate_adaptive(const ChainDynamics& dynamics, ChainState& state, const ChainInput& input,
                        double duration, double tolerance);

}  // namespace kmax::simulation
