#pragma once

#include "control/finite.hpp"

namespace kmax::control {

template <typename Scalar>
struct GrowingStiffnessConfig {
  Scalar touch_stiffness = Scalar(0);   ///< N/m, >= 0: at contact; 0, or not below the wall's: does not grow
  Scalar growth_time = Scalar(0.2);     ///< s, > 0: time constant of what is missing
  Scalar calm_velocity = Scalar(0.01);  ///< m/s, >= 0
};

/// The stiffness of a wall that meets the handle softly and becomes stiff while the contact is calm:
///
///   outside                   K_touch
///   inside, |w| <= calm       K - (K - K_touch) exp(-t / growth_time)
///   inside, |w| > calm        back towards K_touch, four times as fast
///
/// Why: what makes a stiff wall oscillate is the first hit, which a handle brings with all of its speed. Once
/// it has come to rest within one count, friction holds it there against a far stiffer spring (Diolaiti,
/// Niemeyer, Barbagli, Salisbury 2006: the quiet region). The spring grows too slowly to be felt as motion;
/// the work that it does on the hand meanwhile is (K - K_touch) d^2 / 2 for a handle that stays at depth d.
/// What it allows and costs: docs/experiments/max_stiffness.md. At the moment of contact the wall is no
/// harder than K_touch, and that is what a tap feels.
///
/// A wall that looks stable may be one that never comes to K: where each count that the encoder goes on is
/// not calm, it stays near the stiffness at which the handle would begin to oscillate. present() says what
/// it renders.
///
/// A lower K, or a higher K_touch, counts at once. Of a velocity that is no number the contact is not calm.
/// What is missing decays by a factor, so that growth never stalls by rounding. Cost on a Cortex-M4F:
/// 4 instructions where nothing grows.
template <typename Scalar>
class GrowingStiffness {
 public:
  struct Coefficients {
    bool grows = false;
    Scalar full{};                            ///< N/m
    Scalar most_missing{};                    ///< N/m
    Scalar left_by_growth{}, left_by_fall{};  ///< shares, after one sample
    Scalar calm_velocity{};                   ///< m/s
  };

  /// Outside the interrupt. `stiffness`: K, N/m, >= 0. `period`: s per haptic sample. The decay is the
  /// backward-Euler one: basic arithmetic only, so that every platform gets the same bits.
  static constexpr Coefficients prepare(const GrowingStiffnessConfig<Scalar>& config, Scalar stiffness,
                                        Scalar period) {
    Coefficients c;
    c.full = stiffness;
    c.grows = config.touch_stiffness > Scalar(0) && config.touch_stiffness < stiffness;
    c.most_missing = c.grows ? stiffness - config.touch_stiffness : Scalar(0);
    const auto left = [&](Scalar time) { return time > Scalar(0) ? time / (time + period) : Scalar(0); };
    c.left_by_growth = left(config.growth_time);
    c.left_by_fall = left(Scalar(0.25) * config.growth_time);
    c.calm_velocity = config.calm_velocity;
    return c;
  }

  /// A sample outside, or a new start.
  void leave() { met_ = false; }

  /// N/m, 0 to K: after the last sample inside; K where nothing grows. No tick asks for it.
  Scalar present(const Coefficients& c) const { return c.grows ? c.full - missing_ : c.full; }

  /// N/m, 0 to K, for a sample inside. `velocity`: m/s, of the handle.
  Scalar inside(const Coefficients& c, Scalar velocity) {
    if (!c.grows) return c.full;
    const Scalar missing = met_ && missing_ < c.most_missing ? missing_ : c.most_missing;
    met_ = true;
    missing_ = magnitude(velocity) <= c.calm_velocity
                   ? missing * c.left_by_growth
                   : c.most_missing - (c.most_missing - missing) * c.left_by_fall;
    return c.full - missing;
  }

 private:
  Scalar missing_{};  // N/m, of K
  bool met_ = false;  // since the handle was outside
};

}  // namespace kmax::control
