#include "control/diolaiti_criterion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "control/stiffness_limits.hpp"

namespace kmax::control::diolaiti_criterion_test {

constexpr double largest = std::numeric_limits<double>::max();

TEST(DiolaitiCriterion, FourRegions) {
  // K = 1000, T = 2 ms, Delta = 0.1 mm: beta = 1/2 at b = 1, sigma = 1/2 at f_c = 0.05.
  const auto region = [](double b, double f) { return diolaiti_region(1000.0, b, f, 2e-3, 1e-4); };
  EXPECT_EQ(region(1.001, 0.0501), DiolaitiRegion::passive);
  EXPECT_EQ(region(1.001, 0.0499), DiolaitiRegion::limit_cycle);
  EXPECT_EQ(region(0.999, 0.0501), DiolaitiRegion::locally_stable);
  EXPECT_EQ(region(0.999, 0.0499), DiolaitiRegion::unstable);
  EXPECT_EQ(region(1.0, 0.051), DiolaitiRegion::passive);  // the borders belong to the better side
}

TEST(DiolaitiCriterion, WhatIsZeroIsHarmless) {
  EXPECT_EQ(diolaiti_region(0.0, 0.0, 0.0, 1e-3, 1e-4), DiolaitiRegion::passive);
  EXPECT_EQ(diolaiti_region(1e6, 0.0, 0.0, 0.0, 0.0), DiolaitiRegion::passive);
  EXPECT_EQ(diolaiti_region(1e6, 0.0, 0.0, 1e-3, 0.0), DiolaitiRegion::locally_stable);
  EXPECT_EQ(escape_speed(0.0, 0.0, 0.0, 1e-3, 1e-4), largest);
  EXPECT_EQ(escape_speed(1e6, 0.0, 0.0, 1e-3, 0.0), 0.0);
}

TEST(DiolaitiCriterion, EscapeSpeed) {
  EXPECT_DOUBLE_EQ(escape_speed(1000.0, 0.5, 0.1, 2e-3, 1e-4), 0.2);  // 0.1 N/(1 - 0.5) N s/m
  EXPECT_EQ(escape_speed(1000.0, 1.0, 0.1, 2e-3, 1e-4), largest);
  EXPECT_EQ(escape_speed(1000.0, 0.5, 0.04, 2e-3, 1e-4), 0.0);
  EXPECT_EQ(escape_speed(1000.0, 2.0, 0.04, 2e-3, 1e-4), 0.0);  // beta fine, yet it buzzes
  const double next = std::nextafter(1000.0, 2000.0);
  EXPECT_LE(escape_speed(next, 1.0, 1e300, 2e-3, 1e-4), largest);
}

// A delay of half a period injects as much as the hold itself.
TEST(DiolaitiCriterion, ADelayCountsTwiceItsLengthOfPeriod) {
  EXPECT_DOUBLE_EQ(period_with_delay(2e-3, 0.0), 2e-3);
  EXPECT_DOUBLE_EQ(period_with_delay(1e-3, 0.5e-3), 2e-3);
  EXPECT_DOUBLE_EQ(escape_speed(1000.0, 0.5, 0.1, period_with_delay(1e-3, 0.5e-3), 1e-4), 0.2);
  EXPECT_EQ(diolaiti_region(1000.0, 0.9, 1.0, 1e-3, 1e-4), DiolaitiRegion::passive);
  EXPECT_EQ(diolaiti_region(1000.0, 0.9, 1.0, period_with_delay(1e-3, 0.5e-3), 1e-4),
            DiolaitiRegion::locally_stable);
  EXPECT_EQ(period_with_delay(1.0, largest), largest);
}

RC_GTEST_PROP(DiolaitiCriterion, PassiveIsWhereAbbottAndOkamuraAllowIt, ()) {
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
  const double k = amount(10.0), b = amount(0.01), f = amount(0.001), period = amount(1e-5),
               quantum = amount(1e-6);
  const double limit = abbott_okamura_stiffness_limit(b, f, period, quantum);
  RC_PRE(std::abs(k / limit - 1.0) > 1e-12);
  RC_ASSERT((diolaiti_region(k, b, f, period, quantum) == DiolaitiRegion::passive) == (k < limit));
}

RC_GTEST_PROP(DiolaitiCriterion, EscapeIsHarderWithFrictionAndEasierWithStiffness, ()) {
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
  const double k = amount(10.0), b = amount(0.01), f = amount(0.001), period = amount(1e-5),
               quantum = amount(1e-6);
  const double speed = escape_speed(k, b, f, period, quantum);
  RC_ASSERT(escape_speed(k, b, 2 * f, period, quantum) >= speed);
  RC_ASSERT(escape_speed(k, 2 * b, f, period, quantum) >= speed);
  RC_ASSERT(escape_speed(2 * k, b, f, period, quantum) <= speed);
  RC_ASSERT(escape_speed(k, b, f, 2 * period, quantum) <= speed);
  RC_ASSERT(escape_speed(k, b, f, period, 2 * quantum) <= speed);
}

}  // namespace kmax::control::diolaiti_criterion_test
