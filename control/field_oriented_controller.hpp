#pragma once

#include <cstdint>

#include "control/current_loop_gains.hpp"
#include "control/finite.hpp"
#include "control/sine_cosine.hpp"

namespace kmax::control {

template <typename Scalar>
struct FieldOrientedControllerConfig {
  Scalar resistance = Scalar(1);           ///< ohm, one phase (half of what is measured between two), >= 0
  Scalar inductance_d = Scalar(0.001);     ///< H, one phase, >= 0
  Scalar inductance_q = Scalar(0.001);     ///< H, one phase, >= 0
  Scalar torque_constant = Scalar(0);      ///< N m per A of q current; 0: no back-EMF feed-forward
  std::int32_t pole_pairs = 1;             ///< >= 1
  Scalar bandwidth = Scalar(6283.185307);  ///< rad/s, > 0; above current_bandwidth_ceiling() taken as that
  Scalar modulation_limit = Scalar(0.95);  ///< 0 .. 1, share of the supply between two phases that is used
};

/// Currents of a permanent-magnet synchronous motor in the rotor's frame (d along its flux, q a quarter turn
/// ahead), one call per tick.
///
///   Clarke    i_alpha = i_A = -(i_B + i_C), i_beta = (i_B - i_C) / sqrt(3)   (amplitudes are kept)
///   Park      i_d = i_alpha cos + i_beta sin, i_q = i_beta cos - i_alpha sin
///   PI        v_d = kp_d (d_ref - i_d) + x_d - w L_q i_q
///             v_q = kp_q (q_ref - i_q) + x_q + w (L_d i_d + flux)
///   circle    |v| <= modulation_limit x supply / sqrt(3), the d axis first: v_q gets what v_d leaves over
///   x_d += (1 - a) (v_d - its feed-forward - x_d), x_q likewise: integration and, in saturation,
///             back-calculation in one, as dc_current_controller.hpp explains
///   back      inverse Park and Clarke; each phase voltage less the mean of the largest and the smallest
///             ("min-max": the voltages between the phases are untouched, 15 % more of them fits in the
///             supply)
///   duty      1/2 + phase voltage / supply, within 1/2 -+ modulation_limit / 2
///
/// w is the electrical speed, flux the magnets' linkage, torque_constant / (3/2 pole_pairs). The angle is
/// that of the rotor at the sample; the rotor turns on by w T until the middle of the time in which the
/// voltage is active, which is not made up for (2 degrees at 700 rad/s and 20 kHz; the integrators take the
/// rest).
///
/// A value that is not finite, or a supply of 0, gives zero volts (all legs at 1/2), `not_finite`, and empty
/// integrators; the currents are reported as they came. Delay and the highest bandwidth:
/// current_loop_gains.hpp.
template <typename Scalar>
class FieldOrientedController {
 public:
  struct Coefficients {
    CurrentLoopGains<Scalar> gains_d{};
    CurrentLoopGains<Scalar> gains_q{};
    Scalar inductance_d{};  ///< H
    Scalar inductance_q{};  ///< H
    Scalar flux{};          ///< Wb = V s per electrical radian
    Scalar circle{};        ///< radius of the circle, as a share of the supply
    Scalar circle_square{};
  };
  struct Input {
    TurnFraction angle = 0;     ///< electrical, at the sample
    Scalar current_b{};         ///< A, positive into the motor
    Scalar current_c{};         ///< A
    Scalar electrical_speed{};  ///< rad/s
    Scalar reference_d{};       ///< A
    Scalar reference_q{};       ///< A
    Scalar supply{};            ///< V, > 0
  };
  struct Output {
    Scalar duty_a = Scalar(0.5);  ///< share of the period with the high side on
    Scalar duty_b = Scalar(0.5);
    Scalar duty_c = Scalar(0.5);
    Scalar current_d{};       ///< A, measured
    Scalar current_q{};       ///< A, measured
    Scalar voltage_d{};       ///< V, after the circle
    Scalar voltage_q{};       ///< V, after the circle
    bool saturated = false;   ///< the supply bounded the voltage
    bool not_finite = false;  ///< fault
  };

