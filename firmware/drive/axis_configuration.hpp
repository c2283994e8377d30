#pragma once

#include "control/force_compensation.hpp"
#include "control/haptic_loop.hpp"
#include "control/motion_plausibility.hpp"
#include "firmware/drive/excitation.hpp"
#include "firmware/drive/motor_control.hpp"
#include "firmware/drive/thermal_supervisor.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// Handle travel per encoder count, m. Outside the interrupt: in double, so that a position of many counts
/// keeps its scale.
constexpr double count_length(const ParameterValues& values, std::size_t axis) {
  constexpr double turn = 6.283185307179586476925;
  return turn * static_cast<double>(values.real<"device.transmission">(axis)) /
         static_cast<double>(static_cast<std::uint32_t>(values.whole<"encoder.counts_per_turn">(axis)));
}

/// V, above which the supply trips an armed axis, whatever the parameter says.
constexpr float highest_supply(const ParameterValues& v) {
  const float asked = v.real<"supply.voltage_max">(), ceiling = v.real<"supply.ceiling">();
  return ceiling > 0.0f && ceiling < asked ? ceiling : asked;
}

/// The wall law's part of the parameters, also what `kmax wall` evaluates.
template <typename Scalar>
constexpr control::WallLawConfig<Scalar> wall_configuration(const ParameterValues& v, std::size_t axis) {
  control::WallLawConfig<Scalar> wall;
  wall.kind = v.choice<control::WallKind, "wall.law">(axis);
  wall.stiffness = Scalar(v.real<"wall.stiffness">(axis));
  wall.growing.touch_stiffness = Scalar(v.real<"wall.touch_stiffness">(axis));
  wall.growing.growth_time = Scalar(v.real<"wall.growth_time">(axis));
  wall.growing.calm_velocity = Scalar(v.real<"wall.calm_velocity">(axis));
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
  config.damping_window = v.whole<"wall.damping_window">(axis);
  config.velocity_limit = v.real<"velocity.limit">(axis);
  config.wall = wall_configuration<float>(v, axis);
  config.interference.mode = v.choice<control::InterferenceMode, "interference.mode">(axis);
  config.interference.force = v.real<"interference.force">(axis);
  config.interference.background_force = v.real<"interference.background_force">(axis);
  config.interference.onset_time = v.real<"interference.onset_time">(axis);
  config.force.limit = v.real<"force.limit">(axis);
  config.force.slew_limit = v.real<"force.slew_limit">(axis);
  config.force.ramp_time = v.real<"force.ramp_time">(axis);
  config.instability_action = v.choice<control::InstabilityAction, "instability.action">(axis);
  config.instability.force_threshold = v.real<"instability.force">(axis);
  config.instability.displacement_threshold = v.real<"instability.amplitude">(axis);
  config.tick_rate = static_cast<double>(tick_rate_hz);
  config.divider =
      static_cast<std::uint32_t>(static_cast<float>(tick_rate_hz) / v.real<"haptic.rate">(axis) + 0.5f);
  return config;
}

/// The motor's part of one axis' parameters.
///
/// `winding_temperature`: degC, which the controllers' resistance follows. `current_share`: what the
/// temperatures leave of the current limit.
constexpr MotorControlConfig motor_configuration(const ParameterValues& v, std::size_t axis,
                                                 float winding_temperature, float current_share) {
  MotorControlConfig config;
  config.winding_temperature = winding_temperature;
  config.current_share = current_share;
  config.kind = v.choice<MotorKind, "motor.kind">(axis);
  config.transmission = v.real<"device.transmission">(axis);
  config.torque_constant = v.real<"motor.torque_constant">(axis);
  config.resistance = v.real<"motor.resistance">(axis);
  config.inductance = v.real<"motor.inductance">(axis);
  config.inductance_q = v.real<"motor.inductance_q">(axis);
  config.pole_pairs = v.whole<"motor.pole_pairs">(axis);
  config.electrical_offset = v.real<"motor.electrical_offset">(axis);
  config.counts_per_turn = static_cast<std::uint32_t>(v.whole<"encoder.counts_per_turn">(axis));
  config.current_limit = v.real<"current.limit">(axis);
  config.bandwidth = v.real<"current.bandwidth">(axis);
  config.dead_time = v.real<"compensation.dead_time">(axis);
  config.dead_time_current = v.real<"compensation.dead_time_current">(axis);
  config.tick_rate = static_cast<float>(tick_rate_hz);
  return config;
}

