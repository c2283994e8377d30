#include "control/force_limiter.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::control::force_limiter_test {

using Limiter = ForceLimiter<float>;
constexpr float period = 1e-3f;

TEST(ForceLimiter, PassesWhatIsAllowedToTheBit) {
  Limiter limiter;
  const auto c = Limiter::prepare({.limit = 3.3f, .slew_limit = 0.0f, .ramp_time = 0.0f}, period);
  for (const float force : {0.1f, -3.3f, 3.3f, 1e-30f, 0.0f}) {
    const auto out = limiter.update(c, force);
    EXPECT_EQ(out.force, force);
    EXPECT_FALSE(out.limited || out.slew_limited || out.ramping || out.not_finite);
  }
}

TEST(ForceLimiter, LimitsAndSaysSo) {
  Limiter limiter;
  const auto c = Limiter::prepare({.limit = 3.3f, .slew_limit = 0.0f, .ramp_time = 0.0f}, period);
  EXPECT_EQ(limiter.update(c, 10.0f).force, 3.3f);
  EXPECT_TRUE(limiter.update(c, -1e38f).limited);
  EXPECT_EQ(limiter.update(c, -1e38f).force, -3.3f);
}

TEST(ForceLimiter, RampReachesFullForceAfterItsTimeAndStartsAnewAfterReset) {
  Limiter limiter;
  const auto c = Limiter::prepare({.limit = 3.3f, .slew_limit = 0.0f, .ramp_time = 0.1f}, period);
  for (int run = 0; run < 2; ++run) {
    float last = 0;
    for (int i = 1; i <= 99; ++i) {
      const auto out = limiter.update(c, 2.0f);
      EXPECT_NEAR(out.force, 2.0f * static_cast<float>(i) / 100.0f, 1e-5f);
      EXPECT_TRUE(out.ramping);
      EXPECT_GE(out.force, last);
      last = out.force;
    }
    limiter.update(c, 2.0f);
    EXPECT_EQ(limiter.update(c, 2.0f).force, 2.0f);
    EXPECT_FALSE(limiter.update(c, 2.0f).ramping);
    limiter.reset();
  }
}

TEST(ForceLimiter, SlewLimitBoundsEveryStepAndThenArrives) {
  Limiter limiter;
  const auto c = Limiter::prepare({.limit = 3.3f, .slew_limit = 100.0f, .ramp_time = 0.0f}, period);
  float last = 0;
  for (int i = 0; i < 20; ++i) {
    const auto out = limiter.update(c, 1.0f);
    EXPECT_LE(out.force - last, 0.1f + 1e-6f);
    last = out.force;
  }
  EXPECT_EQ(last, 1.0f);
  EXPECT_TRUE(limiter.update(c, -1.0f).slew_limited);
}

TEST(ForceLimiter, ALimitLoweredUnderWayIsMetAtOnceWhateverTheSlewLimit) {
  Limiter limiter;
  for (int i = 0; i < 1000; ++i) limiter.update(Limiter::prepare({3.0f, 100.0f, 0.0f}, period), 3.0f);
  EXPECT_EQ(limiter.update(Limiter::prepare({1.0f, 100.0f, 0.0f}, period), 3.0f).force, 1.0f);
}

RC_GTEST_PROP(ForceLimiter, NothingThatGoesInBreaksTheLimit, ()) {
  const auto any = [] { return std::bit_cast<float>(*rc::gen::arbitrary<std::uint32_t>()); };
  ForceLimiterConfig<float> config;
  config.limit = *rc::gen::map(rc::gen::inRange(0, 1000), [](int n) { return static_cast<float>(n) * 0.1f; });
  config.slew_limit = *rc::gen::map(rc::gen::inRange(0, 1000), [](int n) { return static_cast<float>(n); });
  config.ramp_time =
      *rc::gen::map(rc::gen::inRange(0, 10), [](int n) { return static_cast<float>(n) * 0.001f; });
  const auto c = Limiter::prepare(config, period);
  Limiter limiter;
  for (int i = 0; i < 50; ++i) {
    const float requested = any();
    const auto out = limiter.update(c, requested);
    RC_ASSERT(std::abs(out.force) <= config.limit);
    RC_ASSERT(out.not_finite == !std::isfinite(requested));
    if (out.not_finite) RC_ASSERT(out.force == 0.0f);
  }
}

TEST(ForceLimiter, NotFiniteGivesZeroAndTheSoftStartAgain) {
  Limiter limiter;
  const auto c = Limiter::prepare({.limit = 3.3f, .slew_limit = 0.0f, .ramp_time = 0.01f}, period);
  for (int i = 0; i < 20; ++i) limiter.update(c, 2.0f);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(limiter.update(c, bad).force, 0.0f);
    EXPECT_TRUE(limiter.update(c, bad).not_finite);
    EXPECT_TRUE(limiter.update(c, 2.0f).ramping);
  }
}

}  // namespace kmax::control::force_limiter_test
