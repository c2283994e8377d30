#pragma once

#include "control/finite.hpp"

namespace kmax::control {

/// The share of a current limit that is left at a temperature: 1 up to `start`, 0 from `limit` on, a straight
/// line between them; degC all three. Never rises with the temperature, and has no step as long as start <
/// limit (with start >= limit it falls from 1 to 0 at `limit`).
///
/// Heat goes with the current's square, so a model that predicts the winding settles on this line at the
/// current that can be kept up; it does not hunt, since the winding's heat capacity lies between.
///
/// A temperature or a bound that is not finite gives 0: no current by a broken sensor. Outside the interrupt:
/// one division.
template <typename Scalar>
constexpr Scalar thermal_derating(Scalar temperature, Scalar start, Scalar limit) {
  if (!is_finite(temperature) || !is_finite(start) || !is_finite(limit)) return Scalar(0);
  if (temperature >= limit) return Scalar(0);
  if (temperature <= start || start >= limit) return Scalar(1);
  // Halved, so that bounds far apart do not overflow; exact otherwise.
  const Scalar half = Scalar(0.5);
  return (limit * half - temperature * half) / (limit * half - start * half);
}

}  // namespace kmax::control
