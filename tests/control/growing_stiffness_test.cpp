#include "control/growing_stiffness.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::control::growing_stiffness_test {

using Growing = GrowingStiffness<float>;

constexpr GrowingStiffnessConfig<float> soft_touch{.touch_stiffness = 2000.0F};

TEST(GrowingStiffness, MeetsTheHandleSoftlyAndGrowsByItsTimeConstantAtEveryRate) {
  for (const double rate : {500.0, 2000.0, 20000.0}) {
    const auto c = Growing::prepare(soft_touch, 10000.0F, static_cast<float>(1.0 / rate));
    Growing growing;
    EXPECT_EQ(growing.inside(c, 0.0F), 2000.0F);
    for (int n = 1; n <= static_cast<int>(rate); ++n) {
      const double time = n / rate;
      // The backward-Euler decay lags by half a sample.
      EXPECT_NEAR(static_cast<double>(growing.inside(c, 0.0F)), 10000.0 - 8000.0 * std::exp(-time / 0.2),
                  8000.0 * (0.2 / (rate * 0.2) + 1e-4))
          << time;
    }
  }
}

TEST(GrowingStiffness, BeginsAgainAfterEveryContact) {
  const auto c = Growing::prepare(soft_touch, 10000.0F, 0.002F);
  Growing growing;
  for (int n = 0; n < 5000; ++n) growing.inside(c, 0.0F);
  EXPECT_NEAR(growing.inside(c, 0.0F), 10000.0F, 1.0F);
  growing.leave();
  EXPECT_EQ(growing.inside(c, 0.0F), 2000.0F);
}

TEST(GrowingStiffness, FallsBackFourTimesAsFastAsItGrows) {
  const auto c = Growing::prepare(soft_touch, 10000.0F, 5e-5F);
  Growing growing;
  for (int n = 0; n < 200000; ++n) growing.inside(c, 0.0F);
  for (int n = 0; n < 1000; ++n) growing.inside(c, 0.0101F);
  EXPECT_NEAR(growing.inside(c, 0.0101F), 2000.0F + 8000.0F * std::exp(-1.0F), 20.0F);
  for (int n = 0; n < 200000; ++n) growing.inside(c, -1.0F);
  EXPECT_NEAR(growing.inside(c, -1.0F), 2000.0F, 1.0F);
}

TEST(GrowingStiffness, AtTheVeryEdgeTheContactIsCalmAndAVelocityThatIsNoNumberIsNot) {
  const auto c = Growing::prepare(soft_touch, 10000.0F, 0.002F);
  constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
  for (const float velocity : {0.01F, -0.01F, 0.0F}) {
    Growing growing;
    const float first = growing.inside(c, velocity);
    EXPECT_GT(growing.inside(c, velocity), first) << velocity;
  }
  for (const float velocity : {std::nextafter(0.01F, 1.0F), std::nextafter(-0.01F, -1.0F), not_a_number,
                               std::numeric_limits<float>::infinity()}) {
    Growing growing;
    growing.inside(c, 0.0F);
    const float grown = growing.inside(c, velocity);
    EXPECT_GT(grown, 2000.0F);
    EXPECT_LT(growing.inside(c, 0.0F), grown) << velocity;
  }
}

TEST(GrowingStiffness, IsFullAtOnceWhereNothingIsToGrow) {
  constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
  for (const float touch : {0.0F, -1.0F, 10000.0F, 2e6F, not_a_number}) {
    const auto c = Growing::prepare({.touch_stiffness = touch}, 10000.0F, 5e-5F);
    Growing growing;
    for (const float velocity : {0.0F, 5.0F, not_a_number}) EXPECT_EQ(growing.inside(c, velocity), 10000.0F);
  }
}

TEST(GrowingStiffness, AnotherStiffnessInContactCountsAtOnceWhereItIsLower) {
  Growing growing;
  const auto stiff = Growing::prepare(soft_touch, 10000.0F, 0.002F);
  for (int n = 0; n < 5000; ++n) growing.inside(stiff, 0.0F);
  const auto lower = Growing::prepare(soft_touch, 3000.0F, 0.002F);
  EXPECT_LE(growing.inside(lower, 0.0F), 3000.0F);
  EXPECT_GE(growing.inside(lower, 0.0F), 2000.0F);
  // Below the touch stiffness nothing grows.
  EXPECT_EQ(growing.inside(Growing::prepare(soft_touch, 500.0F, 0.002F), 0.0F), 500.0F);
}

TEST(GrowingStiffness, GrowthDoesNotStallByRounding) {
  // A minute's time constant in ticks of 50 us changes a stiffness by less than its last bit.
  const auto c = Growing::prepare({.touch_stiffness = 1.0F, .growth_time = 60.0F}, 1e6F, 5e-5F);
  Growing growing;
  for (int n = 0; n < 20000 * 300; ++n) growing.inside(c, 0.0F);
  EXPECT_NEAR(growing.inside(c, 0.0F), 1e6F * (1.0F - std::exp(-5.0F)), 1e4F);
}

RC_GTEST_PROP(GrowingStiffness, StaysBetweenTouchAndFullAndFloatFollowsDouble, ()) {
  const auto touch = *rc::gen::element(0.0F, 1e-3F, 2000.0F, 1e6F);
  const auto full = *rc::gen::element(0.0F, 1.0F, 10000.0F, 1e6F);
  const auto time = *rc::gen::element(0.001F, 0.2F, 60.0F);
  const auto period = *rc::gen::element(5e-5F, 2e-3F);
  const auto c = Growing::prepare({touch, time, 0.01F}, full, period);
  const auto wide =
      GrowingStiffness<double>::prepare({static_cast<double>(touch), static_cast<double>(time), 0.01},
                                        static_cast<double>(full), static_cast<double>(period));
  const float least = touch > 0.0F && touch < full ? touch : full;
  Growing growing;
  GrowingStiffness<double> reference;
  for (int n = 0; n < 500; ++n) {
    if (*rc::gen::inRange(0, 20) == 0) {
      growing.leave();
      reference.leave();
    }
    const bool calm = *rc::gen::inRange(0, 3) != 0;
    const float stiffness = growing.inside(c, calm ? 0.005F : 0.5F);
    RC_ASSERT(stiffness >= least - 1e-6F * full && stiffness <= full);
    RC_ASSERT(std::abs(static_cast<double>(stiffness) - reference.inside(wide, calm ? 0.005 : 0.5)) <=
              1e-4 * static_cast<double>(full));
  }
}

}  // namespace kmax::control::growing_stiffness_test
