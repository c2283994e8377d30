#include "firmware/drive/axis_configuration.hpp"

#include <gtest/gtest.h>

namespace kmax::firmware::axis_configuration_test {
namespace {

TEST(AxisConfiguration, CountLengthIsTravelPerTurnOverCounts) {
  ParameterValues values;
  values.set_real<"device.transmission">(0.05f, 1);
  values.set_whole<"encoder.counts_per_turn">(8192, 1);
  EXPECT_DOUBLE_EQ(count_length(values, 1), 2 * 3.14159265358979323846 * static_cast<double>(0.05f) / 8192);
  values.set_whole<"encoder.counts_per_turn">(1'000'000'000, 1);
  EXPECT_DOUBLE_EQ(count_length(values, 1), 2 * 3.14159265358979323846 * static_cast<double>(0.05f) / 1e9);
}

TEST(AxisConfiguration, EveryParameterArrivesAndOnlyFromItsAxis) {
  ParameterValues v;
  constexpr std::size_t axis = 1;
  float next = 1.0f;
  const auto distinct = [&next] { return next += 1.0f; };
  v.set_whole<"wall.law">(3, axis);
  v.set_real<"wall.position">(distinct(), axis);
  v.set_whole<"wall.side">(static_cast<std::uint32_t>(-1), axis);
  v.set_real<"wall.stiffness">(distinct(), axis);
  v.set_real<"wall.damping">(distinct(), axis);
  v.set_real<"wall.magnetic_coefficient">(distinct(), axis);
  v.set_real<"wall.magnetic_length">(distinct(), axis);
  v.set_real<"wall.adaptive_gain">(distinct(), axis);
  v.set_real<"wall.adaptive_offset">(distinct(), axis);
  v.set_real<"wall.adaptive_velocity_max">(distinct(), axis);
  v.set_whole<"wall.adaptive_relation">(1, axis);
  v.set_real<"wall.adaptive_force_min">(distinct(), axis);
  v.set_real<"wall.adaptive_force_max">(distinct(), axis);
  v.set_whole<"wall.adaptive_velocity">(1, axis);
  v.set_whole<"wall.adaptive_mode">(2, axis);
  v.set_real<"wall.adaptive_hold_time">(distinct(), axis);
  v.set_whole<"interference.mode">(2, axis);
  v.set_real<"interference.force">(distinct(), axis);
  v.set_real<"interference.background_force">(distinct(), axis);
  v.set_real<"interference.onset_time">(distinct(), axis);
  v.set_real<"position.resolution">(distinct(), axis);
  v.set_whole<"position.rounding">(2, axis);
  v.set_whole<"velocity.estimator">(4, axis);
  v.set_whole<"velocity.window">(9, axis);
  v.set_real<"velocity.bandwidth">(distinct(), axis);
  v.set_real<"velocity.limit">(distinct(), axis);
  v.set_real<"haptic.rate">(500.0f, axis);
  v.set_real<"force.limit">(distinct(), axis);
  v.set_real<"force.slew_limit">(distinct(), axis);
  v.set_real<"force.ramp_time">(distinct(), axis);

  const auto c = haptic_configuration(v, axis);
  EXPECT_EQ(c.wall.kind, control::WallKind::adaptive);
  EXPECT_EQ(c.wall_position, 2.0);
  EXPECT_EQ(c.wall_side, -1);
  EXPECT_EQ(c.wall.stiffness, 3.0f);
  EXPECT_EQ(c.wall.damping, 4.0f);
  EXPECT_EQ(c.wall.magnetic_coefficient, 5.0f);
  EXPECT_EQ(c.wall.magnetic_length, 6.0f);
  EXPECT_EQ(c.wall.adaptive.gain, 7.0f);
  EXPECT_EQ(c.wall.adaptive.offset, 8.0f);
  EXPECT_EQ(c.wall.adaptive.velocity_max, 9.0f);
  EXPECT_EQ(c.wall.adaptive.relation, control::AdaptiveRelation::square);
  EXPECT_EQ(c.wall.adaptive.force_min, 10.0f);
  EXPECT_EQ(c.wall.adaptive.force_max, 11.0f);
  EXPECT_EQ(c.wall.adaptive.velocity, control::AdaptiveVelocity::speed);
  EXPECT_EQ(c.wall.adaptive.mode, control::AdaptiveMode::peak_hold);
  EXPECT_EQ(c.wall.adaptive.hold_time, 12.0f);
  EXPECT_EQ(c.interference.mode, control::InterferenceMode::parallel);
  EXPECT_EQ(c.interference.force, 13.0f);
  EXPECT_EQ(c.interference.background_force, 14.0f);
  EXPECT_EQ(c.interference.onset_time, 15.0f);
  EXPECT_EQ(c.position_resolution, 16.0);
  EXPECT_EQ(c.position_rounding, control::Rounding::hysteresis);
  EXPECT_EQ(c.velocity.kind, control::VelocityEstimatorKind::tracking);
  EXPECT_EQ(c.velocity.window, 9);
  EXPECT_EQ(c.velocity.bandwidth, 17.0f);
  EXPECT_EQ(c.velocity_limit, 18.0f);
  EXPECT_EQ(c.force.limit, 19.0f);
  EXPECT_EQ(c.force.slew_limit, 20.0f);
  EXPECT_EQ(c.force.ramp_time, 21.0f);
  EXPECT_EQ(c.divider, 40u);
  EXPECT_EQ(c.tick_rate, 20000.0);

  const auto untouched = haptic_configuration(v, 0), defaults = haptic_configuration(ParameterValues{}, 0);
  EXPECT_EQ(untouched.wall.stiffness, defaults.wall.stiffness);
  EXPECT_EQ(untouched.wall_position, defaults.wall_position);
  EXPECT_EQ(untouched.divider, 1u);
}

TEST(AxisConfiguration, TheMotorsParametersArrive) {
  ParameterValues v;
  float next = 1.0f;
  v.set_real<"device.transmission">(next++, 1);
  v.set_real<"motor.torque_constant">(next++, 1);
  v.set_real<"motor.resistance">(next++, 1);
  v.set_real<"motor.inductance">(next++, 1);
  v.set_real<"motor.inductance_q">(next++, 1);
  v.set_real<"motor.electrical_offset">(next++, 1);
  v.set_real<"current.limit">(next++, 1);
  v.set_real<"current.bandwidth">(next++, 1);
  v.set_real<"compensation.dead_time">(next++, 1);
  v.set_real<"compensation.dead_time_current">(next++, 1);
  v.set_whole<"motor.kind">(1, 1);
  v.set_whole<"motor.pole_pairs">(11, 1);
  v.set_whole<"encoder.counts_per_turn">(4000, 1);
  const auto c = motor_configuration(v, 1, 61.0f, 0.75f);
  next = 1.0f;
  EXPECT_EQ(c.transmission, next++);
  EXPECT_EQ(c.torque_constant, next++);
  EXPECT_EQ(c.resistance, next++);
  EXPECT_EQ(c.inductance, next++);
  EXPECT_EQ(c.inductance_q, next++);
  EXPECT_EQ(c.electrical_offset, next++);
  EXPECT_EQ(c.current_limit, next++);
  EXPECT_EQ(c.bandwidth, next++);
  EXPECT_EQ(c.dead_time, next++);
  EXPECT_EQ(c.dead_time_current, next++);
  EXPECT_EQ(c.kind, MotorKind::pmsm);
  EXPECT_EQ(c.pole_pairs, 11);
  EXPECT_EQ(c.counts_per_turn, 4000u);
  EXPECT_EQ(c.winding_temperature, 61.0f);
  EXPECT_EQ(c.current_share, 0.75f);
  EXPECT_EQ(c.tick_rate, 20000.0f);
}

TEST(AxisConfiguration, TheCompensationsParametersArrive) {
  ParameterValues v;
  float next = 1.0f;
  v.set_real<"compensation.limit">(next++, 1);
  v.set_real<"compensation.friction">(next++, 1);
  v.set_real<"compensation.friction_velocity">(next++, 1);
  v.set_real<"compensation.cogging_cosine_1">(next++, 1);
  v.set_real<"compensation.cogging_sine_1">(next++, 1);
  v.set_real<"compensation.cogging_cosine_2">(next++, 1);
  v.set_real<"compensation.cogging_sine_2">(next++, 1);
  v.set_real<"compensation.gravity_constant">(next++, 1);
  v.set_real<"compensation.gravity_cosine">(next++, 1);
  v.set_real<"compensation.gravity_sine">(next++, 1);
  v.set_whole<"compensation.cogging_periods">(42, 1);
  const auto c = compensation_configuration(v, 1);
  next = 1.0f;
  EXPECT_EQ(c.limit, next++);
  EXPECT_EQ(c.friction, next++);
  EXPECT_EQ(c.friction_velocity, next++);
  EXPECT_EQ(c.cogging_cosine_1, next++);
  EXPECT_EQ(c.cogging_sine_1, next++);
  EXPECT_EQ(c.cogging_cosine_2, next++);
  EXPECT_EQ(c.cogging_sine_2, next++);
  EXPECT_EQ(c.gravity_constant, next++);
  EXPECT_EQ(c.gravity_cosine, next++);
  EXPECT_EQ(c.gravity_sine, next++);
  EXPECT_EQ(c.cogging_periods, 42u);
}

TEST(AxisConfiguration, TheExcitationsParametersArrive) {
  ParameterValues v;
  float next = 1.0f;
  v.set_real<"excitation.bias">(next++, 1);
  v.set_real<"excitation.alternation">(next++, 1);
  v.set_real<"excitation.angle">(next++, 1);
  v.set_real<"excitation.angle_rate">(next++, 1);
  v.set_real<"excitation.angle_span">(next++, 1);
  v.set_real<"excitation.ramp">(next++, 1);
  v.set_real<"excitation.duration">(next++, 1);
  v.set_real<"excitation.travel">(next++, 1);
  v.set_real<"excitation.stiffness">(next++, 1);
  v.set_real<"excitation.damping">(next++, 1);
  v.set_real<"excitation.speed">(next++, 1);
  v.set_real<"excitation.stroke">(next++, 1);
  v.set_real<"force.limit">(next++, 1);
  v.set_whole<"excitation.kind">(2, 1);
  v.set_whole<"excitation.run">(65535, 1);
  v.set_whole<"excitation.half_period">(77, 1);
  v.set_whole<"excitation.alternation_axis">(1, 1);
  const auto c = excitation_configuration(v, 1);
  next = 1.0f;
  EXPECT_EQ(c.bias, next++);
  EXPECT_EQ(c.alternation, next++);
  EXPECT_EQ(c.angle, next++);
  EXPECT_EQ(c.angle_rate, next++);
  EXPECT_EQ(c.angle_span, next++);
  EXPECT_EQ(c.ramp, next++);
  EXPECT_EQ(c.duration, next++);
  EXPECT_EQ(c.travel, next++);
  EXPECT_EQ(c.stiffness, next++);
  EXPECT_EQ(c.damping, next++);
  EXPECT_EQ(c.speed, next++);
  EXPECT_EQ(c.stroke, next++);
  EXPECT_EQ(c.force_limit, next++);
  EXPECT_EQ(static_cast<int>(c.kind), 2);
  EXPECT_EQ(c.run, 65535u);
  EXPECT_EQ(c.half_period, 77u);
  EXPECT_EQ(static_cast<int>(c.alternation_axis), 1);
  EXPECT_EQ(c.count_length, count_length(v, 1));
  EXPECT_EQ(c.tick_rate, 20000.0f);
}

TEST(AxisConfiguration, TheThermalParametersArrive) {
  ParameterValues v;
  float next = 1.0f;
  v.set_real<"motor.resistance">(next++, 1);
  v.set_real<"temperature.winding_capacity">(next++, 1);
  v.set_real<"temperature.winding_resistance">(next++, 1);
  v.set_real<"temperature.case_capacity">(next++, 1);
  v.set_real<"temperature.case_resistance">(next++, 1);
  v.set_real<"temperature.ambient">(next++, 1);
  v.set_real<"temperature.motor_limit">(next++, 1);
  v.set_real<"temperature.limit">(next++, 1);
  v.set_real<"temperature.derating">(next++, 1);
  const auto c = thermal_configuration(v, 1);
  next = 1.0f;
  EXPECT_EQ(c.winding.resistance, next++);
  EXPECT_EQ(c.winding.winding_capacity, next++);
  EXPECT_EQ(c.winding.winding_to_case, next++);
  EXPECT_EQ(c.winding.case_capacity, next++);
  EXPECT_EQ(c.winding.case_to_ambient, next++);
  EXPECT_EQ(c.winding.ambient_temperature, next++);
  EXPECT_EQ(c.motor_limit, next++);
  EXPECT_EQ(c.power_stage_limit, next++);
  EXPECT_EQ(c.derating, next++);
  EXPECT_EQ(c.winding.loss_factor, 1.0f) << "a DC motor, from terminal to terminal";
  v.set_whole<"motor.kind">(1, 1);
  EXPECT_EQ(thermal_configuration(v, 1).winding.loss_factor, 1.5f) << "three phases";
}

TEST(AxisConfiguration, TheWatchAndTheDetectorHaveTheirParameters) {
  ParameterValues v;
  v.set_real<"device.mass">(2.0f, 1);
  v.set_real<"device.hand_force">(3.0f, 1);
  v.set_real<"instability.force">(4.0f, 1);
  v.set_real<"instability.amplitude">(5.0f, 1);
  v.set_whole<"instability.action">(3, 1);
  EXPECT_EQ(plausibility_configuration(v, 1).mass, 2.0f);
  EXPECT_EQ(plausibility_configuration(v, 1).hand_force, 3.0f);
  const auto haptic = haptic_configuration(v, 1);
  EXPECT_EQ(haptic.instability.force_threshold, 4.0f);
  EXPECT_EQ(haptic.instability.displacement_threshold, 5.0f);
  EXPECT_EQ(haptic.instability_action, control::InstabilityAction::trip);
}

TEST(AxisConfiguration, TheSuppliesCeilingBoundsItsTripLevelIfItIsKnown) {
  ParameterValues v;
  v.set_real<"supply.voltage_max">(30.0f);
  EXPECT_EQ(highest_supply(v), 30.0f) << "no ceiling is known";
  v.set_real<"supply.ceiling">(26.0f);
  EXPECT_EQ(highest_supply(v), 26.0f);
  v.set_real<"supply.ceiling">(31.0f);
  EXPECT_EQ(highest_supply(v), 30.0f);
}

TEST(AxisConfiguration, EveryAllowedRateGivesItsDivider) {
  for (std::uint32_t divider = 1; divider <= 200; ++divider) {
    ParameterValues v;
    v.set_real<"haptic.rate">(static_cast<float>(20000.0 / divider));
    EXPECT_EQ(haptic_configuration(v, 0).divider, divider);
  }
}

}  // namespace
}  // namespace kmax::firmware::axis_configuration_test
