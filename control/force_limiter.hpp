#pragma once

#include <limits>

#include "control/finite.hpp"

namespace kmax::control {

template <typename Scalar>
struct ForceLimiterConfig {
  Scalar limit = Scalar(3.3);      ///< N, >= 0: the Geomagic Touch's peak force (paper 1, section 4)
  Scalar slew_limit = Scalar(0);   ///< N/s, >= 0; 0: unlimited
  Scalar ramp_time = Scalar(0.2);  ///< s from zero to full force after enabling; 0: none
};

/// The last step before the device: soft start, magnitude limit, slew limit, in this order.
///
/// The ramp scales the force from 0 to 1 over ramp_time after reset(), so that a device armed near a wall
/// never jumps. The slew limit applies to what is really sent, so after a reset it starts from zero.
/// What was taken away is reported at every sample: a passivity controller must observe the force that
/// was really made, and an experiment must say when its force was clipped.
///
/// A force that is not finite becomes zero with `not_finite` set; the ramp and slew state restart from
/// zero. Cost: about 20 instructions.
template <typename Scalar>
class ForceLimiter {
 public:
  struct Coefficients {
    Scalar limit{};
    Scalar step_limit{};      ///< N per sample; the largest number: unlimited
    Scalar ramp_increment{};  ///< per sample; 1: no ramp
  };
  struct Output {
    Scalar force{};  ///< N, |force| <= limit
    bool limited = false;
    bool slew_limited = false;
    bool ramping = false;
    bool not_finite = false;
  };

  /// Outside the interrupt path. `period`: s per call of update().
  static constexpr Coefficients prepare(const ForceLimiterConfig<Scalar>& config, Scalar period) {
    Coefficients c;
    c.limit = config.limit;
    c.step_limit =
        config.slew_limit > Scalar(0) ? config.slew_limit * period : std::numeric_limits<Scalar>::max();
    c.ramp_increment = config.ramp_time > period ? period / config.ramp_time : Scalar(1);
    return c;
  }

  /// Force off and the soft start armed again.
  void reset() {
    force_ = Scalar(0);
    ramp_ = Scalar(0);
  }

  Output update(const Coefficients& c, Scalar requested) {
    if (is_finite(requested)) return update_finite(c, requested);
    reset();
    Output out;
    out.not_finite = true;
    return out;
  }
  /// For a caller that knows it to be finite.
  Output update_finite(const Coefficients& c, Scalar requested) {
    Output out;
    if (ramp_ < Scalar(1)) {
      ramp_ += c.ramp_increment;
      if (ramp_ > Scalar(1)) ramp_ = Scalar(1);
      out.ramping = ramp_ < Scalar(1);
      requested = requested * ramp_;
    }
    Scalar limited = requested;
    if (magnitude(requested) > c.limit) [[unlikely]] {
      limited = clamp_magnitude(requested, c.limit);
      out.limited = true;
    }
    if (magnitude(limited - force_) <= c.step_limit) [[likely]] {
      // Adding the step back to the old force would round; the target itself is exact.
      force_ = limited;
    } else {
      const Scalar step = saturate(limited - force_);
      const Scalar allowed = clamp_magnitude(step, c.step_limit);
      out.slew_limited = allowed != step;
      // The magnitude limit is the harder one: lowered under way, it is met at once.
      force_ = out.slew_limited ? clamp_magnitude(force_ + allowed, c.limit) : limited;
    }
    out.force = force_;
    return out;
  }

  /// 0 to 1: the share of the force that the soft start lets pass, in the last update(); 0 after reset().
  Scalar ramp() const { return ramp_; }

 private:
  Scalar force_ = Scalar(0);  // N, what was sent last
  Scalar ramp_ = Scalar(0);   // 0 to 1
};

}  // namespace kmax::control
