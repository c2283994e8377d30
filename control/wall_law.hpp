#pragma once

#include <cstdint>
#include <limits>

#include "control/adaptive_coefficient.hpp"
#include "control/finite.hpp"
#include "control/growing_stiffness.hpp"

namespace kmax::control {

/// Which law renders the wall (paper 1: "A Human Arm's Mechanical Impedance Tuning Method ...", 2020).
enum class WallKind : std::uint8_t {
  none,      ///< no force
  plain,     ///< eq. 3: a one-sided spring
  magnetic,  ///< eqs. 5 and 6: the spring plus a repulsive field of constant coefficient ("IT")
  adaptive,  ///< eqs. 5 to 7: the field's coefficient follows the velocity ("AIT")
};

/// Whether the field's coefficient answers to the velocity: a damper, or its opposite, that no criterion of
/// stability covers.
constexpr bool follows_velocity(WallKind kind) {
  switch (kind) {
    case WallKind::none:
    case WallKind::plain:
    case WallKind::magnetic:
      return false;
    case WallKind::adaptive:
      return true;
  }
  return false;
}

template <typename Scalar>
struct WallLawConfig {
  WallKind kind = WallKind::plain;
  Scalar stiffness = Scalar(1000);           ///< K, N/m, >= 0
  GrowingStiffnessConfig<Scalar> growing{};  ///< how K comes about after a contact
  Scalar damping = Scalar(0);                ///< B, N s/m, >= 0
  Scalar magnetic_coefficient = Scalar(2);   ///< F_MC, N, >= 0; constant law only
  Scalar magnetic_length = Scalar(0.001);    ///< x_0, m, > 0
  AdaptiveCoefficientConfig<Scalar> adaptive;
};

/// The virtual wall's force as a function of where the handle is relative to the surface.
///
/// Everything here is written in the wall's own frame, which makes the wall.side mirror exact:
///   outside_distance s  m, > 0 in free space, <= 0 inside (paper 1: "inside" is x <= x_w)
///   outward_velocity w  m/s, > 0 away from the wall
///   force               N, > 0 pushes the handle out
///
///   outside   F = F_MC / (s / x_0 + 1)^2
///   inside    F = max(0, K (-s) - B w) + F_MC
///
/// with F_MC = 0 for the plain wall. K may grow after the contact (growing_stiffness.hpp), and B may go by
/// another velocity than eq. 7. The damper acts inside only and is bounded together with the spring:
/// the sum never pulls the handle in, and on the way out the force meets the field's F_MC at the surface
/// without a step. Every finite input gives a finite, non-negative force: what overflows is brought back
/// to the largest number (the force limiter downstream is what bounds it to something sensible). A NaN
/// passes through as a NaN: HapticLoop turns it into zero force and a fault.
///
/// Cost on a Cortex-M4F, executed instructions: adaptive 69 as configured by default, at most 120, where the
/// force overflows, and 143 where K grows as well; one division outside (tests/benchmarks/instruction_budget
/// counts them).
template <typename Scalar>
class WallLaw {
 public:
  struct Coefficients {
    WallKind kind = WallKind::none;
    Scalar damping{}, magnetic_coefficient{}, inverse_magnetic_length{};
    typename GrowingStiffness<Scalar>::Coefficients stiffness{};
    typename AdaptiveCoefficient<Scalar>::Coefficients adaptive{};
  };

  struct Output {
    Scalar force{};                 ///< N, outward, spring + damper + field
    Scalar magnetic_force{};        ///< N, the field's share of it (F_M of eq. 5)
    Scalar magnetic_coefficient{};  ///< N, F_MC at this sample; 0 without a field
    bool inside = false;
  };

  /// Outside the interrupt path. `period`: s per haptic sample.
  static constexpr Coefficients prepare(const WallLawConfig<Scalar>& config, Scalar period) {
    Coefficients c;
    c.kind = config.kind;
    c.stiffness = GrowingStiffness<Scalar>::prepare(config.growing, config.stiffness, period);
    c.damping = config.damping;
    c.magnetic_coefficient = constant_coefficient(config);
    c.inverse_magnetic_length = saturate(Scalar(1) / config.magnetic_length);
    c.adaptive = AdaptiveCoefficient<Scalar>::prepare(config.adaptive, period);
    return c;
  }

  void reset() {
    adaptive_.reset();
    stiffness_.leave();
  }

  Output update(const Coefficients& c, Scalar outside_distance, Scalar outward_velocity) {
    return update(c, outside_distance, outward_velocity, outward_velocity);
  }
  /// `damper_velocity`: m/s outwards, what B is multiplied by.
  Output update(const Coefficients& c, Scalar outside_distance, Scalar outward_velocity,
                Scalar damper_velocity) {
    if (outside_distance > Scalar(0)) {
      stiffness_.leave();
      if (c.kind == WallKind::none) return {Scalar(0), Scalar(0), Scalar(0), false};
      const Scalar coefficient = c.kind == WallKind::adaptive
                                     ? adaptive_.update_outside(c.adaptive, outward_velocity)
                                     : c.magnetic_coefficient;
      const Scalar ratio = outside_distance * c.inverse_magnetic_length + Scalar(1);
      const Scalar field = coefficient / (ratio * ratio);
      return {field, field, coefficient, false};
    }
    Scalar coefficient = c.magnetic_coefficient;
    if (c.kind == WallKind::adaptive) {
      coefficient = adaptive_.update_inside(c.adaptive, outward_velocity);
    } else if (c.kind == WallKind::none) {
      return {Scalar(0), Scalar(0), Scalar(0), true};
    }
    const Scalar spring = stiffness_.inside(c.stiffness, outward_velocity) * -outside_distance;
    const Scalar damper = c.damping * damper_velocity;
    Scalar force = together(spring, damper, coefficient);
    // An overflow anywhere ends in an infinity here, or in a NaN.
    if (!(force <= largest)) [[unlikely]]
      force = saturated(spring, damper, coefficient);
    return {force, coefficient, coefficient, true};
  }

  /// N/m, of the spring after the last sample inside, see GrowingStiffness::present().
  Scalar present_stiffness(const Coefficients& c) const { return stiffness_.present(c.stiffness); }

 private:
  static constexpr Scalar largest = std::numeric_limits<Scalar>::max();

  /// N, F_MC of a field that does not change. A kind that is not named here does not compile: update(), which
  /// asks for the two that differ from a spring with such a field, would take it for one.
  static constexpr Scalar constant_coefficient(const WallLawConfig<Scalar>& config) {
    switch (config.kind) {
      case WallKind::magnetic:
        return config.magnetic_coefficient;
      case WallKind::none:
      case WallKind::plain:
      case WallKind::adaptive:
        break;
    }
    return Scalar(0);
  }

  /// The wall does not pull; the field is added to what is left.
  static Scalar together(Scalar spring, Scalar damper, Scalar field) {
    const Scalar reaction = spring - damper;
    return (reaction < Scalar(0) ? Scalar(0) : reaction) + field;
  }
  /// The same with the largest number in place of an overflow, where that would show: not in the damper,
  /// whose infinity ends as 0 or as the largest number just as the largest number itself would.
  [[gnu::noinline, gnu::cold]] static Scalar saturated(Scalar spring, Scalar damper, Scalar field) {
    const Scalar force = together(spring > largest ? largest : spring, damper, field);
    return force > largest ? largest : force;
  }

  AdaptiveCoefficient<Scalar> adaptive_;
  GrowingStiffness<Scalar> stiffness_;
};

}  // namespace kmax::control
