#include "control/haptic_loop.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "firmware/object_dictionary/axis_groups.hpp"
#include "tests/control/ticked_loop.hpp"

namespace kmax::control::haptic_loop_test {

WallKind any_law() {
  return static_cast<WallKind>(*rc::gen::inRange<std::size_t>(0, std::size(firmware::names::wall_law)));
}

TEST(HapticLoop, PenetrationIsExactToTheCountTenMetresFromZero) {
  // 0.1 um counts, the surface at 10 m: 10^8 counts, where a float position would be 8 counts coarse.
  for (const int side : {1, -1}) {
    auto config = plain_wall<float>();
    config.count_length = 1e-7;
    config.wall_position = 10.0;
    config.wall_side = side;
    Loop<float> loop(config, 100'000'000);
    for (std::int64_t n = 1; n <= 20000; ++n) {
      const auto& out = loop.at(100'000'000 - side * n);
      ASSERT_TRUE(out.inside);
      const float penetration = -out.outside_distance;
      ASSERT_EQ(std::lround(static_cast<double>(penetration) / 1e-7), n);
      // One rounding of the count length and one of the product.
      ASSERT_NEAR(static_cast<double>(penetration), static_cast<double>(n) * 1e-7,
                  static_cast<double>(n) * 1e-7 * 2e-7);
    }
    EXPECT_FALSE(loop.at(100'000'000 + side).inside);
  }
}

TEST(HapticLoop, ASurfaceBetweenTwoCountsKeepsItsFraction) {
  auto config = plain_wall<double>();
  config.wall_position = 2.25e-6;
  Loop<double> loop(config);
  EXPECT_NEAR(loop.at(2).outside_distance, -0.25e-6, 1e-18);
  EXPECT_NEAR(loop.at(3).outside_distance, 0.75e-6, 1e-18);
  config.wall_position = -2.25e-6;
  EXPECT_NEAR(Loop<double>(config).at(-3).outside_distance, -0.75e-6, 1e-18);
}

RC_GTEST_PROP(HapticLoop, TheOtherSideIsTheMirrorImageToTheBit, ()) {
  auto config = plain_wall<float>();
  config.damping_window = *rc::gen::inRange(0, 17);
  config.wall.growing.touch_stiffness = *rc::gen::element(0.0F, 200.0F);
  config.wall.kind = any_law();
  config.wall.damping = static_cast<float>(*rc::gen::inRange(0, 10));
  config.interference.mode = *rc::gen::element(InterferenceMode::none, InterferenceMode::perpendicular);
  config.interference.force = 1.0f;
  config.velocity.kind =
      *rc::gen::element(VelocityEstimatorKind::difference, VelocityEstimatorKind::low_pass,
                        VelocityEstimatorKind::foaw, VelocityEstimatorKind::foaw_end_fit,
                        VelocityEstimatorKind::tracking, VelocityEstimatorKind::edge_period);
  config.force.limit = 3.3f;
  config.force.ramp_time = 0.01f;
  auto mirrored = config;
  mirrored.wall_side = -config.wall_side;
  Loop<float> loop(config), mirror(mirrored);
  std::int64_t count = *rc::gen::inRange(-3000, 3000);
  for (int i = 0; i < 100; ++i) {
    count += *rc::gen::inRange(-30, 31);
    const auto& a = loop.at(count);
    const auto& b = mirror.at(-count);
    RC_ASSERT(a.force == -b.force);
    RC_ASSERT(a.velocity == -b.velocity);
    RC_ASSERT(a.outside_distance == b.outside_distance);
    RC_ASSERT(a.magnetic_coefficient == b.magnetic_coefficient);
    RC_ASSERT(a.limited == b.limited);
  }
}

TEST(HapticLoop, TheWallPushesTowardsItsSide) {
  auto config = plain_wall<float>();
  EXPECT_GT(Loop<float>(config).at(-1000).force, 0.0f);
  EXPECT_EQ(Loop<float>(config).at(1000).force, 0.0f);
  config.wall_side = -1;
  EXPECT_LT(Loop<float>(config).at(1000).force, 0.0f);
  EXPECT_EQ(Loop<float>(config).at(-1000).force, 0.0f);
}

TEST(HapticLoop, TheDamperMayDifferenceWhereTheEstimatorSmooths) {
  auto config = plain_wall<double>();
  config.tick_rate = 500.0;
  config.count_length = 55e-6;
  config.wall.stiffness = 0.0;
  config.wall.damping = 8.0;
  config.velocity = {VelocityEstimatorKind::low_pass, 16, 1.0};
  const auto force = [&](int window) {
    config.damping_window = window;
    Loop<double> loop(config);
    for (int n = 0; n < 5; ++n) loop.at(-10);
    return loop.at(-14).force;
  };
  // Four counts in 2 ms, in one sample or in three; the low-pass has hardly begun.
  EXPECT_NEAR(force(1), 8.0 * 4 * 55e-6 / 0.002, 1e-9);
  EXPECT_NEAR(force(3), 8.0 * 4 * 55e-6 / 0.006, 1e-9);
  EXPECT_LT(force(0), 0.02 * force(1));
  EXPECT_GT(force(0), 0.0);
}

TEST(HapticLoop, ADampersOwnVelocityDoesNotSeeAnotherResolution) {
  auto config = plain_wall<double>();
  config.wall.stiffness = 0.0;
  config.wall.damping = 8.0;
  config.damping_window = 2;
  HapticLoop<double> loop;
  const auto fine = HapticLoop<double>::prepare(config, 0);
  config.position_resolution = 1e-4;
  const auto coarse = HapticLoop<double>::prepare(config, 0);
  for (int n = 0; n < 20; ++n) EXPECT_EQ(loop.tick(fine, -149, true).force, 0.0);
  for (int n = 0; n < 20; ++n) EXPECT_EQ(loop.tick(coarse, -149, true).force, 0.0);
}

TEST(HapticLoop, AWallThatGrowsPushesAsItsTouchAtFirstAndAsItsStiffnessAtLast) {
  auto config = plain_wall<double>();
  config.wall.stiffness = 10000.0;
  config.wall.growing.touch_stiffness = 2000.0;
  Loop<double> loop(config);
  loop.at(100);
  EXPECT_NEAR(loop.at(-100).force, 2000.0 * 100e-6, 1e-9);
  for (int n = 0; n < 60000; ++n) loop.at(-100);
  EXPECT_NEAR(loop.at(-100).force, 10000.0 * 100e-6, 1e-5);
  loop.at(100);
  EXPECT_NEAR(loop.at(-100).force, 2000.0 * 100e-6, 1e-9);
  loop.loop().reset();
  EXPECT_NEAR(loop.at(-100).force, 2000.0 * 100e-6, 1e-9);
}

TEST(HapticLoop, HoldsTheForceBetweenHapticSamples) {
  auto config = plain_wall<float>();
  config.divider = 40;
  Loop<float> loop(config);
  EXPECT_FLOAT_EQ(loop.at(-1000).force, 1.0f);
  for (int tick = 1; tick < 40; ++tick) {
    const auto& out = loop.at(-1000 - tick);
    EXPECT_FLOAT_EQ(out.force, 1.0f);
    EXPECT_FALSE(out.new_sample);
  }
  EXPECT_TRUE(loop.at(-2000).new_sample);
  EXPECT_FLOAT_EQ(loop.at(-2000).force, 2.0f);
}

TEST(HapticLoop, DisablingTakesTheForceAwayInTheSameTickHeldOrNot) {
  auto config = plain_wall<float>();
  config.divider = 40;
  Loop<float> loop(config);
  for (int tick = 0; tick < 60; ++tick) loop.at(-1000);
  EXPECT_EQ(loop.at(-1000, false).force, 0.0f);
  EXPECT_EQ(loop.at(-1000, true).force, 0.0f) << "not before the next haptic sample";
}

TEST(HapticLoop, OverSpeedRemovesTheForceAndSaysSo) {
  auto config = plain_wall<float>();
  config.velocity.kind = VelocityEstimatorKind::difference;
  config.velocity_limit = 1.0f;
  Loop<float> loop(config);
  EXPECT_EQ(loop.at(-1000).fault, HapticFault::none);
  EXPECT_EQ(loop.at(-1049).fault, HapticFault::none) << "0.98 m/s";
  const auto& out = loop.at(-1100);
  EXPECT_EQ(out.fault, HapticFault::over_speed) << "1.02 m/s";
  EXPECT_EQ(out.force, 0.0f);
}

TEST(HapticLoop, AnExternalForceThatIsNotANumberGivesZeroAndAFault) {
  const auto force_with = [](float bad) { return Loop<float>(plain_wall<float>()).at(-1000, true, bad); };
  EXPECT_EQ(force_with(std::nanf("")).fault, HapticFault::not_finite);
  EXPECT_EQ(force_with(std::nanf("")).force, 0.0f);
  // An infinity is brought back to the largest number and then limited.
  EXPECT_TRUE(std::isfinite(force_with(std::numeric_limits<float>::infinity()).force));
}

TEST(HapticLoop, CoefficientsThatAreNotFiniteGiveZeroForceAndAFaultNeverANaN) {
  for (const float value : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    for (std::size_t field = 0; field < 8; ++field) {
      auto config = plain_wall<float>();
      config.wall.kind = field < 4 ? WallKind::magnetic : WallKind::adaptive;
      config.wall.damping = 1.0f;
      auto c = HapticLoop<float>::prepare(config, 0);
      *std::array{
          &c.wall.stiffness.full, &c.wall.magnetic_coefficient, &c.count_length, &c.wall_fraction,
          &c.wall.adaptive.gain,  &c.wall.adaptive.offset,      &c.side,         &c.force.limit}[field] =
          value;
      HapticLoop<float> loop;
      for (int i = 0; i < 10; ++i) {
        const auto& out = loop.tick(c, -1000 - i, true);
        EXPECT_TRUE(std::isfinite(out.force)) << "field " << field << ", value " << value;
        if (std::isnan(value) && field < 4) {
          EXPECT_EQ(out.fault, HapticFault::not_finite) << "field " << field;
          EXPECT_EQ(out.force, 0.0f) << "field " << field;
        }
      }
    }
  }
}

// A count that jumps after a long rest, as of a damaged encoder: 64 counts in a tick are 1.28 m/s, and so are
// 128 in the two that FOAW takes as one; it may find them a tick later.
TEST(HapticLoop, AJumpAfterARestTripsWithEveryEstimatorThatLooksAtSingleSamples) {
  using enum VelocityEstimatorKind;
  for (const auto kind : {difference, foaw, foaw_end_fit, edge_period}) {
    const bool of_two = kind == foaw || kind == foaw_end_fit;
    for (const int rest : {2, 3, 30, 31, 10'000}) {
      for (const int jump : {of_two ? 128 : 64, of_two ? -128 : -64, 100'000}) {
        auto config = plain_wall<float>();
        config.velocity.kind = kind;
        config.velocity_limit = 1.0f;
        Loop<float> loop(config);
        loop.at(1000);
        for (int n = 0; n < rest; ++n) ASSERT_EQ(loop.at(1001).fault, HapticFault::none);
        auto out = loop.at(1001 + jump);
        if (of_two && out.fault == HapticFault::none) out = loop.at(1001 + jump);
        EXPECT_EQ(out.fault, HapticFault::over_speed) << static_cast<int>(kind) << " after " << rest;
        EXPECT_EQ(out.force, 0.0f);
      }
    }
  }
}

// At 20 kHz FOAW takes a jump of 64 counts in a tick as 0.64 m/s, for two ticks.
TEST(HapticLoop, AJumpThatIsWithinTheLimitOverTwoSamplesDoesNotTripWithFoaw) {
  for (const int rest : {2, 3}) {
    auto config = plain_wall<float>();
    config.velocity.kind = VelocityEstimatorKind::foaw;
    config.velocity_limit = 1.0f;
    Loop<float> loop(config);
    loop.at(1000);
    for (int n = 0; n < rest; ++n) loop.at(1001);
    for (int n = 0; n < 4; ++n) EXPECT_EQ(loop.at(1065).fault, HapticFault::none) << rest;
  }
}

// In which samples what is slow is done. The tick's budget is counted with it.
TEST(HapticLoop, BeyondTenKilohertzFoawTakesTheEvenSamples) {
  auto config = plain_wall<float>();
  for (const std::uint32_t divider : {1u, 2u, 40u}) {
    config.divider = divider;
    const auto c = HapticLoop<float>::prepare(config, 0);
    EXPECT_EQ(c.watch_mask, divider == 1 ? 3u : 0u);
    EXPECT_EQ(c.velocity.foaw_leaves_out, divider == 1 ? 1 : 0);
  }
  config.divider = 1;
  const auto c = HapticLoop<float>::prepare(config, 0);
  for (const std::uint32_t first : {7u, 8u, 9u, 10u, 0xFFFFFFFEu}) {
    HapticLoop<float> loop;
    loop.reset(first - 1);
    float before = 0.0f;
    std::uint32_t changes = 0;
    for (std::uint32_t n = 0; n < 400; ++n) {
      const std::uint32_t number = first + n;
      const float velocity = loop.tick(c, 10 * static_cast<std::int64_t>(n) * n, true).velocity;
      ASSERT_EQ(loop.samples(), number);
      if (velocity != before) {
        ASSERT_EQ(number % 2, 0u);
        ++changes;
      }
      before = velocity;
    }
    EXPECT_GE(changes, 190u);
  }
}

RC_GTEST_PROP(HapticLoop, AnyWalkOfCountsGivesAFiniteForceWithinTheLimit, ()) {
  auto config = plain_wall<float>();
  config.wall.kind = any_law();
  config.wall.stiffness = 1e6f;
  config.wall.damping = 1000.0f;
  config.wall.magnetic_length = 1e-6f;
  config.position_resolution = *rc::gen::element(0.0, 5.5e-5, 1e-3);
  config.position_rounding = *rc::gen::element(Rounding::nearest, Rounding::floor, Rounding::hysteresis);
  config.velocity.kind =
      *rc::gen::element(VelocityEstimatorKind::difference, VelocityEstimatorKind::low_pass,
                        VelocityEstimatorKind::foaw, VelocityEstimatorKind::foaw_end_fit,
                        VelocityEstimatorKind::tracking, VelocityEstimatorKind::edge_period);
  config.force.limit = 3.3f;
  Loop<float> loop(config);
  std::int64_t count = 0;
  for (int i = 0; i < 100; ++i) {
    count += *rc::gen::arbitrary<std::int32_t>();
    const auto& out = loop.at(count);
    RC_ASSERT(std::isfinite(out.force));
    RC_ASSERT(std::abs(out.force) <= 3.3f);
    RC_ASSERT(std::isfinite(out.velocity));
  }
}

TEST(HapticLoop, ADayOfTicksLeavesForceAndVelocityWhereTheyWere) {
  // One count per 10,000 ticks for 24 h at 20 kHz is 172,800 counts; walked here at one tick per count with
  // the state checked against a fresh loop at the same place.
  auto config = plain_wall<float>();
  config.velocity.kind = VelocityEstimatorKind::tracking;
  config.wall.kind = WallKind::magnetic;
  Loop<float> aged(config);
  std::int64_t count = 0;
  for (std::int64_t n = 0; n < 172'800; ++n) count -= 1, aged.at(count);
  Loop<float> fresh(config);
  for (int settle = 0; settle < 20000; ++settle) {
    aged.at(count);
    fresh.at(count);
  }
  EXPECT_EQ(aged.at(count).force, fresh.at(count).force);
  EXPECT_NEAR(aged.at(count).velocity, 0.0f, 1e-9f);
}

TEST(HapticLoop, FloatFollowsDoubleThroughAContact) {
  auto config_float = plain_wall<float>();
  auto config_double = plain_wall<double>();
  config_float.wall.kind = config_double.wall.kind = WallKind::adaptive;
  config_float.position_resolution = config_double.position_resolution = 5.5e-5;
  Loop<float> single(config_float);
  Loop<double> wide(config_double);
  for (int tick = 0; tick < 20000; ++tick) {
    const auto count = static_cast<std::int64_t>(std::lround(2000.0 * std::cos(tick * 6.283185307 / 20000)));
    const auto& a = single.at(count);
    const auto& b = wide.at(count);
    ASSERT_EQ(a.position, b.position);
    ASSERT_NEAR(static_cast<double>(a.force), b.force, 2e-6 * (1 + b.force)) << "tick " << tick;
  }
}

// A wall of 5 N/mm, and counts of a handle that swings in it by 0.2 mm, the force by 1 N, at 50 Hz.
TEST(HapticLoop, ForcesThatOverflowTogetherStayOnTheirSide) {
  for (const int side : {1, -1}) {
    auto config = plain_wall<float>();
    config.wall.stiffness = 3e38f;
    config.count_length = 1.0;
    config.wall_side = side;
    const float out = static_cast<float>(side), most = std::numeric_limits<float>::max();
    EXPECT_EQ(Loop<float>(config).at(-10 * side, true, out * most).force, out * 1e6f);
    EXPECT_EQ(Loop<float>(config).at(-10 * side, true, -out * most).force, 0.0f);
  }
}

// Of instability.action.
TEST(HapticLoop, NumbersOfTheActionsStay) {
  using enum InstabilityAction;
  int number = 0;
  for (const InstabilityAction one : {off, warn, soften, InstabilityAction::trip})
    EXPECT_EQ(static_cast<int>(one), number++);
}

TEST(HapticLoop, WhatIsNotEnabledIsNotLimitedEither) {
  auto config = plain_wall<float>();
  config.force.limit = 1.0f;
  config.force.slew_limit = 1.0f;
  config.force.ramp_time = 1.0f;
  Loop<float> loop(config);
  for (int n = 0; n < 3; ++n) loop.at(-5000);
  EXPECT_TRUE(loop.loop().output().ramping);
  const auto& out = loop.at(-5000, false);
  EXPECT_FALSE(out.limited);
  EXPECT_FALSE(out.slew_limited);
  EXPECT_FALSE(out.ramping);
}

TEST(HapticLoop, AfterAResetTheFirstPositionIsNoMovement) {
  Loop<float> loop(plain_wall<float>());
  for (int count = 0; count < 100; ++count) loop.at(count);
  ASSERT_GT(loop.loop().output().velocity, 0.0f);
  loop.loop().reset();
  EXPECT_EQ(loop.at(100'000).velocity, 0.0f) << "the counts may have got another origin";
  EXPECT_EQ(loop.at(100'000).velocity, 0.0f);
}

TEST(HapticLoop, ParallelInterferenceIsReportedForTheOtherAxis) {
  auto config = plain_wall<float>();
  config.interference = {InterferenceMode::parallel, 5.0f, 0.0f, 0.0f};
  Loop<float> loop(config);
  EXPECT_EQ(loop.at(1000).tangential_force, 0.0f);
  EXPECT_EQ(loop.at(-1000).tangential_force, 5.0f);
  EXPECT_EQ(loop.at(-1000, false).tangential_force, 0.0f) << "not while disabled";
}

TEST(HapticLoop, TellsHowLongItHoldsAndPassesOverIt) {
  auto config = plain_wall<double>();
  config.divider = 5;
  Loop<double> loop(config);
  EXPECT_EQ(loop.loop().held_ticks(), 0u);
  EXPECT_TRUE(loop.at(-10).new_sample);
  EXPECT_EQ(loop.loop().held_ticks(), 4u);
  EXPECT_FALSE(loop.at(-10).new_sample);
  EXPECT_EQ(loop.loop().held_ticks(), 3u);
  loop.loop().pass_held(2);
  EXPECT_EQ(loop.loop().held_ticks(), 1u);
  EXPECT_FALSE(loop.loop().output().new_sample);
  loop.loop().pass_held(10);
  EXPECT_EQ(loop.loop().held_ticks(), 0u);
  const auto& out = loop.at(-20);
  EXPECT_TRUE(out.new_sample);
  EXPECT_NEAR(out.force, 0.02, 1e-12);
  EXPECT_EQ(loop.loop().held_ticks(), 4u);
}

TEST(HapticLoop, TheBackgroundForceIsFieldAndBackgroundOfTheLastSample) {
  auto config = plain_wall<double>();
  config.wall.kind = WallKind::magnetic;
  config.wall.magnetic_coefficient = 2.0;
  config.wall.magnetic_length = 1e-3;
  config.interference = {InterferenceMode::perpendicular, 5.0, 3.0, 0.0};
  const auto c = HapticLoop<double>::prepare(config, 0);
  HapticLoop<double> loop;
  EXPECT_EQ(loop.background_force(c), 3.0);
  loop.tick(c, 1000, true);  // one length outside: a quarter of the field is left
  EXPECT_NEAR(loop.background_force(c), 3.5, 1e-9);
  loop.tick(c, -1000, true);
  EXPECT_NEAR(loop.background_force(c), 5.0, 1e-9) << "without the spring and F_I";
}

TEST(HapticLoop, TheSoftStartsShareComesUpWhileEnabled) {
  auto config = plain_wall<double>();
  config.force.ramp_time = 10.0 / config.tick_rate;
  Loop<double> loop(config);
  loop.at(-10, false);
  EXPECT_EQ(loop.loop().ramp(), 0.0);
  for (int i = 0; i < 5; ++i) loop.at(-10);
  EXPECT_GT(loop.loop().ramp(), 0.3);
  EXPECT_LT(loop.loop().ramp(), 0.7);
  for (int i = 0; i < 10; ++i) loop.at(-10);
  EXPECT_EQ(loop.loop().ramp(), 1.0);
  loop.at(-10, false);
  EXPECT_EQ(loop.loop().ramp(), 0.0);
}

}  // namespace kmax::control::haptic_loop_test
