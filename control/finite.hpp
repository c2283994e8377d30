#pragma once

#include <limits>

namespace kmax::control {

/// True if `value` is neither an infinity nor a NaN. Without libm: infinity minus infinity and any
/// arithmetic on a NaN give a NaN, which differs from everything, zero included. Two instructions on a
/// Cortex-M4F. Relies on IEEE 754 arithmetic; the build never uses -ffast-math.
template <typename Scalar>
constexpr bool is_finite(Scalar value) {
  return value - value == Scalar(0);
}

/// Both are, with one comparison.
template <typename Scalar>
constexpr bool are_finite(Scalar one, Scalar other) {
  return one - one == other - other;
}

/// |value|, one instruction; the magnitude of a NaN is a NaN.
constexpr float magnitude(float value) {
  return __builtin_fabsf(value);
}
constexpr double magnitude(double value) {
  return __builtin_fabs(value);
}

/// `value` bounded to [-limit, limit]. A NaN stays a NaN so that a later is_finite() sees it.
template <typename Scalar>
constexpr Scalar clamp_magnitude(Scalar value, Scalar limit) {
  if (magnitude(value) <= limit) [[likely]]
    return value;
  if (value > limit) return limit;
  if (value < -limit) return -limit;
  return value;
}

/// A share brought into 0 .. 1; a NaN gives 1.
template <typename Scalar>
constexpr Scalar bounded_share(Scalar share) {
  if (!(share < Scalar(1))) return Scalar(1);
  return share > Scalar(0) ? share : Scalar(0);
}

/// `value` with an overflow to infinity brought back to the largest finite number; NaN stays a NaN.
template <typename Scalar>
constexpr Scalar saturate(Scalar value) {
  return clamp_magnitude(value, std::numeric_limits<Scalar>::max());
}

/// numerator / denominator for bounds, denominator >= 0: what is infinite is the largest number instead, with
/// the numerator's sign. 0 / 0 is 0. A NaN stays a NaN, so that no comparison with it passes.
template <typename Scalar>
constexpr Scalar saturated_quotient(Scalar numerator, Scalar denominator) {
  if (numerator == Scalar(0) && denominator == Scalar(0)) return Scalar(0);
  if (denominator == Scalar(0)) {
    constexpr Scalar largest = std::numeric_limits<Scalar>::max();
    return numerator > Scalar(0) ? largest : numerator < Scalar(0) ? -largest : numerator;
  }
  return saturate(numerator / denominator);
}

}  // namespace kmax::control
