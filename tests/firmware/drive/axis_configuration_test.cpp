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

TEST(AxisConfiguration, EveryAllowedRateGivesItsDivider) {
  for (std::uint32_t divider = 1; divider <= 200; ++divider) {
    ParameterValues v;
    v.set_real<"haptic.rate">(static_cast<float>(20000.0 / divider));
    EXPECT_EQ(haptic_configuration(v, 0).divider, divider);
  }
}

}  // namespace
}  // namespace kmax::firmware::axis_configuration_test
