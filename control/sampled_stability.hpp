#pragma once

#include <cstddef>
#include <limits>

#include "control/finite.hpp"
#include "control/sampled_loop.hpp"

namespace kmax::control {

/// True if each number of the loop is allowed: mass and period > 0, delay of 0 to 8 periods, none negative
/// but the wall's damping.
template <typename Scalar>
constexpr bool is_allowed(const SampledLoop<Scalar>& loop) {
  const Hand<Scalar>& h = loop.hand;
  if (!(loop.mass > Scalar(0) && loop.period > Scalar(0) && loop.damping >= Scalar(0))) return false;
  if (!(loop.delay >= Scalar(0) && loop.delay / loop.period <= Scalar(longest_delay))) return false;
  return h.hand_mass >= Scalar(0) && h.grip_stiffness >= Scalar(0) && h.grip_damping >= Scalar(0) &&
         h.arm_stiffness >= Scalar(0) && h.arm_damping >= Scalar(0);
}

/// True if the loop is one that can be judged: allowed, all finite, and nothing in it so fast that the
/// sample's transition overflows.
template <typename Scalar>
constexpr bool can_be_judged(const SampledLoop<Scalar>& loop) {
  return is_allowed(loop) && LoopEquation<Scalar>(loop).finite();
}

/// Routh's test: true if all zeros of the polynomial lie in the left half plane. A zero on the axis, as far
/// as rounding tells, is not.
template <typename Scalar, std::size_t order>
constexpr bool all_in_left_half_plane(LoopPolynomial<Scalar, order> p) {
  auto& c = p.coefficient;
  const Scalar sign = c[p.degree] < Scalar(0) ? Scalar(-1) : Scalar(1);
  for (std::size_t i = 0; i <= p.degree; ++i) {
    c[i] *= sign;
    if (!(c[i] > Scalar(0)) || !is_finite(c[i])) return false;
  }
  // Each step takes s times the next row from the first one, which lowers the degree by one.
  for (std::size_t k = p.degree; k > 1; --k) {
    const Scalar ratio = c[k] / c[k - 1];
    for (std::size_t j = k; j >= 1; j -= 2) {
      c[j] -= ratio * c[j - 1];
      if (j == 1) break;
    }
    if (!(c[k - 2] > Scalar(0))) return false;
  }
  return true;
}

/// Newtons per metre of the loop's gain kappa = 1: m/T^2.
template <typename Scalar>
constexpr Scalar stiffness_of_gain(const SampledLoop<Scalar>& loop, Scalar kappa) {
  return saturate(saturate(kappa / loop.period) * saturate(loop.mass / loop.period));
}

/// True if the loop with a wall of `stiffness` returns to rest from every state: all eigenvalues of its step
/// from one sample to the next lie inside the unit circle. A free handle (K = 0, nobody or no arm to hold it)
/// stays wherever it is put and is not stable in this sense. False for a loop that cannot be judged.
template <typename Scalar>
constexpr bool is_stable(const SampledLoop<Scalar>& loop, Scalar stiffness) {
  if (!can_be_judged(loop)) return false;
  const Scalar kappa = stiffness * (loop.period / loop.mass) * loop.period;
  return all_in_left_half_plane(LoopEquation<Scalar>(loop).half_plane_polynomial(kappa));
}

/// The smallest stiffness at which the loop is no longer stable, N/m: 0 < K < bound is stable, at the bound
/// an eigenvalue is on the unit circle. 0 if no small K is stable either (an undamped device; too much wall
/// damping) or if the loop cannot be judged. The stable set need not be this interval alone: with delay or a
/// lightly damped hand a stiffer wall may be stable again, and with an active wall damping (B < 0) only stiff
/// ones may be; such islands are not what a user wants to be sent to.
///
/// Method: K is linear in the characteristic equation, P_0 + K P_1 = 0, so an eigenvalue can be at the point
/// z of the unit circle for one K only, -P_0/P_1, if that is real. The circle is walked from tan(angle/2) =
/// 2^-40 to 2^20 by steps of 4.4 %; each change of sign of the imaginary part is bisected, also a pair of
/// them between two steps if the imaginary part shows a dip there; z = -1 is added. The smallest K > 0 is the
/// bound, if Routh's test finds K just below it stable, and 20 smaller ones, each half of the one before;
/// else the first loss among those is bisected. All loops are bounded.
///
/// Assumes a linear loop (sampled_loop.hpp). Says nothing of buzzing by quantization, and is too strict where
/// Coulomb friction holds the handle still (stiffness_limits.hpp, diolaiti_criterion.hpp).
///
/// Trust: at the bound in double, the spectral radius by an independent matrix exponential and QR is 1 within
/// 1e-9; the bound in float differs from that in double by less than 1e-4 for T from 0.05 to 4 ms
/// (tests/control/sampled_stability_test.cpp). A simulation decays at 0.99 and grows at 1.01 times the bound
/// in 1000 of 1000 random loops (tests/host_tools/simulation/sampled_stability_against_simulation_test.cpp).
/// Cost: about 20 us on a PC; 4 KB of code on a Cortex-M4 at -Os.
template <typename Scalar>
constexpr Scalar largest_stable_stiffness(const SampledLoop<Scalar>& loop);

/// The search itself, in gains kappa = K T^2/m. `Equation`: a LoopEquation.
template <typename Scalar, typename Equation = LoopEquation<Scalar>>
class StabilitySearch {
 public:
  constexpr explicit StabilitySearch(const Equation& equation) : equation_(equation) {}

