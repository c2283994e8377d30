#pragma once

#include <algorithm>

namespace kmax::control {

/// 1 - e^-x for x >= 0, to a few units in the last place and without the cancellation of the literal form.
/// Additions and multiplications only. Outside the interrupt: up to 12 halvings.
template <typename Scalar>
constexpr Scalar one_minus_exponential(Scalar x) {
  if (!(x > Scalar(0))) return Scalar(0);
  if (x >= Scalar(64)) return Scalar(1);
  int halvings = 0;
  for (; x > Scalar(0.125); ++halvings) x = x * Scalar(0.5);
  Scalar sum = Scalar(0);
  for (int term = 12; term >= 2; --term) sum = x / static_cast<Scalar>(term) * (Scalar(1) - sum);
  Scalar result = x * (Scalar(1) - sum);
  for (; halvings > 0; --halvings) result = result * (Scalar(2) - result);
  return result;
}

/// 1 - cos x for 0 <= x <= 1, to a few units in the last place, without the cancellation of the literal form.
template <typename Scalar>
constexpr Scalar one_minus_cosine(Scalar x) {
  const Scalar square = x * x;
  Scalar sum = Scalar(1);
  for (int power = 16; power >= 4; power -= 2)
    sum = Scalar(1) - sum * square / static_cast<Scalar>((power - 1) * power);
  return square * Scalar(0.5) * sum;
}

/// The square root by Newton's iteration, for `value` >= 0: usable by the compiler. Outside the interrupt.
template <typename Scalar>
constexpr Scalar square_root_by_iteration(Scalar value) {
  if (!(value > Scalar(0))) return Scalar(0);
  Scalar root = value > Scalar(1) ? value : Scalar(1);  // from above: it falls until rounding stops it
  for (int step = 0; step < 200; ++step) {
    const Scalar next = Scalar(0.5) * (root + value / root);
    if (!(next < root)) break;
    root = next;
  }
  return root;
}

/// The highest bandwidth that a current controller is designed for, rad/s: an eighth of the sampling
/// frequency (2.5 kHz at 20 kHz). `period`: s per tick.
template <typename Scalar>
constexpr Scalar current_bandwidth_ceiling(Scalar period) {
  return Scalar(0.7853981633974483) / period;
}

/// PI gains of a current loop from what the winding is and where its closed loop shall have its -3 dB.
///
/// The currents are sampled in the middle of the PWM period, the duty computed from them is taken over at the
/// period's end: it is active from half a tick after the sample until half a tick after the next. For a
/// winding of R and L that gives, exactly and for every L/R,
///     i_{k+1} = h^2 i_k + (1 - h)/R (v_k + h v_{k-1}),   h = e^(-R T / 2L).
/// A PI controller whose zero lies on the winding's pole a = h^2,
///     v = kp e + x,   x += (1 - a) kp e,
/// leaves the open loop
///     G(z) = g/(1 + h) (z + h) / (z (z - 1)),   g = kp (1 - a) / R.
/// The closed loop's gain |G/(1 + G)|^2 = 1/2 at z = e^(j w T) is a quadratic equation in g:
///     y^2 n - 2 y b - m = 0,   y = g/(1 + h),
///     n = |z + h|^2 = 1 + 2 h c + h^2,   m = |z (z - 1)|^2 = 2 (1 - c),   c = cos w T
///     b = Re((z + h) conj(z (z - 1))) = -(1 - c)(1 + h (1 + 2 c)).
/// Its positive root is taken. So the -3 dB frequency, from reference to sampled current, is the one that was
/// asked for, up to the ceiling; bandwidths above it are taken as it. At the ceiling g is 0.43 for a slow
/// winding and 0.53 for one that settles within a tick. docs/current_control.md: requested and measured
/// bandwidth, overshoot, and both with R and L wrong by 30 %.
template <typename Scalar>
struct CurrentLoopGains {
  Scalar proportional{};  ///< kp, V/A
  Scalar tracking{};      ///< 1 - a = ki T / kp, per tick: how fast the integrator follows the voltage

  /// g of the open loop whose closed loop has -3 dB at `angle` = w T, 0 .. pi/4. `kept`: h, 0 .. 1.
  static constexpr Scalar loop_gain(Scalar angle, Scalar kept) {
    const Scalar versine = one_minus_cosine(angle);
    const Scalar cosine = Scalar(1) - versine;
    const Scalar numerator = Scalar(1) + kept * (Scalar(2) * cosine + kept);
    const Scalar denominator = Scalar(2) * versine;
    const Scalar mixed = versine * (Scalar(1) + kept * (Scalar(1) + Scalar(2) * cosine));  // -b
    const Scalar root = square_root_by_iteration(mixed * mixed + numerator * denominator);
    return (Scalar(1) + kept) * (root - mixed) / numerator;
  }

  /// Outside the interrupt. resistance ohm >= 0, inductance H >= 0, not both 0 (that gives gains of 0);
  /// bandwidth rad/s > 0; period s > 0.
  static constexpr CurrentLoopGains prepare(Scalar resistance, Scalar inductance, Scalar bandwidth,
                                            Scalar period) {
    const Scalar ceiling = current_bandwidth_ceiling(period);
    const Scalar angle = std::min(ceiling, bandwidth) * period;
    CurrentLoopGains gains;
    if (inductance > Scalar(0)) {
      const Scalar ticks = resistance * period / inductance;  // T R/L
      const Scalar gain = loop_gain(angle, Scalar(1) - one_minus_exponential(ticks * Scalar(0.5)));
      gains.tracking = one_minus_exponential(ticks);
      // Below this the quotient tracking / ticks is 1 in float, and the resistance may be 0.
      gains.proportional =
          ticks > Scalar(1e-8) ? resistance * gain / gains.tracking : inductance / period * gain;
    } else if (resistance > Scalar(0)) {
      gains.tracking = Scalar(1);
      gains.proportional = resistance * loop_gain(angle, Scalar(0));
    }
    return gains;
  }
};

}  // namespace kmax::control
