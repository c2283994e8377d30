#pragma once

#include <cstdint>
#include <limits>

#include "control/current_loop_gains.hpp"
#include "control/dead_time_compensation.hpp"
#include "control/finite.hpp"
#include "control/phase_currents.hpp"
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
  Scalar dead_time = Scalar(0);            ///< s, 0: not compensated
  Scalar dead_time_current = Scalar(0.1);  ///< A, > 0: dead_time_compensation.hpp
  Scalar pwm_frequency = Scalar(20000);    ///< Hz; matters with a dead time only
};

/// Currents of a permanent-magnet synchronous motor in the rotor's frame (d along its flux, q a quarter turn
/// ahead), one call per tick.
///
///   Clarke    i_alpha = i_A = -(i_B + i_C), i_beta = (i_B - i_C) / sqrt(3)   (amplitudes are kept)
///   Park      i_d = i_alpha cos + i_beta sin, i_q = i_beta cos - i_alpha sin
///   PI        v_d = kp_d (d_ref - i_d) + x_d - w L_q i_q
///             v_q = kp_q (q_ref - i_q) + x_q + w (L_d i_d + flux)
///   circle    |v| <= modulation_limit x supply / sqrt(3) x 127/128
///             the d axis first: v_q gets what v_d leaves over
///   integral  x_d += (1 - a) (v_d - its feed-forward - x_d), x_q likewise: integration and, in saturation,
///             back-calculation in one, as dc_current_controller.hpp explains
///   advance   the voltage is turned on by p = w T: that far the rotor turns from the sample to the middle of
///             the time in which the voltage is active, |p| <= 1/8
///   back      inverse Park and Clarke; each phase voltage less the mean of the largest and the smallest
///             ("min-max": the voltages between the phases are untouched, 15 % more of them fits in the
///             supply)
///   duty      1/2 + phase voltage / supply + the dead time's share by the sign of the phase's reference,
///             within 1/2 -+ modulation_limit / 2
///
/// w is the electrical speed, flux the magnets' linkage, torque_constant / (3/2 pole_pairs).
///
/// Dead time (dead_time_compensation.hpp): left out in saturation; the circle is smaller by its share, so
/// that the duties stay in their range.
///
/// Advance: without it the voltage would lag behind the rotor by w T, 2 degrees at 700 rad/s and 20 kHz, and
/// be wrong by that, 3.5 %. It is made of two shears, d -= p q, q += p d, which are a rotation but for p^2/2:
/// 0.06 % at 700 rad/s. Beyond |p| = 1/8 rad (2500 rad/s) what is missing stays missing. Some voltages become
/// longer by p^2/2, 0.8 % at most, which the circle leaves free at every speed.
///
/// A value that is not finite, or a supply of 0, gives zero volts (all legs at 1/2), `not_finite`, and empty
/// integrators; the currents are reported as they came. Delay and the highest bandwidth:
/// current_loop_gains.hpp. The sine's error: sine_cosine_first_order().
template <typename Scalar>
class FieldOrientedController {
 public:
  /// rad: beyond this the rest of the advance is left out.
  static constexpr Scalar largest_advance = Scalar(0.125);
  /// What the circle leaves free for the length that the advance adds, largest_advance^2 / 2, and for
  /// rounding: a limit of 1 still gives duties within 0 .. 1.
  static constexpr Scalar circle_room = Scalar(1) - Scalar(1) / Scalar(128);

  struct Verdict {
    bool saturated = false;   ///< the supply bounded the voltage
    bool not_finite = false;  ///< fault
  };
  struct Coefficients {
    CurrentLoopGains<Scalar> gains_d{};
    CurrentLoopGains<Scalar> gains_q{};
    Scalar inductance_d{};  ///< H
    Scalar inductance_q{};  ///< H
    Scalar flux{};          ///< Wb = V s per electrical radian
    Scalar circle{};        ///< radius of the circle, as a share of the supply, times three quarters
    Scalar circle_square{};
    Scalar half_advance{};     ///< s, half of the time from the sample to the middle of the voltage
    Scalar half_turn_limit{};  ///< rad, half of the largest angle of advance
    DeadTimeCompensation<Scalar> dead_time{};
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
  struct Output : Verdict {
    Scalar duty_a = Scalar(0.5);  ///< share of the period with the high side on
    Scalar duty_b = Scalar(0.5);
    Scalar duty_c = Scalar(0.5);
    Scalar current_d{};  ///< A, measured
    Scalar current_q{};  ///< A, measured
    Scalar voltage_d{};  ///< V, after the circle, in the rotor's frame when it is active
    Scalar voltage_q{};  ///< V, after the circle
  };

