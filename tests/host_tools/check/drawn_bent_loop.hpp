#pragma once
// Random loops of a device that bends, and what is known of them without a characteristic polynomial.

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_tools/check/bent_loop.hpp"
#include "tests/control/drawn_loop.hpp"
#include "tests/control/step_matrix.hpp"

namespace kmax::check {

// The motor's side as control::LoopDraw has it, and a structure from as soft as a hand to far stiffer than
// any wall, a quarter of them without damping; tips from far lighter to far heavier than the motor's side.
inline BentLoop drawn_bent_loop(control::LoopDraw& draw) {
  BentLoop loop;
  loop.motor_side = draw.loop();
  loop.structure.stiffness = draw.log_uniform(300.0, 1e6);
  loop.structure.handle_mass = draw.log_uniform(1e-3, 0.5);
  loop.structure.damping = draw.uniform(0.0, 1.0) < 0.25 ? 0.0 : draw.log_uniform(0.01, 10.0);
  return loop;
}

// Spectral radius of the step from one sample to the next. In long double: in double QR alone errs by 1e-6
// where the structure is stiffest.
inline double radius_by_eigenvalues(const BentLoop& loop, double stiffness) {
  using Number = long double;
  const auto& [mass, damping, wall_damping, period, delay, hand] = loop.motor_side;
  const bool held = hand.hand_mass > 0.0;
  const int n = held ? 6 : 4;  // motor's side, tip, hand: place and velocity of each
  control::Square<Number> rate = control::Square<Number>::Zero(n + 1, n + 1);
  for (int i = 0; i < n; i += 2) rate(i, i + 1) = 1;
  // A spring and a damper between two of them; `to` at the end: to where nothing moves.
  const auto join = [&](int from, int to, double spring, double damper, double from_mass, double to_mass) {
    const auto push = [&](int row, int other, double on) {
      rate(row + 1, row) -= Number(spring) / on;
      rate(row + 1, row + 1) -= Number(damper) / on;
      if (other >= n) return;
      rate(row + 1, other) += Number(spring) / on;
      rate(row + 1, other + 1) += Number(damper) / on;
    };
    push(from, to, from_mass);
    if (to < n) push(to, from, to_mass);
  };
  const simulation::StructureModel& s = loop.structure;
  join(0, n, 0.0, damping, mass, 0.0);
  join(0, 2, s.stiffness, s.damping, mass, s.handle_mass);
  if (held) {
    join(2, 4, hand.grip_stiffness, hand.grip_damping, s.handle_mass, hand.hand_mass);
    join(4, n, hand.arm_stiffness, hand.arm_damping, hand.hand_mass, 0.0);
  }
  rate(1, n) = 1 / Number(mass);
  const auto step = control::step_matrix_of<Number>(rate, loop.motor_side, stiffness);
  return static_cast<double>(step.eigenvalues().cwiseAbs().maxCoeff());
}

}  // namespace kmax::check
