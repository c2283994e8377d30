#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "control/current_loop_delay.hpp"
#include "control/resampler.hpp"
#include "control/stability_case.hpp"
#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware {

/// A parameter of an axis that the stability case is made of. What wall law, guard and `kmax check` need to
/// know of it stands here alone; tests hold the list against what is read.
struct CaseParameter {
  /// Which change of it alone may meet a criterion that fails.
  enum class Remedy : std::uint8_t { none, lower, higher, either };

  std::uint8_t entry;
  Remedy remedy = Remedy::none;
  bool fact = false;  ///< about device or operator: to be changed only if it is true
  bool guard = true;  ///< the criteria of the guard read it too
};

/// The user's own choices first, the wall before all.
inline constexpr auto case_parameters = [] {
  using enum CaseParameter::Remedy;
  return std::to_array<CaseParameter>({
      {entry_of<"wall.stiffness">(), lower},
      {entry_of<"wall.damping">(), either},
      {entry_of<"wall.magnetic_coefficient">(), lower},
      {entry_of<"wall.adaptive_force_max">(), lower},
      {entry_of<"wall.magnetic_length">(), higher},
      {entry_of<"wall.adaptive_gain">()},
      {entry_of<"wall.adaptive_offset">()},
      {entry_of<"wall.adaptive_force_min">()},
      {entry_of<"wall.law">()},
      {entry_of<"haptic.rate">(), higher},
      {entry_of<"current.bandwidth">(), higher},
      {entry_of<"position.resolution">(), lower},
      {entry_of<"force.limit">(), higher, false, false},
      {entry_of<"device.transmission">()},
      {entry_of<"encoder.counts_per_turn">()},
      {entry_of<"device.mass">(), none, true, false},
      {entry_of<"guard.delay">(), lower, true},
      {entry_of<"guard.damping">(), higher, true},
      {entry_of<"guard.friction">(), higher, true},
      {entry_of<"guard.operator_force">(), higher, true},
      {entry_of<"guard.operator_speed">(), lower, true},
  });
}();

/// What the stability criteria judge, out of one axis' parameters; the guard before arming and `kmax check`
/// go by the same.
///
///   K, B             wall.stiffness, wall.damping; 0 with wall.law none
///   F_MC, x_0        the largest coefficient the law can command, at whatever velocity: none for plain;
///                    wall.magnetic_coefficient for magnetic; for adaptive what eq. 7 gives at V_max within
///                    its interval
///   T                1 / haptic.rate
///   T_d              guard.delay and that of the current loop (control/current_loop_delay.hpp)
///   quantum          the step in use: whole encoder counts, as position.resolution is rounded
///   m, b, f_c        device.mass, guard.damping, guard.friction
///   F_h, v           guard.operator_force, guard.operator_speed
///   force limit      force.limit
///
/// Nobody holds the handle: the damping of a hand is not counted on. Left out: the velocity that eq. 7 of the
/// adaptive law feeds back (a damper on the way in, and with wall.adaptive_velocity = speed a negative one on
/// the way out), the lag of the velocity estimator, the force slew limit, force compensation.
///
/// `number`: a float parameter as the criteria's Scalar. Outside the interrupt.
template <typename Scalar, typename Number>
control::StabilityCase<Scalar> stability_case(const ParameterValues& values, std::size_t axis,
                                              Number number) {
  control::StabilityCase<Scalar> judged;
  const auto wall = wall_configuration<float>(values, axis);
  // All of them, and no default: a law that nobody has thought of here does not compile.
  float largest_coefficient = 0.0f;
  switch (wall.kind) {
    case control::WallKind::none:
    case control::WallKind::plain:
      break;
    case control::WallKind::magnetic:
      largest_coefficient = wall.magnetic_coefficient;
      break;
    case control::WallKind::adaptive:
      // The period matters for the decay only.
      largest_coefficient = control::AdaptiveCoefficient<float>::prepare(wall.adaptive, 1.0f).most;
      break;
  }
  if (wall.kind != control::WallKind::none) {
    judged.stiffness = number(values.real<"wall.stiffness">(axis));
    judged.wall_damping = number(values.real<"wall.damping">(axis));
    judged.magnetic_coefficient = number(largest_coefficient);
  }
  const double count = count_length(values, axis);
  judged.magnetic_length = number(wall.magnetic_length);
  judged.period = Scalar(1) / number(values.real<"haptic.rate">(axis));
  judged.delay =
      number(values.real<"guard.delay">(axis)) +
      control::current_loop_delay(number(values.real<"current.bandwidth">(axis)), Scalar{tick_rate_hz});
  judged.quantum = static_cast<Scalar>(
      count * control::resampler_step(static_cast<double>(values.real<"position.resolution">(axis)), count));
  judged.mass = number(values.real<"device.mass">(axis));
  judged.damping = number(values.real<"guard.damping">(axis));
  judged.friction = number(values.real<"guard.friction">(axis));
  judged.operator_force = number(values.real<"guard.operator_force">(axis));
  judged.operator_speed = number(values.real<"guard.operator_speed">(axis));
  judged.force_limit = number(values.real<"force.limit">(axis));
  return judged;
}

/// In float, as the device judges it.
inline control::StabilityCase<float> stability_case(const ParameterValues& values, std::size_t axis) {
  return stability_case<float>(values, axis, [](float value) { return value; });
}

}  // namespace kmax::firmware