  /// Outside the interrupt path. `period`: s per call of update().
  static constexpr Coefficients prepare(const FieldOrientedControllerConfig<Scalar>& config, Scalar period) {
    constexpr auto quarter_root_three = static_cast<Scalar>(0.433012701892219323381861585376);
    Coefficients c;
    c.gains_d =
        CurrentLoopGains<Scalar>::prepare(config.resistance, config.inductance_d, config.bandwidth, period);
    c.gains_q =
        CurrentLoopGains<Scalar>::prepare(config.resistance, config.inductance_q, config.bandwidth, period);
    c.inductance_d = config.inductance_d;
    c.inductance_q = config.inductance_q;
    c.flux = config.torque_constant / (Scalar(1.5) * static_cast<Scalar>(config.pole_pairs));
    c.half_advance = Scalar(0.5) * period;
    c.half_turn_limit = Scalar(0.5) * largest_advance;
    c.dead_time = DeadTimeCompensation<Scalar>::prepare(config.dead_time, config.dead_time_current,
                                                        config.pwm_frequency);
    const Scalar limit = bounded_share(config.modulation_limit) - Scalar(2) * c.dead_time.share;
    c.circle = limit > Scalar(0) ? limit * quarter_root_three * circle_room : Scalar(0);  // 3/4 of 1/sqrt(3)
    c.circle_square = c.circle * c.circle;
    return c;
  }

  /// With the power stage off, or before it is switched on.
  void reset() { drop_d_ = drop_q_ = Scalar(0); }

  [[gnu::always_inline]] Output update(const Coefficients& c, const Input& in) {
    const auto [sine, cosine] = rotation(in.angle);
    const Vector current = measured(in, sine, cosine);
    const Scalar forward_d = in.electrical_speed * (c.inductance_q * current.q);  // taken off
    const Scalar forward_q = in.electrical_speed * (c.inductance_d * current.d + c.flux);
    // What each axis adds to its drop and its feed-forward; the integrators follow it.
    const Scalar added_d = c.gains_d.proportional * (in.reference_d - current.d);
    const Scalar added_q = c.gains_q.proportional * (in.reference_q - current.q);
    const Vector wanted = {added_d + (drop_d_ - forward_d), added_q + (drop_q_ + forward_q)};
    const Scalar scale = Scalar(0.75) / in.supply;
    const Vector share = {wanted.d * scale, wanted.q * scale};
    const Scalar square = share.d * share.d + share.q * share.q;
    if (square <= c.circle_square) [[likely]] {
      drop_d_ += c.gains_d.tracking * added_d;
      drop_q_ += c.gains_q.tracking * added_q;
      Phases duty = modulated(c, in.electrical_speed, share, sine, cosine);
      if (c.dead_time.active) [[likely]] {
        const PhaseCurrents<Scalar> reference = referred(in, sine, cosine);
        duty.a += c.dead_time.of(reference.a);
        duty.b += c.dead_time.of(reference.b);
        duty.c += c.dead_time.of(reference.c);
      }
      return {{false, false}, duty.a, duty.b, duty.c, current.d, current.q, wanted.d, wanted.q};
    }
    if (!(square <= std::numeric_limits<Scalar>::max())) {
      reset();
      return without_voltage(current);
    }
    const Vector bounded = on_the_circle(c, share);
    const Scalar back = in.supply * static_cast<Scalar>(4.0 / 3.0);
    const Vector left = {bounded.d * back, bounded.q * back};
    drop_d_ += c.gains_d.tracking * ((left.d + forward_d) - drop_d_);
    drop_q_ += c.gains_q.tracking * ((left.q - forward_q) - drop_q_);
    const Phases duty = modulated(c, in.electrical_speed, bounded, sine, cosine);
    return {{true, false}, duty.a, duty.b, duty.c, current.d, current.q, left.d, left.q};
  }

  /// A, the phases' references at the sample.
  [[gnu::always_inline]] static PhaseCurrents<Scalar> phase_references(const Input& in) {
    const auto [sine, cosine] = rotation(in.angle);
    return referred(in, sine, cosine);
  }

  /// An open-loop voltage (V, turning with in.electrical_speed, at in.angle when the currents are sampled)
  /// with the limits, the measured currents and the fault of update(). in's references are not read. No dead
  /// time is given back: what is measured with a known voltage shall be the circuit as it is.
  static Output voltage(const Coefficients& c, const Input& in, Scalar voltage_d, Scalar voltage_q) {
    const auto [sine, cosine] = rotation(in.angle);
    const Vector current = measured(in, sine, cosine);
    const Scalar scale = Scalar(0.75) / in.supply;
    const Vector share = {voltage_d * scale, voltage_q * scale};
    const Scalar square = share.d * share.d + share.q * share.q;
    // A controller would stumble over the measured values: they are a fault here too.
    if (!is_finite(square) || !is_finite(current.d) || !is_finite(current.q) ||
        !is_finite(in.electrical_speed)) {
      return without_voltage(current);
    }
    if (square <= c.circle_square) {
      const Phases duty = modulated(c, in.electrical_speed, share, sine, cosine);
      return {{}, duty.a, duty.b, duty.c, current.d, current.q, voltage_d, voltage_q};
    }
    const Vector bounded = on_the_circle(c, share);
    const Scalar back = in.supply * static_cast<Scalar>(4.0 / 3.0);
    const Phases duty = modulated(c, in.electrical_speed, bounded, sine, cosine);
    return {{true, false}, duty.a, duty.b, duty.c, current.d, current.q, bounded.d * back, bounded.q * back};
  }