  constexpr Scalar largest_stable_gain() {
    walk();
    constexpr int halvings = 20;
    const Scalar limit = lowest_ < std::numeric_limits<Scalar>::max() ? lowest_ : Scalar(4096);
    Scalar gain = limit * Scalar(0.9999);
    for (int i = 0; i < halvings; ++i) gain *= Scalar(0.5);
    Scalar good = 0;
    for (int i = 0; i <= halvings; ++i, gain *= Scalar(2)) {
      if (!stable(gain)) return good > Scalar(0) ? loss_between(good, gain) : Scalar(0);
      good = gain;
    }
    return lowest_;
  }

 private:
  struct Point {
    Scalar omega = 0;
    Scalar phase = 0;  // sine-like: imaginary part over the magnitude, in [-1, 1]
    Scalar gain = 0;   // kappa at a crossing
  };

  constexpr Point point(Scalar omega) const {
    const auto c = equation_.at(omega);
    const Scalar size = magnitude(c.real) + magnitude(c.imaginary);
    return {omega, size > Scalar(0) ? c.imaginary / size : Scalar(0),
            c.square > Scalar(0) ? -c.real / c.square : Scalar(0)};
  }

  constexpr bool stable(Scalar gain) const {
    return all_in_left_half_plane(equation_.half_plane_polynomial(gain));
  }

  constexpr Scalar loss_between(Scalar good, Scalar bad) const {
    for (int i = 0; i < std::numeric_limits<Scalar>::digits; ++i) {
      const Scalar middle = good + (bad - good) * Scalar(0.5);
      (stable(middle) ? good : bad) = middle;
    }
    return bad;
  }

  constexpr void note(Scalar gain) {
    if (gain > Scalar(0) && gain < lowest_) lowest_ = gain;
  }

  static constexpr bool opposite(const Point& a, const Point& b) {
    return (a.phase < Scalar(0)) != (b.phase < Scalar(0));
  }

  constexpr void bisect(Point low, Point high) {
    for (int i = 0; i < std::numeric_limits<Scalar>::digits; ++i) {
      const Point middle = point(low.omega + (high.omega - low.omega) * Scalar(0.5));
      (opposite(low, middle) ? high : low) = middle;
    }
    note(high.gain);
  }

  // a, b, c of one sign, b nearest to zero: looks for a pair of crossings between a and c.
  constexpr void look_into_dip(const Point& a, Point b, const Point& c) {
    Scalar left = a.omega, right = c.omega;
    for (int i = 0; i < 40; ++i) {
      // The longer side is probed near b; the smaller of the two stays in the middle.
      const bool to_right = right - b.omega > b.omega - left;
      const Point probe = point(b.omega + ((to_right ? right : left) - b.omega) * Scalar(0.381966));
      if (opposite(probe, a)) {
        bisect(a, probe);
        bisect(probe, c);
        return;
      }
      if (magnitude(probe.phase) < magnitude(b.phase)) {
        (to_right ? left : right) = b.omega;
        b = probe;
      } else {
        (to_right ? right : left) = probe.omega;
      }
    }
  }

  constexpr void walk() {
    constexpr Scalar first = Scalar(1) / Scalar(1099511627776.0), ratio = Scalar(1.04427378242741384);
    constexpr int steps = 60 * 16;
    Point before = point(first), last = before;
    for (int i = 0; i < steps; ++i) {
      const Point next = point(last.omega * ratio);
      if (opposite(last, next)) {
        if (last.gain > Scalar(0) || next.gain > Scalar(0)) bisect(last, next);
      } else if (last.gain > Scalar(0) && !opposite(before, last) &&
                 magnitude(last.phase) < magnitude(before.phase) &&
                 magnitude(last.phase) < magnitude(next.phase)) {
        look_into_dip(before, last, next);
      }
      before = last;
      last = next;
    }
    // tan(angle/2) beyond 2^20 is z = -1 as far as rounding tells.
    note(last.gain);
  }

  const Equation& equation_;
  Scalar lowest_ = std::numeric_limits<Scalar>::max();
};

template <typename Scalar>
constexpr Scalar largest_stable_stiffness(const SampledLoop<Scalar>& loop) {
  if (!can_be_judged(loop)) return Scalar(0);
  const LoopEquation<Scalar> equation(loop);
  const Scalar gain = StabilitySearch<Scalar>(equation).largest_stable_gain();
  return gain < std::numeric_limits<Scalar>::max() ? stiffness_of_gain(loop, gain) : gain;
}

}  // namespace kmax::control
