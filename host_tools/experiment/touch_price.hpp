#pragma once
// What a wall costs and gives the person who touches it, of one touch. Nothing here computes how it is rated.

#include "host_tools/experiment/simulated_touch.hpp"

namespace kmax::experiment {

struct TouchPrice {
  double field_at_rest = 0.0;  ///< N, on a handle that rests on the surface
  double work = 0.0;           ///< J, against the field until the surface is met
  double depth = 0.0;          ///< m, deepest in the wall, from the first contact to the end of the hold
  /// N/m, see rate_hardness.hpp; 0 if the wall was not met, or is left sooner.
  double rate_hardness = 0.0;
  double peak_force = 0.0;  ///< N, the most that the wall and its field push with, until the end of the hold
  /// J, from the start to the end of the hold, against field and wall: what is stored and what has been
  /// damped. What they give back counts as negative; below 0 the touch has got more than it gave.
  double touch_work = 0.0;
};

/// Errors: those of simulate_touch(). The surface is at 0, free space above.
TouchPrice price_of(const TouchSetup& setup);

}  // namespace kmax::experiment
