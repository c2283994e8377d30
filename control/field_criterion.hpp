#pragma once

#include "control/abbott_okamura_criterion.hpp"
#include "control/colgate_criterion.hpp"
#include "control/saturated_quotient.hpp"

namespace kmax::control {

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

/// What that slope must stay below, N/m: Colgate's bound (colgate_criterion.hpp), and the position's step
/// held by friction, 2 (f_c/Delta - |B|/T) (abbott_okamura_criterion.hpp), since the field steps by up to its
/// slope times Delta: 2 N over 0.2 mm by 1.1 N at 0.055 mm. B acts inside only, but sets in at the surface,
/// where the slope is.
template <typename Scalar>
constexpr Scalar field_slope_limit(Scalar damping, Scalar wall_damping, Scalar friction, Scalar period,
                                   Scalar delay, Scalar quantum) {
  const Scalar by_hold = colgate_stiffness_limit(damping, wall_damping, period, delay);
  const Scalar by_step = position_step_stiffness_limit(friction, wall_damping, period, quantum);
  return by_step < by_hold || !is_finite(by_step) ? by_step : by_hold;
}

}  // namespace kmax::control
