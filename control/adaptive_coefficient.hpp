#pragma once

#include <cstdint>

#include "control/finite.hpp"

namespace kmax::control {

/// How the magnetic coefficient depends on the normalised velocity V_k (paper 1, section 4.3: three
/// relations were tried, the linear one chosen).
enum class AdaptiveRelation : std::uint8_t { linear, square, square_root };

/// Which velocity counts: only motion towards the wall (the paper's "move toward the virtual wall"), or
/// the speed whatever its direction (the literal "avatar's velocity").
enum class AdaptiveVelocity : std::uint8_t { approach, speed };

/// How the coefficient follows the velocity over time.
/// - instant: eq. 7 at every sample. At rest inside the wall the coefficient is the offset.
/// - latched: the value at the moment of contact is kept until the handle leaves the wall.
/// - peak_hold: what exceeds the value at rest decays exponentially with `hold_time` as time constant
///   (default 1.2 s: the arm takes 1.2 to 1.5 s to adjust its impedance, paper 1, section 5).
enum class AdaptiveMode : std::uint8_t { instant, latched, peak_hold };

/// Eq. 7 of paper 1, F_MC = gain V_k + offset with V_k = V / V_max, bounded to [force_min, force_max]:
/// the paper names [0.8, 2.0] N as the best interval, which its own line leaves above 1.2 m/s. A wide
/// interval gives the literal equation.
template <typename Scalar>
struct AdaptiveCoefficientConfig {
  Scalar gain = Scalar(2.4);          ///< N, any finite value >= 0
  Scalar offset = Scalar(0.8);        ///< N, >= 0
  Scalar velocity_max = Scalar(2.4);  ///< m/s, > 0
  Scalar force_min = Scalar(0.8);     ///< N, >= 0
  Scalar force_max = Scalar(2.0);     ///< N, >= force_min
  Scalar hold_time = Scalar(1.2);     ///< s, >= 0; 0 makes peak_hold the same as instant
  AdaptiveRelation relation = AdaptiveRelation::linear;
  AdaptiveVelocity velocity = AdaptiveVelocity::approach;
  AdaptiveMode mode = AdaptiveMode::instant;
};

/// The adaptive magnetic coefficient of paper 1's AIT method, one value per haptic sample.
///
/// Cost: with the wall law around it, see wall_law.hpp; one square root only for the square-root relation.
template <typename Scalar>
class AdaptiveCoefficient {
 public:
  struct Coefficients {
    Scalar gain{}, offset{}, inverse_velocity_max{}, force_min{}, force_max{};
    Scalar rest{};       ///< N, the bounded value at zero velocity
    Scalar most{};       ///< N, the bounded value at V_max and beyond; no mode ever gives more
    Scalar retention{};  ///< share of the excess over `rest` that is left after one sample
    AdaptiveRelation relation{};
    AdaptiveVelocity velocity{};
    AdaptiveMode mode{};
  };

  /// Outside the interrupt path. `period`: s per haptic sample. The decay is the backward-Euler one,
  /// tau / (tau + T): basic arithmetic only, so that every platform gets the same bits.
  static constexpr Coefficients prepare(const AdaptiveCoefficientConfig<Scalar>& config, Scalar period) {
    Coefficients c;
    c.gain = config.gain;
    c.offset = config.offset;
    // Without a gain the velocity does not count; its product with 0 must stay 0 however large V_k is.
    c.inverse_velocity_max = config.gain == Scalar(0) ? Scalar(0) : saturate(Scalar(1) / config.velocity_max);
    c.force_min = config.force_min;
    c.force_max = config.force_max;
    c.relation = config.relation;
    c.velocity = config.velocity;
    c.mode = config.mode;
    c.rest = bounded(c, config.offset);
    c.most = bounded(c, config.gain + config.offset);
    c.retention = config.hold_time > Scalar(0) ? config.hold_time / (config.hold_time + period) : Scalar(0);
    return c;
  }

