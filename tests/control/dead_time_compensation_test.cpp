#include "control/dead_time_compensation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace kmax::control::dead_time_compensation_test {

TEST(DeadTimeCompensation, IsTheShareBeyondTheBandAndAStraightLineWithin) {
  const auto c = DeadTimeCompensation<double>::prepare(500e-9, 0.2, 20'000.0);
  EXPECT_TRUE(c.active);
  EXPECT_NEAR(c.share, 0.01, 1e-15);
  for (double current = -1.0; current <= 1.0; current += 0.003) {
    EXPECT_NEAR(c.of(current), 0.01 * std::clamp(current / 0.2, -1.0, 1.0), 1e-15) << current;
  }
  EXPECT_EQ(c.of(0.0), 0.0);
  EXPECT_NEAR(c.of(1e6), 0.01, 1e-10);
}

// Odd to the bit, never falling, no step larger than the line's, never beyond the share.
TEST(DeadTimeCompensation, HasNoJumpInFloat) {
  const auto c = DeadTimeCompensation<float>::prepare(119e-9F, 0.05F, 20'000.0F);
  float before = c.of(-0.2F);
  for (int step = -20'000; step <= 20'000; ++step) {
    const float current = static_cast<float>(step) * 1e-5F;
    const float share = c.of(current);
    ASSERT_EQ(share, -c.of(-current));
    ASSERT_GE(share, before - 1e-9F) << current;
    ASSERT_LE(share - before, 1.1F * 2.0F * c.gain * 1e-5F + 1e-9F) << current;
    ASSERT_LE(std::fabs(share), c.share * 1.000001F);
    before = share;
  }
}

TEST(DeadTimeCompensation, StaysFiniteForEveryFiniteCurrent) {
  const auto c = DeadTimeCompensation<float>::prepare(1e-6F, 0.001F, 20'000.0F);
  for (const float current : {1e9F, 1e30F, std::numeric_limits<float>::max(),
                              -std::numeric_limits<float>::max(), std::numeric_limits<float>::denorm_min()}) {
    EXPECT_LE(std::fabs(c.of(current)), c.share * 1.000001F) << current;
  }
}

// 24 V on 0.3 mH for 500 ns are 40 mA.
TEST(DeadTimeCompensation, TheBandIsTheCurrentThatEndsWithinTheDeadTime) {
  EXPECT_NEAR(dead_time_band(24.0, 500e-9, 0.3e-3), 0.04, 1e-15);
}

TEST(DeadTimeCompensation, WhatMakesNoSenseSwitchesItOff) {
  const double nan = std::nan("");
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1e-7, nan}) {
    EXPECT_FALSE(DeadTimeCompensation<double>::prepare(bad, 0.1, 20'000.0).active) << bad;
    EXPECT_FALSE(DeadTimeCompensation<double>::prepare(1e-7, bad, 20'000.0).active) << bad;
    EXPECT_FALSE(DeadTimeCompensation<double>::prepare(1e-7, 0.1, bad).active) << bad;
  }
  EXPECT_FALSE(DeadTimeCompensation<double>::prepare(1e-7, 1e-320, 20'000.0).active);
  for (const double large : {1.0, infinity}) {
    const auto c = DeadTimeCompensation<double>::prepare(large, 0.1, 20'000.0);
    EXPECT_EQ(c.share, DeadTimeCompensation<double>::largest_share) << large;
    EXPECT_NEAR(c.of(1.0), c.share, 1e-15);
  }
  const auto off = DeadTimeCompensation<double>::prepare(0.0, 0.1, 20'000.0);
  EXPECT_EQ(off.of(3.0), 0.0);
  EXPECT_EQ(off.share, 0.0);
}

}  // namespace kmax::control::dead_time_compensation_test
