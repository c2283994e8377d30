#pragma once

#include <limits>

#include "control/finite.hpp"

namespace kmax::control {

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
