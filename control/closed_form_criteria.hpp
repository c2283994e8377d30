#pragma once

#include "control/diolaiti_criterion.hpp"
#include "control/finite.hpp"
#include "control/resolution_criterion.hpp"
#include "control/stability_case.hpp"
#include "control/stiffness_limits.hpp"

namespace kmax::control {

/// How deep the handle is in the wall when the commanded force meets the force limit, m.
///
///   d = (F_limit - F_MC)/K
///
/// F_limit: N; F_MC: the field's force at and inside the surface, N; K: N/m. Deeper than d the loop has no
/// stiffness at all, so a wall that reaches the limit within a few counts of the encoder is a switch, not a
/// spring: its oscillation is bounded by the limit and looks milder than it is, and a stiffness measured
/// there says nothing about K. 3 counts is the border used here (a choice, the same that counts as
/// oscillation in the experiments): 2 N, 8410 N/m and 3.3 N give 0.155 mm, just under three counts of 0.055
/// mm.
///
/// 0 if the field alone reaches the limit; the largest number if there is no spring.
template <typename Scalar>
constexpr Scalar saturation_depth(Scalar stiffness, Scalar magnetic_coefficient, Scalar force_limit) {
  const Scalar left = saturate(force_limit - magnetic_coefficient);
  return left <= Scalar(0) ? Scalar(0) : saturated_quotient(left, stiffness);
}

/// Quanta that the wall must be deep before it saturates.
inline constexpr int saturation_quanta = 3;

/// All criteria but the sampled eigenvalues, which need a search; for the target (1.3 KB of code at -Os).
///
///   criterion         value                    bound                           passes  applies with
///   colgate           K, N/m                   (b - |B|)/(T/2 + Td)            <       a wall (K or B not 0)
///   gil               K, N/m                   (b + B)/(T/2 + Td)              <       a wall
///   abbott_okamura    K, N/m                   min(2 b/T, step)                <=      a wall
///   diolaiti          v, m/s                   f_c/(K (T/2 + Td) - b)          <       K > 0, v > 0
///   resolution        K max(eta, delta v T), N F_h                             <=      K > 0, F_h > 0
///   resolution_speed  v, m/s                   F_h/(K delta T)                 <=      K, F_h, v > 0
///   field_slope       2 F_MC/x_0, N/m          min((b - |B|)/(T/2 + Td), step) <       F_MC > 0
///   saturation_depth  (F_limit - F_MC)/K, m    3 Delta                         >=      F_limit, K > 0
///
///   step = 2 (f_c/Delta - |B|/T)
///
/// abbott_okamura by itself guarantees nothing where Td > 0: its source has no delay, and 2 b/T takes none
/// into account. Where colgate is met its first part is met too; what it adds is the step, as in field_slope.
///
/// Finite inputs give finite values and bounds; what is not a number never passes where it is read. Float is
/// enough: a handful of roundings, 1e-6 of the bound. Outside the interrupt: one or two divisions each.
///
/// `judged`: bit n for criterion number n; the others do not apply, and cost no code.
template <typename Scalar, unsigned judged = ~0U>
constexpr CriterionResult<Scalar> judge_closed_form(Criterion criterion, const StabilityCase<Scalar>& c) {
  const auto below = [criterion](Scalar value, Scalar bound) {
    return CriterionResult<Scalar>{criterion, true, value < bound, false, value, bound};
  };
  const auto up_to = [criterion](Scalar value, Scalar bound) {
    return CriterionResult<Scalar>{criterion, true, value <= bound, false, value, bound};
  };
  constexpr auto left_out = [](Criterion one) { return (judged >> static_cast<unsigned>(one) & 1U) == 0; };
  // Written so that a NaN counts as something: it must reach the comparison and fail there.
  constexpr auto none = [](Scalar amount) { return amount <= Scalar(0); };
  const bool no_spring = none(c.stiffness);
  const bool no_wall = no_spring && c.wall_damping == Scalar(0);

  switch (criterion) {
    case Criterion::colgate:
      if (no_wall) break;
      return below(c.stiffness, colgate_stiffness_limit(c.damping, c.wall_damping, c.period, c.delay));
    case Criterion::gil:
      if (left_out(Criterion::gil) || no_wall) break;
      return below(c.stiffness, gil_stiffness_limit(c.damping, c.wall_damping, c.period, c.delay));
    case Criterion::abbott_okamura:
      if (no_wall) break;
      return up_to(c.stiffness, abbott_okamura_stiffness_limit(c.damping, c.friction, c.period, c.quantum,
                                                               c.wall_damping));
    case Criterion::diolaiti:
      if (left_out(Criterion::diolaiti) || no_spring || none(c.operator_speed)) break;
      return below(c.operator_speed, escape_speed(c.stiffness, c.damping, c.friction,
                                                  period_with_delay(c.period, c.delay), c.quantum));
    case Criterion::resolution:
      if (no_spring || none(c.operator_force)) break;
      return up_to(force_step(c.stiffness, c.quantum, c.detection_share, c.operator_speed, c.period),
                   c.operator_force);
    case Criterion::resolution_speed:
      if (no_spring || none(c.operator_force) || none(c.operator_speed)) break;
      return up_to(c.operator_speed,
                   contact_speed_limit(c.stiffness, c.detection_share, c.period, c.operator_force));
    case Criterion::field_slope:
      if (none(c.magnetic_coefficient)) break;
      return below(steepest_field_slope(c.magnetic_coefficient, c.magnetic_length),
                   field_slope_limit(c.damping, c.wall_damping, c.friction, c.period, c.delay, c.quantum));
    case Criterion::saturation_depth: {
      if (left_out(Criterion::saturation_depth) || no_spring || none(c.force_limit)) break;
      const Scalar depth = saturation_depth(c.stiffness, c.magnetic_coefficient, c.force_limit);
      const Scalar least = saturate(c.quantum * Scalar(saturation_quanta));
      return {criterion, true, depth >= least, true, depth, least};
    }
    case Criterion::sampled_eigenvalues:
      break;
  }
  return {criterion, false, true, criterion == Criterion::saturation_depth, Scalar(0), Scalar(0)};
}

}  // namespace kmax::control
