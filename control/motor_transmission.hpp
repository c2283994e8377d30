#pragma once

#include "control/finite.hpp"

namespace kmax::control {

template <typename Scalar>
struct MotorTransmissionConfig {
  Scalar transmission =
      Scalar(0.01);  ///< m of handle travel per motor radian, not 0; negative: they run opposite
  Scalar torque_constant = Scalar(0.05);  ///< N m per A (of q current), > 0
  Scalar current_limit = Scalar(5);       ///< A, >= 0
};

/// Between the handle (N, m/s) and the motor (A, rad/s), without friction or elasticity:
/// torque = force x transmission, current = torque / torque_constant, speed = velocity / transmission.
///
/// The reference is bounded to the current limit; `force` is what is then really asked of the motor, which is
/// what a passivity controller has to count with. A force that is not finite gives zero current and
/// `not_finite`. Coefficients that are not finite (a torque constant of 0) do the same.
template <typename Scalar>
class MotorTransmission {
 public:
  struct Coefficients {
    Scalar current_per_force{};   ///< A/N
    Scalar force_per_current{};   ///< N/A
    Scalar speed_per_velocity{};  ///< rad/m
    Scalar current_limit{};       ///< A
  };
  struct Output {
    Scalar current{};  ///< A, |current| <= limit
    Scalar force{};    ///< N at the handle that this current makes
    bool limited = false;
    bool not_finite = false;
  };

  /// Outside the interrupt path.
  static constexpr Coefficients prepare(const MotorTransmissionConfig<Scalar>& config) {
    return {config.transmission / config.torque_constant, config.torque_constant / config.transmission,
            Scalar(1) / config.transmission, config.current_limit};
  }

  /// `force`: N at the handle. About 10 instructions within the limit, 20 beyond.
  static Output update(const Coefficients& c, Scalar force) {
    const Scalar wanted = force * c.current_per_force;
    if (magnitude(wanted) < c.current_limit) [[likely]]
      return {wanted, force, false, false};
    Output out;
    if (!is_finite(wanted)) {
      out.not_finite = true;
      return out;
    }
    out.current = clamp_magnitude(wanted, c.current_limit);
    out.limited = out.current != wanted;
    out.force = out.limited ? out.current * c.force_per_current : force;
    return out;
  }

  /// N at the handle from a measured current, A.
  static Scalar force(const Coefficients& c, Scalar current) { return current * c.force_per_current; }

  /// Motor speed, rad/s, from the handle's velocity, m/s.
  static Scalar motor_speed(const Coefficients& c, Scalar velocity) {
    return velocity * c.speed_per_velocity;
  }
};

}  // namespace kmax::control