  /// Outside the interrupt path. `period`: s per call of update().
  static constexpr Coefficients prepare(const FieldOrientedControllerConfig<Scalar>& config, Scalar period) {
    constexpr auto inverse_root_three = static_cast<Scalar>(0.577350269189625764509148780502);
    // What rounding adds to a duty at the limit, so that a limit of 1 still gives duties within 0 .. 1.
    constexpr auto rounding = static_cast<Scalar>(1.0 - 1.0 / (1 << 20));
    Coefficients c;
    c.gains_d =
        CurrentLoopGains<Scalar>::prepare(config.resistance, config.inductance_d, config.bandwidth, period);
    c.gains_q =
        CurrentLoopGains<Scalar>::prepare(config.resistance, config.inductance_q, config.bandwidth, period);
    c.inductance_d = config.inductance_d;
    c.inductance_q = config.inductance_q;
    c.flux = config.torque_constant / (Scalar(1.5) * static_cast<Scalar>(config.pole_pairs));
    c.circle = bounded_share(config.modulation_limit) * inverse_root_three * rounding;
    c.circle_square = c.circle * c.circle;
    return c;
  }

  /// With the power stage off, or before it is switched on.
  void reset() { drop_d_ = drop_q_ = Scalar(0); }

  Output update(const Coefficients& c, const Input& in) {
    constexpr auto inverse_root_three = static_cast<Scalar>(0.577350269189625764509148780502);
    constexpr auto half_root_three = static_cast<Scalar>(0.866025403784438646763723170753);
    const auto [sine, cosine] = sine_cosine<Scalar>(in.angle);
    const Scalar minus_alpha = in.current_b + in.current_c;
    const Scalar beta = (in.current_b - in.current_c) * inverse_root_three;
    const Scalar current_d = beta * sine - minus_alpha * cosine;
    const Scalar current_q = beta * cosine + minus_alpha * sine;

    const Scalar forward_d = -(in.electrical_speed * (c.inductance_q * current_q));
    const Scalar forward_q = in.electrical_speed * (c.inductance_d * current_d + c.flux);
    // What each axis adds to its drop and its feed-forward; the integrators follow it.
    Scalar added_d = c.gains_d.proportional * (in.reference_d - current_d);
    Scalar added_q = c.gains_q.proportional * (in.reference_q - current_q);
    Scalar voltage_d = added_d + (drop_d_ + forward_d);
    Scalar voltage_q = added_q + (drop_q_ + forward_q);
    const Scalar inverse_supply = Scalar(1) / in.supply;
    Scalar d = voltage_d * inverse_supply;  // voltages as shares of the supply
    Scalar q = voltage_q * inverse_supply;
    const Scalar square = d * d + q * q;
    bool saturated = false;
    if (!(square <= c.circle_square)) {
      if (!is_finite(square)) {
        reset();
        constexpr auto half = Scalar(0.5);
        return {half, half, half, current_d, current_q, Scalar(0), Scalar(0), false, true};
      }
      saturated = true;
      if (magnitude(d) <= c.circle) {
        const Scalar most_q = square_root(c.circle_square - d * d);
        q = q < Scalar(0) ? -most_q : most_q;
      } else {
        d = d < Scalar(0) ? -c.circle : c.circle;
        q = Scalar(0);
        voltage_d = d * in.supply;
        added_d = (voltage_d - forward_d) - drop_d_;
      }
      voltage_q = q * in.supply;
      added_q = (voltage_q - forward_q) - drop_q_;
    }
    drop_d_ += c.gains_d.tracking * added_d;
    drop_q_ += c.gains_q.tracking * added_q;

    const Scalar a = d * cosine - q * sine;
    const Scalar beta_share = (d * sine + q * cosine) * half_root_three;
    const Scalar b = beta_share - Scalar(0.5) * a;
    const Scalar c_share = -(a + b);
    // The three add up to nothing, so the mean of the largest and the smallest is minus half of the middle
    // one, and the middle one is the one with the smallest magnitude.
    Scalar middle = magnitude(a) < magnitude(b) ? a : b;
    if (magnitude(c_share) < magnitude(middle)) middle = c_share;
    const Scalar centre = Scalar(0.5) + Scalar(0.5) * middle;
    return {centre + a, centre + b, centre + c_share, current_d, current_q,
            voltage_d,  voltage_q,  saturated,        false};
  }

 private:
  // One instruction each on the target.
  static float square_root(float value) { return __builtin_sqrtf(value); }
  static double square_root(double value) { return __builtin_sqrt(value); }

  Scalar drop_d_ = Scalar(0);  // V, the integrators: the drops over the resistance
  Scalar drop_q_ = Scalar(0);
};

}  // namespace kmax::control