constexpr control::ForceCompensationConfig<float> compensation_configuration(const ParameterValues& v,
                                                                             std::size_t axis) {
  control::ForceCompensationConfig<float> config;
  config.limit = v.real<"compensation.limit">(axis);
  config.friction = v.real<"compensation.friction">(axis);
  config.friction_velocity = v.real<"compensation.friction_velocity">(axis);
  config.cogging_periods = static_cast<std::uint32_t>(v.whole<"compensation.cogging_periods">(axis));
  config.cogging_cosine_1 = v.real<"compensation.cogging_cosine_1">(axis);
  config.cogging_sine_1 = v.real<"compensation.cogging_sine_1">(axis);
  config.cogging_cosine_2 = v.real<"compensation.cogging_cosine_2">(axis);
  config.cogging_sine_2 = v.real<"compensation.cogging_sine_2">(axis);
  config.gravity_constant = v.real<"compensation.gravity_constant">(axis);
  config.gravity_cosine = v.real<"compensation.gravity_cosine">(axis);
  config.gravity_sine = v.real<"compensation.gravity_sine">(axis);
  return config;
}

constexpr control::MotionPlausibilityConfig<float> plausibility_configuration(const ParameterValues& v,
                                                                              std::size_t axis) {
  control::MotionPlausibilityConfig<float> config;
  config.mass = v.real<"device.mass">(axis);
  config.hand_force = v.real<"device.hand_force">(axis);
  return config;
}

constexpr ExcitationConfig excitation_configuration(const ParameterValues& v, std::size_t axis) {
  ExcitationConfig config;
  config.kind = v.choice<ExcitationKind, "excitation.kind">(axis);
  config.run = static_cast<std::uint32_t>(v.whole<"excitation.run">(axis));
  config.bias = v.real<"excitation.bias">(axis);
  config.alternation = v.real<"excitation.alternation">(axis);
  config.half_period = static_cast<std::uint32_t>(v.whole<"excitation.half_period">(axis));
  config.alternation_axis = v.choice<AlternationAxis, "excitation.alternation_axis">(axis);
  config.angle = v.real<"excitation.angle">(axis);
  config.angle_rate = v.real<"excitation.angle_rate">(axis);
  config.angle_span = v.real<"excitation.angle_span">(axis);
  config.ramp = v.real<"excitation.ramp">(axis);
  config.duration = v.real<"excitation.duration">(axis);
  config.travel = v.real<"excitation.travel">(axis);
  config.stiffness = v.real<"excitation.stiffness">(axis);
  config.damping = v.real<"excitation.damping">(axis);
  config.speed = v.real<"excitation.speed">(axis);
  config.stroke = v.real<"excitation.stroke">(axis);
  config.force_limit = v.real<"force.limit">(axis);
  config.count_length = count_length(v, axis);
  config.tick_rate = static_cast<float>(tick_rate_hz);
  return config;
}

constexpr ThermalSupervisorConfig thermal_configuration(const ParameterValues& v, std::size_t axis) {
  ThermalSupervisorConfig config;
  config.winding.resistance = v.real<"motor.resistance">(axis);
  // Copper losses of three phases whose current's amplitude is the q current's.
  config.winding.loss_factor = v.choice<MotorKind, "motor.kind">(axis) == MotorKind::dc ? 1.0f : 1.5f;
  config.winding.winding_capacity = v.real<"temperature.winding_capacity">(axis);
  config.winding.winding_to_case = v.real<"temperature.winding_resistance">(axis);
  config.winding.case_capacity = v.real<"temperature.case_capacity">(axis);
  config.winding.case_to_ambient = v.real<"temperature.case_resistance">(axis);
  config.winding.ambient_temperature = v.real<"temperature.ambient">(axis);
  config.motor_limit = v.real<"temperature.motor_limit">(axis);
  config.power_stage_limit = v.real<"temperature.limit">(axis);
  config.derating = v.real<"temperature.derating">(axis);
  return config;
}

}  // namespace kmax::firmware
