#pragma once

#include "control/saturated_quotient.hpp"

namespace kmax::control {

/// The steepest slope of the repulsive field in front of the wall, N/m.
///
///   F = F_MC/(s/x_0 + 1)^2,  -dF/ds = 2 F_MC/x_0 at the surface s = 0     (paper 1, eq. 5 differentiated)
///
/// F_MC: field coefficient, N; x_0: field length, m. At a point the sampled loop cannot tell this slope from
/// a spring, so it must pass the same bound as K (colgate_criterion.hpp). 2 N over 1 mm are 4000 N/m: more
/// than many walls.
///
/// Sufficient, not necessary: the slope is that steep only at the surface, an eighth of it one x_0 away. An
/// adaptive coefficient adds a damping dF/dv (of either sign) that is not in here.
///
/// 0 without a field; the largest number if x_0 is 0.
template <typename Scalar>
constexpr Scalar steepest_field_slope(Scalar magnetic_coefficient, Scalar magnetic_length) {
  return saturated_quotient(magnetic_coefficient, magnetic_length * Scalar(0.5));
}

}  // namespace kmax::control