 private:
  struct Vector {
    Scalar d{}, q{};
  };
  struct Phases {
    Scalar a{}, b{}, c{};
  };

  // Double is what single precision is compared with: it shall be exact.
  [[gnu::always_inline]] static SineCosine<Scalar> rotation(TurnFraction angle) {
    if constexpr (sizeof(Scalar) > sizeof(float)) {
      return sine_cosine<Scalar>(angle);
    } else {
      return sine_cosine_first_order<Scalar>(angle);
    }
  }

  [[gnu::always_inline]] static Vector measured(const Input& in, Scalar sine, Scalar cosine) {
    constexpr auto inverse_root_three = static_cast<Scalar>(0.577350269189625764509148780502);
    const Scalar minus_alpha = in.current_b + in.current_c;
    const Scalar beta = (in.current_b - in.current_c) * inverse_root_three;
    return {beta * sine - minus_alpha * cosine, beta * cosine + minus_alpha * sine};
  }

  /// The verdict of a fault, as something that the compiler cannot look through: as constants its members
  /// would be merged with those of the other paths, and each tick of either motor would be two instructions
  /// longer.
  [[gnu::always_inline]] static Verdict fault() {
    bool saturated = false, not_finite = true;
    asm("" : "+r"(saturated), "+r"(not_finite));
    return {saturated, not_finite};
  }

  [[gnu::always_inline]] static Output without_voltage(const Vector& current) {
    constexpr auto half = Scalar(0.5);
    return {fault(), half, half, half, current.d, current.q, Scalar(0), Scalar(0)};
  }

  // What lies beyond the circle onto it, the d axis first.
  [[gnu::always_inline]] static Vector on_the_circle(const Coefficients& c, const Vector& share) {
    const Scalar left = c.circle_square - share.d * share.d;
    if (!(left >= Scalar(0))) return {share.d < Scalar(0) ? -c.circle : c.circle, Scalar(0)};
    return {share.d, share.q * (square_root(left) / magnitude(share.q))};  // q is not 0 here
  }

  // `share`: of the supply, times three quarters.
  [[gnu::always_inline]] static Phases modulated(const Coefficients& c, Scalar speed, const Vector& share,
                                                 Scalar sine, Scalar cosine) {
    constexpr auto inverse_root_three = static_cast<Scalar>(0.577350269189625764509148780502);
    constexpr auto half = Scalar(0.5);
    // Bounded without a comparison. One shear after the other is a rotation but for p^2/2.
    const Scalar half_turn = speed * c.half_advance;
    const Scalar turn = magnitude(half_turn + c.half_turn_limit) - magnitude(half_turn - c.half_turn_limit);
    const Scalar d = share.d - turn * share.q;
    const Scalar q = share.q + turn * d;
    // Phase voltages a = alpha, b = beta - a/2, c = -beta - a/2 add up to nothing, so the mean of the largest
    // and the smallest is minus half of the middle one, and that is
    //     middle = -a/2 + clamp(3/2 a, -|beta|, |beta|)
    const Scalar alpha = d * cosine - q * sine;                        // 3/4 a
    const Scalar beta = (d * sine + q * cosine) * inverse_root_three;  // half of it
    const Scalar width = magnitude(beta);
    const Scalar centre = half + half * (magnitude(alpha + width) - magnitude(alpha - width));
    const Scalar others = centre - alpha;
    const Scalar whole = beta + beta;
    return {centre + alpha, others + whole, others - whole};
  }

  [[gnu::always_inline]] static PhaseCurrents<Scalar> referred(const Input& in, Scalar sine, Scalar cosine) {
    constexpr auto half_root_three = static_cast<Scalar>(0.866025403784438646763723170753);
    const Scalar a = in.reference_d * cosine - in.reference_q * sine;
    const Scalar beta = (in.reference_d * sine + in.reference_q * cosine) * half_root_three;
    const Scalar half = Scalar(0.5) * a;
    return {a, beta - half, -(beta + half)};
  }

  // One instruction each on the target.
  static float square_root(float value) { return __builtin_sqrtf(value); }
  static double square_root(double value) { return __builtin_sqrt(value); }

  Scalar drop_d_ = Scalar(0);  // V, the integrators: the drops over the resistance
  Scalar drop_q_ = Scalar(0);
};

}  // namespace kmax::control
