#include "control/abbott_okamura_criterion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::control {
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
}  // namespace kmax::control
