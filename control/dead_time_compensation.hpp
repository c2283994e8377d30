#pragma once

#include <algorithm>

#include "control/finite.hpp"

namespace kmax::control {

/// The current that ends within the dead time: below it, all of the supply drives it to zero while both FETs
/// are off. A; supply V, dead_time s, inductance H > 0 as one leg's current sees it: L of a DC motor, three
/// quarters of L_d + L_q of a synchronous one. Outside the interrupt.
template <typename Scalar>
constexpr Scalar dead_time_band(Scalar supply, Scalar dead_time, Scalar inductance) {
  return supply * dead_time / inductance;
}

/// What the dead time between the two FETs of a leg takes from its duty, given back.
///
/// While both FETs are off the current itself decides where the leg's voltage is: a current that flows into
/// the motor pulls it down, one that flows out pushes it up. Of the two edges of a period one comes late by
/// the dead time t_d, and the leg loses (or gains) the share f t_d of the period. Around zero, where the
/// current ends within the dead time, the loss passes smoothly from one sign to the other, and so does what
/// is given back:
///
///     share(i) = f t_d clamp(i / band, -1, 1) = f t_d (|i + band| - |i - band|) / (2 band)
///
/// The second form needs no comparison, has no corner case, and stays finite for every finite i.
///
/// Which current: the controllers take the REFERENCE. Taken from the measured current the same formula is a
/// positive feedback, a negative resistance of supply x f t_d / band per leg: it multiplies noise within the
/// band and, where it exceeds the winding's resistance, latches; from the reference it is a feed-forward that
/// no value of its parameters can make unstable. docs/current_control.md has the two side by side.
///
/// Cost: 7 Cortex-M4F instructions for each leg.
template <typename Scalar>
struct DeadTimeCompensation {
  /// More than a tenth of the period is taken as that: a mistake, not a dead time.
  static constexpr Scalar largest_share = Scalar(0.1);

  Scalar band = Scalar(1);  ///< A
  Scalar gain{};            ///< 1/A: share / (2 band)
  Scalar share{};           ///< f t_d, of the period
  bool active = false;

  /// Outside the interrupt. dead_time: s, 0 = off. current: A, > 0, the band: dead_time_band() at
  /// least; narrower than it is too much of a good thing near zero. frequency: Hz. Anything else than
  /// positive numbers switches it off.
  static constexpr DeadTimeCompensation prepare(Scalar dead_time, Scalar current, Scalar frequency) {
    DeadTimeCompensation c;
    const Scalar lost = std::min(largest_share, dead_time * frequency);
    const Scalar gain = lost * Scalar(0.5) / current;
    if (!(dead_time > Scalar(0)) || !(frequency > Scalar(0)) || !(current > Scalar(0)) || !is_finite(gain))
      return c;
    c.band = current;
    c.gain = gain;
    c.share = lost;
    c.active = true;
    return c;
  }

  /// To be added to the duty of the leg out of which `current` (A) flows into the motor; within +-share.
  constexpr Scalar of(Scalar current) const {
    return gain * (magnitude(current + band) - magnitude(current - band));
  }
};

}  // namespace kmax::control
