#include "control/abbott_okamura_criterion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace kmax::control::abbott_okamura_criterion_test {
namespace {

constexpr double largest = std::numeric_limits<double>::max();

TEST(AbbottOkamuraCriterion, TheSmallerPartLimits) {
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness_limit(1.0, 1.0, 1e-3, 1e-4), 2000.0);
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness_limit(1.0, 0.01, 1e-3, 1e-4), 200.0);
  EXPECT_NEAR(abbott_okamura_stiffness_limit(10.0, 0.093, 2e-3, 55e-6), 3381.8, 0.1);
}

TEST(AbbottOkamuraCriterion, WhatIsNotThereDoesNotLimit) {
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness_limit(1.0, 0.0, 1e-3, 0.0), 2000.0);
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness_limit(0.0, 1.0, 0.0, 1e-3), 2000.0);
  EXPECT_EQ(abbott_okamura_stiffness_limit(0.0, 0.0, 0.0, 0.0), largest);
  EXPECT_EQ(abbott_okamura_stiffness_limit(0.0, 1.0, 1e-3, 1e-6), 0.0);
  EXPECT_EQ(abbott_okamura_stiffness_limit(1.0, 0.0, 1e-3, 1e-6), 0.0);
  constexpr double tiny = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(abbott_okamura_stiffness_limit(1.0, 1.0, tiny, tiny), largest);
  EXPECT_EQ(abbott_okamura_stiffness_limit(0.0, 1.0, tiny, tiny), 0.0);
}

// 2 (f_c/Delta - |B|/T): 2 (0.1/50e-6 - 1/1e-3) = 2000.
TEST(AbbottOkamuraCriterion, ADamperTakesItsStepOfTheFriction) {
  for (const double wall_damping : {1.0, -1.0}) {
    EXPECT_NEAR(position_step_stiffness_limit(0.1, wall_damping, 1e-3, 50e-6), 2000.0, 1e-9);
    EXPECT_NEAR(abbott_okamura_stiffness_limit(10.0, 0.1, 1e-3, 50e-6, wall_damping), 2000.0, 1e-9);
  }
  EXPECT_NEAR(abbott_okamura_stiffness_limit(10.0, 0.1, 1e-3, 50e-6, 3.0), -2000.0, 1e-9);
  EXPECT_NEAR(abbott_okamura_stiffness_limit(10.0, 0.1, 1e-3, 0.0, 3.0), 20000.0, 1e-9) << "no step";
  EXPECT_EQ(position_step_stiffness_limit(0.1, 1.0, 0.0, 50e-6), -largest) << "no period";
}

// Over every pair of positions that lie on the border of two steps: the force that is computed is never
// farther from that of the true positions than the friction at the limit.
TEST(AbbottOkamuraCriterion, FrictionAtTheLimitIsTheWorstErrorOfTheForce) {
  const double friction = 0.2, period = 1e-3, quantum = 50e-6;
  for (const double wall_damping : {0.0, 0.5, 2.0, -2.0}) {
    const double stiffness = position_step_stiffness_limit(friction, wall_damping, period, quantum);
    ASSERT_GT(stiffness, 0.0);
    double worst = 0.0;
    for (int now = -60; now <= 60; ++now) {
      for (int before = -60; before <= 60; ++before) {
        const auto error = [&](int at) {
          const double position = (at / 20.0 + 1e-12) * quantum;
          return std::floor(position / quantum + 0.5) * quantum - position;
        };
        worst = std::max(
            worst, std::abs(stiffness * error(now) + wall_damping * (error(now) - error(before)) / period));
      }
    }
    EXPECT_LE(worst, friction * 1.0000001);
    if (wall_damping >= 0.0) {
      EXPECT_GT(worst, 0.9 * friction);
    }
  }
}

RC_GTEST_PROP(AbbottOkamuraCriterion, Monotone, ()) {
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
  const double b = amount(0.01), friction = amount(0.001), period = amount(1e-5), quantum = amount(1e-6);
  const double limit = abbott_okamura_stiffness_limit(b, friction, period, quantum);
  RC_ASSERT(limit <= 2 * b / period * (1 + 1e-15));
  RC_ASSERT(limit * quantum <= 2 * friction * (1 + 1e-15));
  RC_ASSERT(abbott_okamura_stiffness_limit(2 * b, 2 * friction, period, quantum) == 2 * limit);
  RC_ASSERT(abbott_okamura_stiffness_limit(b, friction, 2 * period, 2 * quantum) == limit / 2);
  RC_ASSERT(abbott_okamura_stiffness_limit(2 * b, friction, period, quantum) >= limit);
  RC_ASSERT(abbott_okamura_stiffness_limit(b, 2 * friction, period, quantum) >= limit);
}

}  // namespace
}  // namespace kmax::control::abbott_okamura_criterion_test
