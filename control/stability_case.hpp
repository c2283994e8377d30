#pragma once

#include <cstddef>
#include <cstdint>

#include "control/hand_impedance.hpp"

namespace kmax::control {

/// The criteria, in the order of their numbers; each has a header with its formula, assumptions and source.
enum class Criterion : std::uint8_t {
  colgate = 0,              ///< stiffness_limits.hpp
  gil = 1,                  ///< stiffness_limits.hpp
  sampled_eigenvalues = 2,  ///< sampled_stability.hpp
  abbott_okamura = 3,       ///< stiffness_limits.hpp
  diolaiti = 4,             ///< diolaiti_criterion.hpp
  resolution = 5,           ///< resolution_criterion.hpp
  resolution_speed = 6,     ///< resolution_criterion.hpp
  field_slope = 7,          ///< stiffness_limits.hpp
  saturation_depth = 8,     ///< closed_form_criteria.hpp
};
inline constexpr std::size_t criterion_count = 9;

/// A wall on a device in somebody's hand, as far as it is known. SI. 0 means "none", or "not known" where
/// said. All >= 0 but wall_damping.
template <typename Scalar>
struct StabilityCase {
  Scalar stiffness = 0;             ///< K, N/m
  Scalar wall_damping = 0;          ///< B, N s/m; may be negative
  Scalar magnetic_coefficient = 0;  ///< F_MC, N: the largest that the law can command; 0 without a field
  Scalar magnetic_length = 0;       ///< x_0, m
  Scalar period = 0;                ///< T, s
  Scalar delay = 0;                 ///< Td, s: from a sample to its force, beyond the hold
  Scalar quantum = 0;               ///< m, the position step in use (not below the encoder's count)
  Scalar mass = 0;                  ///< m, kg, of the device; 0: not known
  Scalar damping = 0;               ///< b, N s/m, of the device
  Scalar friction = 0;              ///< f_c, N, of the device
  Scalar operator_force = 0;        ///< F_h, N; 0: not known
  Scalar operator_speed = 0;        ///< v, m/s; 0: not known
  Scalar detection_share = 1;       ///< delta of paper 2, 0 .. 1
  Scalar force_limit = 0;           ///< N; 0: none
  Hand<Scalar> hand;                ///< hand_mass = 0: nobody holds it
};

template <typename Scalar>
struct CriterionResult {
  Criterion criterion = Criterion::colgate;
  bool applies = false;   ///< false: needs something that is not known, or there is nothing to judge
  bool pass = true;       ///< true where it does not apply
  bool at_least = false;  ///< the bound is a minimum
  Scalar value = 0;
  Scalar bound = 0;  ///< an infinite one is the largest number
};

}  // namespace kmax::control
