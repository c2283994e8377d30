#pragma once
// The first downward crossing of a polynomial on the unit interval: where a velocity given as a Taylor series
// reaches zero, or where a force margin is used up.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace kmax::simulation {

// p(t) = c[0] + c[1] t + ... + c[order] t^order.
inline double polynomial_at(const double* c, int order, double t) {
  double sum = c[order];
  for (int n = order - 1; n >= 0; --n) sum = sum * t + c[n];
  return sum;
}

inline double polynomial_slope_at(const double* c, int order, double t) {
  double sum = order * c[order];
  for (int n = order - 1; n >= 1; --n) sum = sum * t + n * c[n];
  return order == 0 ? 0.0 : sum;
}

// A value that no crossing has: "there is none on the unit interval".
inline constexpr double no_crossing = 2.0;

// The zero of a polynomial that falls monotonically from p(low) >= 0 to p(high) <= 0: Newton steps, and
// bisection whenever a step would leave the bracket. At most 100 evaluations (2^-100 is below any double
// spacing in [0, 1]).
inline double falling_zero(const double* c, int order, double low, double high) {
  double t = low + (high - low) * 0.5;
  for (int step = 0; step < 100; ++step) {
    const double value = polynomial_at(c, order, t);
    if (value == 0.0) return t;
    (value > 0.0 ? low : high) = t;
    const double slope = polynomial_slope_at(c, order, t);
    const double newton = t - value / slope;  // a zero slope gives inf or NaN, which the bracket test refuses
    const double next = newton > low && newton < high ? newton : low + (high - low) * 0.5;
    if (next == t || next <= low || next >= high) return next;
    if (std::abs(next - t) <= 1e-16) return next;
    t = next;
  }
  return t;
}

// Smallest t in [0, 1] at which p passes from >= 0 to < 0 (or reaches 0 while falling), else no_crossing.
// Precondition: p(0) >= 0, 1 <= order <= 23. A p(0) of exactly 0 with a positive slope is a start, not a
// crossing.
//
// Marches from 0 in pieces that are proven free of zeros or proven monotone by the size of the polynomial's
// terms about the piece's left end; a piece that is neither is halved. A double zero (a graze) cannot be
// proven either way: below a width of 2^-40 the sign at the end of the piece decides, so a dip shallower than
// about |p''| 2^-82 is overlooked. At most 1000 attempts (a graze takes about 100); then the sign at 1
// decides. Cost: about order operations for the usual case of one piece, order^2 / 2 for each further one.
inline double first_crossing(const double* c, int order) {
  std::array<double, 24> local;  // p about `low`
  for (int n = 0; n <= order; ++n) local[static_cast<std::size_t>(n)] = c[n];
  double low = 0.0;
  double width = 1.0;
  for (int attempt = 0; attempt < 1000 && low < 1.0; ++attempt) {
    const double length = std::min(width, 1.0 - low);
    double change = 0.0;        // bound on |p - p(low)| / length over the piece
    double slope_change = 0.0;  // bound on |p' - p'(low)| over the piece
    double power = 1.0;
    for (int n = 1; n <= order; ++n) {
      const double term = std::abs(local[static_cast<std::size_t>(n)]) * power;
      change += term;
      if (n > 1) slope_change += n * term;
      power *= length;
    }
    const double slope = local[1];
    const bool free_of_zeros = local[0] > change * length || slope >= slope_change;
    if (!free_of_zeros) {
      const bool falling = slope + slope_change <= 0.0;
      if (!falling && length >= 0x1p-40) {
        width = length * 0.5;
        continue;
      }
      const double end = polynomial_at(local.data(), order, length);
      if (end < 0.0 || (end == 0.0 && slope < 0.0))
        return low + falling_zero(local.data(), order, 0.0, length);
    }
    // Move on: expand about the right end of the piece (Taylor shift by repeated synthetic division).
    low += length;
    width = length * 2.0;
    if (low >= 1.0) break;
    for (int first = 0; first < order; ++first) {
      for (int n = order - 1; n >= first; --n) {
        local[static_cast<std::size_t>(n)] += length * local[static_cast<std::size_t>(n) + 1];
      }
    }
    local[0] = std::max(0.0, local[0]);
  }
  if (low < 1.0 && polynomial_at(c, order, 1.0) < 0.0) return falling_zero(c, order, low, 1.0);
  return no_crossing;
}

}  // namespace kmax::simulation
