// A wall that oscillates under the hand: when the loop looks for it, and what it does about it.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/control/ticked_loop.hpp"

namespace kmax::control::haptic_loop_instability_test {

using haptic_loop_test::Loop;
using haptic_loop_test::plain_wall;

HapticLoopConfig<float> watched_wall(InstabilityAction action) {
  auto config = plain_wall<float>();
  config.wall.stiffness = 5000.0f;
  config.instability_action = action;
  return config;
}
std::int64_t swinging(int tick) {
  return std::lround(-500.0 + 200.0 * std::sin(6.283185307 * 50.0 * tick / 20000.0));
}
constexpr int in_time = 6000;  // ticks: 0.3 s

// One that FOAW leaves out, in a tick that carries no report.
TEST(HapticLoopInstability, BeyondTenKilohertzTheDetectorLooksInTheLastSampleOfFour) {
  const auto c = HapticLoop<float>::prepare(watched_wall(InstabilityAction::warn), 0);
  for (const std::uint32_t first : {8u, 9u, 10u, 11u, 0xFFFFFFFEu}) {
    HapticLoop<float> loop;
    loop.reset(first - 1);
    bool unstable = false;
    for (std::uint32_t n = 0; n < in_time && !unstable; ++n) {
      unstable = loop.tick(c, swinging(static_cast<int>(n)), true).unstable;
      if (unstable) {
        EXPECT_EQ((first + n) % 4, 3u);
      }
    }
    EXPECT_TRUE(unstable);
  }
}

TEST(HapticLoopInstability, WarnsOfAWallThatOscillatesAndMakesTheSameForce) {
  for (const std::uint32_t divider : {1U, 40U}) {
    auto config = watched_wall(InstabilityAction::off);
    config.divider = divider;
    Loop<float> off(config);
    config.instability_action = InstabilityAction::warn;
    Loop<float> warned(config);
    bool found = false;
    for (int tick = 0; tick < in_time; ++tick) {
      const auto& without = off.at(swinging(tick));
      const auto& with = warned.at(swinging(tick));
      ASSERT_EQ(without.force, with.force);
      ASSERT_FALSE(without.unstable);
      ASSERT_EQ(with.fault, HapticFault::none);
      found = with.unstable;
    }
    EXPECT_TRUE(found) << divider;
    const auto& detector = warned.loop().detector();
    EXPECT_EQ(detector.alarms(), 1U);
    EXPECT_NEAR(detector.last_alarm().force, 1.0f, 0.06f);
    EXPECT_NEAR(detector.last_alarm().displacement, 2e-4f, 1.2e-5f);
    EXPECT_NEAR(detector.last_alarm().frequency, 50.0f, 2.5f);
    EXPECT_EQ(warned.loop().softening(), 1.0f);
    EXPECT_FALSE(warned.at(swinging(0), false).unstable) << "not while disabled";
    EXPECT_EQ(detector.alarms(), 1U) << "but what has been is still told";
    warned.loop().forget_alarms();
    EXPECT_EQ(detector.alarms(), 0U);
    EXPECT_EQ(detector.last_alarm().force, 0.0f);
  }
}

TEST(HapticLoopInstability, SoftensTheWallUntilItIsDisabled) {
  auto config = watched_wall(InstabilityAction::soften);
  config.interference = {InterferenceMode::perpendicular, 0.5f, 0.0f, 0.0f};  // 3 N at rest, in all
  Loop<float> loop(config);
  EXPECT_FLOAT_EQ(loop.at(-500).force, 3.0f);
  for (int tick = 0; tick < 2 * in_time; ++tick) loop.at(swinging(tick));
  const float factor = loop.loop().softening();
  EXPECT_LT(factor, 0.5f);
  EXPECT_GE(factor, 0.05f);
  for (int tick = 0; tick < in_time; ++tick) loop.at(-500);
  EXPECT_FALSE(loop.at(-500).unstable);
  const float still = loop.loop().softening();
  EXPECT_LE(still, factor);
  EXPECT_FLOAT_EQ(loop.at(-500).force, still * 3.0f) << "it stays soft";
  EXPECT_FLOAT_EQ(loop.at(-500, true, 1.0f).force, still * 3.0f + 1.0f)
      << "what comes from elsewhere does not";
  loop.at(-500, false);
  EXPECT_EQ(loop.loop().softening(), 1.0f);
  EXPECT_FLOAT_EQ(loop.at(-500).force, 3.0f);
}

TEST(HapticLoopInstability, TripsOnAnOscillationInTheTickThatFindsIt) {
  for (const std::uint32_t divider : {1U, 40U}) {
    for (const int side : {1, -1}) {
      auto config = watched_wall(InstabilityAction::trip);
      config.divider = divider;
      config.wall_side = side;
      Loop<float> loop(config);
      int tick = 0;
      while (tick < in_time && loop.at(side * swinging(tick)).fault == HapticFault::none) {
        ASSERT_NE(loop.loop().output().force, 0.0f);
        ++tick;
      }
      ASSERT_LT(tick, in_time);
      const auto& out = loop.loop().output();
      EXPECT_EQ(out.fault, HapticFault::unstable);
      EXPECT_TRUE(out.unstable && out.new_sample);
      EXPECT_EQ(out.force, 0.0f);
      EXPECT_GE(loop.loop().detector().last_alarm().force, 0.3f);
      EXPECT_FALSE(loop.at(side * -500, false).unstable);
      for (std::uint32_t n = 0; n < divider; ++n) loop.at(side * -500);
      EXPECT_EQ(loop.at(side * -500).fault, HapticFault::none);
    }
  }
}

TEST(HapticLoopInstability, OnlyAHandleThatMovesOscillates) {
  // The wall goes in and out under a handle at rest, or changes its side; the counts are coarsened to 0.4 mm,
  // and the handle moves by 0.03 mm around an edge between two steps.
  for (const bool moved_wall : {true, false}) {
    auto config = watched_wall(InstabilityAction::trip);
    if (!moved_wall) config.position_resolution = 4e-4;
    Loop<float> loop(config);
    auto other = config;
    other.wall_position = moved_wall ? 5e-4 : 0.0;
    const std::array coefficients{HapticLoop<float>::prepare(config, 0),
                                  HapticLoop<float>::prepare(other, 0)};
    float least = 1e9f, most = -1e9f;
    for (int tick = 0; tick < 4 * in_time; ++tick) {
      const bool up = tick / 200 % 2 == 0;
      const auto& out = loop.loop().tick(coefficients[up ? 1 : 0],
                                         moved_wall ? -500
                                         : up       ? -630
                                                    : -570,
                                         true);
      ASSERT_FALSE(out.unstable);
      least = std::min(least, out.force);
      most = std::max(most, out.force);
    }
    EXPECT_GT(most - least, 1.9f) << "or nothing has been tried";
  }
}

TEST(HapticLoopInstability, NoWallIsWatchedWhereItFollows) {
  const auto c = HapticLoop<float>::prepare(watched_wall(InstabilityAction::trip), 0);
  HapticLoop<float> loop;
  for (int tick = 0; tick < 2 * in_time; ++tick) {
    const std::int64_t count = swinging(tick);
    ASSERT_FALSE(loop.follow(c, count, true, -0.005f * static_cast<float>(count)).unstable);
  }
  // And it starts again behind it: with only a part of each second rendered, nothing lasts.
  for (int tick = 0; tick < 8 * in_time; ++tick) {
    const std::int64_t count = swinging(tick);
    if (tick % 1000 < 100)
      loop.follow(c, count, true, -0.005f * static_cast<float>(count));
    else
      ASSERT_FALSE(loop.tick(c, count, true).unstable) << tick;
  }
}

TEST(HapticLoopInstability, WhatWasUnstableIsNoLongerWhereItFollows) {
  const auto c = HapticLoop<float>::prepare(watched_wall(InstabilityAction::warn), 0);
  HapticLoop<float> loop;
  for (int tick = 0; tick < in_time; ++tick) loop.tick(c, swinging(tick), true);
  ASSERT_TRUE(loop.output().unstable);
  EXPECT_FALSE(loop.follow(c, 0, true, 0.0f).unstable);
}

TEST(HapticLoopInstability, AResetForgetsTheOscillationAndTheSoftening) {
  Loop<float> loop(watched_wall(InstabilityAction::soften));
  for (int tick = 0; tick < 2 * in_time; ++tick) loop.at(swinging(tick));
  ASSERT_LT(loop.loop().softening(), 1.0f);
  loop.loop().reset();
  EXPECT_EQ(loop.loop().softening(), 1.0f);
  EXPECT_FALSE(loop.at(-500).unstable);
  EXPECT_FLOAT_EQ(loop.at(-500).force, 2.5f);
}

}  // namespace kmax::control::haptic_loop_instability_test