  void reset() {
    excess_ = Scalar(0);
    latched_ = Scalar(0);
    was_inside_ = false;
  }

  /// `outward_velocity`: m/s, positive away from the wall. `inside`: the handle is in the wall.
  /// Returns F_MC in N, within [force_min, force_max] for finite inputs.
  Scalar update(const Coefficients& c, Scalar outward_velocity, bool inside) {
    return inside ? update_inside(c, outward_velocity) : update_outside(c, outward_velocity);
  }

  /// The same where the caller has already asked on which side of the surface the handle is.
  Scalar update_inside(const Coefficients& c, Scalar outward_velocity) {
    if (c.mode == AdaptiveMode::instant) [[likely]]
      return without_memory(c, outward_velocity);
    const Scalar present = follow(c, outward_velocity);
    if (!was_inside_) {
      was_inside_ = true;
      latched_ = present;
      return c.mode == AdaptiveMode::peak_hold ? held(c) : present;
    }
    return c.mode == AdaptiveMode::latched ? bounded(c, latched_) : held(c);
  }
  Scalar update_outside(const Coefficients& c, Scalar outward_velocity) {
    if (c.mode == AdaptiveMode::instant) [[likely]]
      return without_memory(c, outward_velocity);
    const Scalar present = follow(c, outward_velocity);
    was_inside_ = false;
    return c.mode == AdaptiveMode::peak_hold ? held(c) : present;
  }

  /// Eq. 7 without memory.
  static Scalar at_velocity(const Coefficients& c, Scalar outward_velocity) {
    Scalar speed = -outward_velocity;
    if (c.velocity == AdaptiveVelocity::speed) [[unlikely]] {
      speed = magnitude(speed);
    } else if (speed < Scalar(0)) {
      speed = Scalar(0);
    }
    Scalar normalised = speed * c.inverse_velocity_max;
    if (c.relation != AdaptiveRelation::linear) [[unlikely]]
      normalised = c.relation == AdaptiveRelation::square ? normalised * normalised : square_root(normalised);
    // V_k is not bounded to 1 before: all three relations rise with it, and `most` is what they give at 1.
    const Scalar force = c.gain * normalised + c.offset;
    if (force > c.most) return c.most;
    if (force < c.force_min) return c.force_min;
    return force;
  }

 private:
  // A mode with a memory that is changed to under way begins with this sample.
  Scalar without_memory(const Coefficients& c, Scalar outward_velocity) {
    was_inside_ = false;
    excess_ = Scalar(0);
    return at_velocity(c, outward_velocity);
  }

  // The coefficient at this velocity; the excess follows it.
  Scalar follow(const Coefficients& c, Scalar outward_velocity) {
    const Scalar present = at_velocity(c, outward_velocity);
    const Scalar present_excess = present - c.rest;
    const Scalar decayed = excess_ * c.retention;
    excess_ = present_excess > decayed ? present_excess : decayed;
    return present;
  }

  // The excess is never below 0 and the rest never below force_min: one bound is left to be kept. Rounding
  // can put rest + (most - rest) an ulp above `most`, below force_max (in float: rest 0.756, most 1.823).
  Scalar held(const Coefficients& c) const {
    const Scalar force = c.rest + excess_;
    return force > c.most ? c.most : force;
  }

  static constexpr Scalar bounded(const Coefficients& c, Scalar force) {
    if (force > c.force_max) return c.force_max;
    if (force < c.force_min) return c.force_min;
    return force;
  }

  // One VSQRT.F32 on the target (-fno-math-errno keeps libm out), correctly rounded on both sides.
  static float square_root(float value) { return __builtin_sqrtf(value); }
  static double square_root(double value) { return __builtin_sqrt(value); }

  Scalar excess_ = Scalar(0);   // N above rest, kept apart so that its decay never stalls by rounding
  Scalar latched_ = Scalar(0);  // N
  bool was_inside_ = false;
};

}  // namespace kmax::control
