#pragma once

#include <cstdint>
#include <limits>

#include "control/adaptive_coefficient.hpp"
#include "control/finite.hpp"

namespace kmax::control {

/// Which law renders the wall (paper 1: "A Human Arm's Mechanical Impedance Tuning Method ...", 2020).
enum class WallKind : std::uint8_t {
  none,      ///< no force
  plain,     ///< eq. 3: a one-sided spring
  magnetic,  ///< eqs. 5 and 6: the spring plus a repulsive field of constant coefficient ("IT")
  adaptive,  ///< eqs. 5 to 7: the field's coefficient follows the velocity ("AIT")
};

template <typename Scalar>
struct WallLawConfig {
  WallKind kind = WallKind::plain;
  Scalar stiffness = Scalar(1000);          ///< K, N/m, >= 0
  Scalar damping = Scalar(0);               ///< B, N s/m, >= 0
  Scalar magnetic_coefficient = Scalar(2);  ///< F_MC, N, >= 0; constant law only
  Scalar magnetic_length = Scalar(0.001);   ///< x_0, m, > 0
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
/// with F_MC = 0 for the plain wall. The damper acts inside only and is bounded together with the spring:
/// the sum never pulls the handle in, and on the way out the force meets the field's F_MC at the surface
/// without a step. Every finite input gives a finite, non-negative force: what overflows is brought back
/// to the largest number (the force limiter downstream is what bounds it to something sensible). A NaN
/// passes through as a NaN: HapticLoop turns it into zero force and a fault.
///
/// Cost: about 40 instructions and one division on a Cortex-M4F, plus the adaptive coefficient's.
template <typename Scalar>
class WallLaw {
 public:
  struct Coefficients {
    WallKind kind = WallKind::none;
    Scalar stiffness{}, damping{}, magnetic_coefficient{}, inverse_magnetic_length{};
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
    c.stiffness = config.stiffness;
    c.damping = config.damping;
    c.magnetic_coefficient = config.kind == WallKind::magnetic ? config.magnetic_coefficient : Scalar(0);
    c.inverse_magnetic_length = saturate(Scalar(1) / config.magnetic_length);
    c.adaptive = AdaptiveCoefficient<Scalar>::prepare(config.adaptive, period);
    return c;
  }

  void reset() { adaptive_.reset(); }

  Output update(const Coefficients& c, Scalar outside_distance, Scalar outward_velocity) {
    Output out;
    out.inside = !(outside_distance > Scalar(0));
    if (c.kind == WallKind::none) return out;

    out.magnetic_coefficient = c.kind == WallKind::adaptive
                                   ? adaptive_.update(c.adaptive, outward_velocity, out.inside)
                                   : c.magnetic_coefficient;
    if (out.inside) {
      const Scalar spring = saturate(c.stiffness * -outside_distance);
      Scalar reaction = saturate(spring - saturate(c.damping * outward_velocity));
      if (reaction < Scalar(0)) reaction = Scalar(0);
      out.magnetic_force = out.magnetic_coefficient;
      out.force = saturate(reaction + out.magnetic_force);
    } else {
      const Scalar ratio = outside_distance * c.inverse_magnetic_length + Scalar(1);
      out.magnetic_force = out.magnetic_coefficient / (ratio * ratio);
      out.force = out.magnetic_force;
    }
    return out;
  }

 private:
  AdaptiveCoefficient<Scalar> adaptive_;
};

}  // namespace kmax::control
