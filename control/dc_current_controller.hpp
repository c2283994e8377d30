#pragma once

#include <algorithm>

#include "control/current_loop_gains.hpp"
#include "control/dead_time_compensation.hpp"
#include "control/finite.hpp"

namespace kmax::control {

template <typename Scalar>
struct DcCurrentControllerConfig {
  Scalar resistance = Scalar(1);           ///< ohm, terminal to terminal, >= 0
  Scalar inductance = Scalar(0.001);       ///< H, terminal to terminal, >= 0
  Scalar torque_constant = Scalar(0);      ///< N m/A = V s/rad; 0: no back-EMF feed-forward
  Scalar bandwidth = Scalar(6283.185307);  ///< rad/s, > 0; above current_bandwidth_ceiling() taken as that
  Scalar modulation_limit = Scalar(0.95);  ///< 0 .. 1, share of the supply that is used
  Scalar dead_time = Scalar(0);            ///< s, 0: not compensated
  Scalar dead_time_current = Scalar(0.1);  ///< A, > 0: dead_time_compensation.hpp
  Scalar pwm_frequency = Scalar(20000);    ///< Hz; matters with a dead time only
};

/// Current of a brushed DC motor between the half bridges (legs) B and C, one call per tick.
///
///   v = kp (i_ref - i) + d + k_e speed,   |v| <= modulation_limit x supply
///   d += (1 - a) (v - k_e speed - d)
///   duty of B = 1/2 + v / (2 supply), duty of C = 1/2 - v / (2 supply)
///
/// d is the integrator. Written as a first-order lag of the voltage that was really given, it is
/// d += ki T (i_ref - i) as long as nothing saturates, and back-calculation with the rate ki/kp when it does
/// (current_loop_gains.hpp has kp and a). With the gains' R and L it then follows R i in every state,
/// saturated or not: there is nothing to wind up, and the loop leaves saturation as if it had never been in
/// it.
///
/// The dead time's share is added to the duty of B and taken from that of C, by the reference's sign; in
/// saturation it is left out. The limit is closer by that share, so that the duties stay in their range.
///
/// modulation_limit leaves both low sides on for (1 - modulation_limit)/2 of the period at least, which the
/// shunts below them need to be read; duties are within 1/2 -+ modulation_limit / 2.
///
/// Positive current flows out of B, through the motor, into C. A value that is not finite, or a supply of 0,
/// gives zero volts (both legs at 1/2), `not_finite`, and an empty integrator. Delay and the highest
/// bandwidth: current_loop_gains.hpp.
template <typename Scalar>
class DcCurrentController {
 public:
  struct Coefficients {
    CurrentLoopGains<Scalar> gains{};
    Scalar back_emf{};     ///< V s/rad
    Scalar share_limit{};  ///< largest distance of a duty from 1/2, without the dead time's share
    DeadTimeCompensation<Scalar> dead_time{};
  };
  struct Output {
    Scalar voltage{};             ///< V from B to C, after the clamp, without the dead time's share
    Scalar duty_b = Scalar(0.5);  ///< share of the period with the high side on
    Scalar duty_c = Scalar(0.5);
    bool saturated = false;   ///< the supply bounded the voltage
    bool not_finite = false;  ///< fault
  };

  /// Outside the interrupt path. `period`: s per call of update().
  static constexpr Coefficients prepare(const DcCurrentControllerConfig<Scalar>& config, Scalar period) {
    Coefficients c;
    c.gains =
        CurrentLoopGains<Scalar>::prepare(config.resistance, config.inductance, config.bandwidth, period);
    c.back_emf = config.torque_constant;
    c.dead_time = DeadTimeCompensation<Scalar>::prepare(config.dead_time, config.dead_time_current,
                                                        config.pwm_frequency);
    const Scalar limit = Scalar(0.5) * bounded_share(config.modulation_limit) - c.dead_time.share;
    c.share_limit = std::max(Scalar(0), limit);
    return c;
  }

  /// With the power stage off, or before it is switched on.
  void reset() { drop_ = Scalar(0); }

  /// reference, current: A. speed: rad/s of the motor. supply: V, > 0.
  Output update(const Coefficients& c, Scalar reference, Scalar current, Scalar speed, Scalar supply) {
    const Scalar back_emf = c.back_emf * speed;
    const Scalar added = c.gains.proportional * (reference - current);
    const Scalar wanted = added + (drop_ + back_emf);
    const Scalar share = wanted * (Scalar(0.5) / supply);
    if (magnitude(share) <= c.share_limit) {
      drop_ += c.gains.tracking * added;
      const Scalar whole = c.dead_time.active ? share + c.dead_time.of(reference) : share;
      return {wanted, Scalar(0.5) + whole, Scalar(0.5) - whole, false, false};
    }
    if (!is_finite(share)) {
      reset();
      return without_voltage();
    }
    const Scalar bounded = share < Scalar(0) ? -c.share_limit : c.share_limit;
    const Scalar given = bounded * (supply + supply);
    drop_ += c.gains.tracking * ((given - back_emf) - drop_);
    return {given, Scalar(0.5) + bounded, Scalar(0.5) - bounded, true, false};
  }

  /// An open-loop voltage (V from B to C) with the limits and the fault of update(); no dead time is given
  /// back, since no current is known.
  static Output voltage(const Coefficients& c, Scalar voltage, Scalar supply) {
    const Scalar share = voltage * (Scalar(0.5) / supply);
    if (magnitude(share) <= c.share_limit)
      return {voltage, Scalar(0.5) + share, Scalar(0.5) - share, false, false};
    if (!is_finite(share)) return without_voltage();
    const Scalar bounded = share < Scalar(0) ? -c.share_limit : c.share_limit;
    return {bounded * (supply + supply), Scalar(0.5) + bounded, Scalar(0.5) - bounded, true, false};
  }

 private:
  static constexpr Output without_voltage() { return {Scalar(0), Scalar(0.5), Scalar(0.5), false, true}; }

  Scalar drop_ = Scalar(0);  // V, the integrator: the drop over the resistance
};

}  // namespace kmax::control
