#pragma once
// Where a function of time passes through zero, for integrators that can only be asked for its values.

namespace kmax::simulation {

// A zero of `value` between `low`, where it is positive, and `high`, where it is not: regula falsi in the
// Illinois form (the value at an end that stays is halved), bisection after 40 steps, at most 100; to 1e-15
// of the bracket's upper end. Returns the upper end of the last bracket: the event has just happened.
template <typename Value>
double falling_zero_of(const Value& value, double low, double high) {
  double at_low = value(low);
  double at_high = value(high);
  if (!(at_low > 0.0)) return low;
  if (at_high >= 0.0) return high;
  int side = 0;
  for (int n = 0; n < 100 && high - low > 1e-15 * high; ++n) {
    double middle = (low * at_high - high * at_low) / (at_high - at_low);
    if (n >= 40 || !(middle > low && middle < high)) middle = 0.5 * (low + high);
    const double at_middle = value(middle);
    if (at_middle == 0.0) return middle;
    if (at_middle > 0.0) {
      if (side > 0) at_high *= 0.5;
      low = middle;
      at_low = at_middle;
      side = 1;
    } else {
      if (side < 0) at_low *= 0.5;
      high = middle;
      at_high = at_middle;
      side = -1;
    }
  }
  return high;
}

// `value` starts at zero at time 0 and is negative at `end`: a time at which it is positive in between, for
// falling_zero_of; or -1 if there is none down to 2^-40 of the time.
template <typename Value>
double moving_start(const Value& value, double end) {
  double t = end;
  for (int n = 0; n < 40; ++n) {
    t *= 0.5;
    if (value(t) > 0.0) return t;
  }
  return -1.0;
}

}  // namespace kmax::simulation
