#include "control/damper_velocity.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace kmax::control::damper_velocity_test {

using Damper = DamperVelocity<float>;

RC_GTEST_PROP(DamperVelocity, IsTheDifferenceOverItsWindowToTheBit, ()) {
  const auto window = *rc::gen::inRange(1, 17);
  // Also where the low word wraps.
  std::int64_t count = *rc::gen::element<std::int64_t>(0, INT32_MAX, -5'000'000'000, UINT32_MAX);
  const Damper::Coefficients c = Damper::prepare(window, 0.002F, 55e-6F, 1);
  Damper damper;
  std::vector<std::int64_t> counts(17, count);
  for (int n = 0; n < 100; ++n) {
    const float velocity = damper.update(c, count);
    counts.push_back(count);
    const std::int64_t before = counts[counts.size() - 1 - static_cast<std::size_t>(window)];
    RC_ASSERT(velocity ==
              static_cast<float>(count - before) * (55e-6F / (0.002F * static_cast<float>(window))));
    count += *rc::gen::inRange(-3000, 3000);
  }
}

TEST(DamperVelocity, FollowsAConstantVelocityFromTheEndOfItsFirstWindowOn) {
  for (const int window : {1, 4, 16}) {
    const auto c = DamperVelocity<double>::prepare(window, 1e-3, 1e-6, 1);
    DamperVelocity<double> damper;
    double last = 0.0;
    for (int n = 0; n <= window; ++n) last = damper.update(c, 200 * n);
    EXPECT_NEAR(last, 0.2, 1e-12) << window;
  }
}

TEST(DamperVelocity, AnotherWindowOrStepAndWhatWasForgottenGiveNoSpike) {
  Damper damper;
  const auto c = Damper::prepare(4, 0.002F, 55e-6F, 1);
  damper.update(c, 0);
  EXPECT_GT(damper.update(c, 10), 0.0F);
  EXPECT_EQ(damper.update(Damper::prepare(5, 0.002F, 55e-6F, 1), 500), 0.0F);
  EXPECT_EQ(damper.update(Damper::prepare(5, 0.002F, 55e-6F, 7), 5000), 0.0F);
  damper.forget();
  EXPECT_EQ(damper.update(Damper::prepare(5, 0.002F, 55e-6F, 7), 90000), 0.0F);
}

TEST(DamperVelocity, BringsAWindowIntoItsRange) {
  for (const int window : {std::numeric_limits<int>::min(), -1, 0})
    EXPECT_EQ(Damper::prepare(window, 1e-3F, 1e-6F, 1).window, 1U) << window;
  for (const int window : {17, std::numeric_limits<int>::max()})
    EXPECT_EQ(Damper::prepare(window, 1e-3F, 1e-6F, 1).window, 16U) << window;
}

TEST(DamperVelocity, AJumpOfAnySizeIsFinite) {
  const auto c = Damper::prepare(3, 5e-5F, 1e-9F, 1);
  Damper damper;
  for (const std::int64_t count : {std::numeric_limits<std::int64_t>::min(), std::int64_t{0},
                                   std::numeric_limits<std::int64_t>::max(), std::int64_t{INT32_MIN}})
    EXPECT_TRUE(std::isfinite(damper.update(c, count))) << count;
}

}  // namespace kmax::control::damper_velocity_test
