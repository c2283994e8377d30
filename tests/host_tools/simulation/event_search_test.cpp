#include "host_tools/simulation/event_search.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kmax::simulation::event_search_test {
namespace {

TEST(EventSearch, FindsTheZeroOfSmoothAndOfBentFunctions) {
  EXPECT_NEAR(falling_zero_of([](double t) { return 1.0 - t; }, 0.0, 3.0), 1.0, 1e-14);
  EXPECT_NEAR(falling_zero_of([](double t) { return std::cos(t); }, 0.0, 3.0), std::acos(0.0), 1e-14);
  EXPECT_NEAR(falling_zero_of([](double t) { return 1e-30 * (0.3 - t * t * t); }, 0.0, 1.0), std::cbrt(0.3),
              1e-14);
  EXPECT_NEAR(falling_zero_of([](double t) { return t < 0.7 ? 1.0 : 0.7 - t - 1e-9; }, 0.0, 1.0), 0.7, 1e-12);
  EXPECT_NEAR(falling_zero_of([](double t) { return std::exp(-50.0 * t) - 1e-20; }, 0.0, 1.0),
              20.0 * std::log(10.0) / 50.0, 1e-9);
}

TEST(EventSearch, TheEventHasHappenedWhereItEnds) {
  for (int n = 1; n < 200; ++n) {
    const double zero = 0.005 * n;
    const auto value = [zero](double t) { return std::sin(zero - t); };
    EXPECT_LE(value(falling_zero_of(value, 0.0, 1.0)), 0.0) << zero;
  }
}

TEST(EventSearch, EndsThatAreNoBracketAreAnswered) {
  const auto falling = [](double t) { return 0.5 - t; };
  EXPECT_EQ(falling_zero_of(falling, 0.5, 1.0), 0.5) << "nothing above zero: at once";
  EXPECT_EQ(falling_zero_of(falling, 0.6, 1.0), 0.6);
  EXPECT_EQ(falling_zero_of(falling, 0.0, 0.5), 0.5) << "zero at the end itself";
  EXPECT_EQ(falling_zero_of(falling, 0.0, 0.4), 0.4) << "rounding left nothing below zero: at the end";
}

TEST(EventSearch, AStartFromZeroIsFollowedUntilItMoves) {
  // t (a - t): moving forwards until a.
  for (const double zero : {0.6, 0.3, 1e-3, 1e-9}) {
    const auto value = [zero](double t) { return t * (zero - t); };
    const double moving = moving_start(value, 1.0);
    EXPECT_GT(moving, 0.0);
    EXPECT_GT(value(moving), 0.0);
    EXPECT_NEAR(falling_zero_of(value, moving, 1.0), zero, 1e-12 * zero + 1e-15);
  }
  EXPECT_EQ(moving_start([](double t) { return -t; }, 1.0), -1.0);
}

}  // namespace
}  // namespace kmax::simulation::event_search_test
