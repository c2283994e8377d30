#pragma once

#include "control/haptic_loop.hpp"
#include "firmware/motor_control.hpp"
#include "firmware/parameter_values.hpp"

namespace kmax::firmware {

/// Handle travel per encoder count, m. Outside the interrupt: in double, so that a position of many counts
/// keeps its scale.
constexpr double count_length(const ParameterValues& values, std::size_t axis) {
  constexpr double turn = 6.283185307179586476925;
  return turn * static_cast<double>(values.real<"device.transmission">(axis)) /
         static_cast<double>(static_cast<std::uint32_t>(values.whole<"encoder.counts_per_turn">(axis)));
}

/// The wall law's part of the parameters, also what `kmax wall` evaluates.
template <typename Scalar>
constexpr control::WallLawConfig<Scalar> wall_configuration(const ParameterValues& v, std::size_t axis) {
  control::WallLawConfig<Scalar> wall;
  wall.kind = v.choice<control::WallKind, "wall.law">(axis);
  wall.stiffness = Scalar(v.real<"wall.stiffness">(axis));
  wall.damping = Scalar(v.real<"wall.damping">(axis));
  wall.magnetic_coefficient = Scalar(v.real<"wall.magnetic_coefficient">(axis));
  wall.magnetic_length = Scalar(v.real<"wall.magnetic_length">(axis));
  wall.adaptive.gain = Scalar(v.real<"wall.adaptive_gain">(axis));
  wall.adaptive.offset = Scalar(v.real<"wall.adaptive_offset">(axis));
  wall.adaptive.velocity_max = Scalar(v.real<"wall.adaptive_velocity_max">(axis));
  wall.adaptive.force_min = Scalar(v.real<"wall.adaptive_force_min">(axis));
  wall.adaptive.force_max = Scalar(v.real<"wall.adaptive_force_max">(axis));
  wall.adaptive.hold_time = Scalar(v.real<"wall.adaptive_hold_time">(axis));
  wall.adaptive.relation = v.choice<control::AdaptiveRelation, "wall.adaptive_relation">(axis);
  wall.adaptive.velocity = v.choice<control::AdaptiveVelocity, "wall.adaptive_velocity">(axis);
  wall.adaptive.mode = v.choice<control::AdaptiveMode, "wall.adaptive_mode">(axis);
  return wall;
}

/// All of one axis' parameters as the haptic loop's configuration.
constexpr control::HapticLoopConfig<float> haptic_configuration(const ParameterValues& v, std::size_t axis) {
  control::HapticLoopConfig<float> config;
  config.count_length = count_length(v, axis);
  config.wall_position = static_cast<double>(v.real<"wall.position">(axis));
  config.wall_side = v.whole<"wall.side">(axis);
  config.position_resolution = static_cast<double>(v.real<"position.resolution">(axis));
  config.position_rounding = v.choice<control::Rounding, "position.rounding">(axis);
  config.velocity.kind = v.choice<control::VelocityEstimatorKind, "velocity.estimator">(axis);
  config.velocity.window = v.whole<"velocity.window">(axis);
  config.velocity.bandwidth = v.real<"velocity.bandwidth">(axis);
  config.velocity_limit = v.real<"velocity.limit">(axis);
  config.wall = wall_configuration<float>(v, axis);
  config.interference.mode = v.choice<control::InterferenceMode, "interference.mode">(axis);
  config.interference.force = v.real<"interference.force">(axis);
  config.interference.background_force = v.real<"interference.background_force">(axis);
  config.interference.onset_time = v.real<"interference.onset_time">(axis);
  config.force.limit = v.real<"force.limit">(axis);
  config.force.slew_limit = v.real<"force.slew_limit">(axis);
  config.force.ramp_time = v.real<"force.ramp_time">(axis);
  config.tick_rate = static_cast<double>(tick_rate_hz);
  config.divider =
      static_cast<std::uint32_t>(static_cast<float>(tick_rate_hz) / v.real<"haptic.rate">(axis) + 0.5f);
  return config;
}

/// The motor's part of one axis' parameters.
constexpr MotorControlConfig motor_configuration(const ParameterValues& v, std::size_t axis) {
  MotorControlConfig config;
  config.kind = v.choice<MotorKind, "motor.kind">(axis);
  config.transmission = v.real<"device.transmission">(axis);
  config.torque_constant = v.real<"motor.torque_constant">(axis);
  config.resistance = v.real<"motor.resistance">(axis);
  config.inductance = v.real<"motor.inductance">(axis);
  config.pole_pairs = v.whole<"motor.pole_pairs">(axis);
  config.electrical_offset = v.real<"motor.electrical_offset">(axis);
  config.counts_per_turn = static_cast<std::uint32_t>(v.whole<"encoder.counts_per_turn">(axis));
  config.current_limit = v.real<"current.limit">(axis);
  config.bandwidth = v.real<"current.bandwidth">(axis);
  config.tick_rate = static_cast<float>(tick_rate_hz);
  return config;
}

}  // namespace kmax::firmware
