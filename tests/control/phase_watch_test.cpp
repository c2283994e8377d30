#include "control/phase_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kmax::control {
namespace {

using Watch = PhaseWatch<float>;
using Currents = PhaseCurrents<float>;

constexpr PhaseWatchConfig<float> config{5.0f, 1.5f, 3000.0f, 20000.0f};
constexpr auto c = Watch::prepare(config);

constexpr Currents dc(float current) {
  return {0.0f, current, -current};
}

TEST(PhaseWatch, LimitsFollowTheConfiguration) {
  EXPECT_FLOAT_EQ(c.over_current, 7.5f);
  EXPECT_FLOAT_EQ(c.present, 0.25f);
  EXPECT_EQ(c.patience, 33u);  // 5 / 3000 s
  PhaseWatchConfig<float> strong = config;
  strong.current_limit = 60.0f;
  EXPECT_FLOAT_EQ(Watch::prepare(strong).present, 3.0f);
  PhaseWatchConfig<float> fast = config;
  fast.bandwidth = 50000.0f;
  EXPECT_EQ(Watch::prepare(fast).patience, 20u);  // never below 1 ms
  PhaseWatchConfig<float> dead = config;
  dead.bandwidth = 0.0f;
  EXPECT_EQ(Watch::prepare(dead).patience, 1'000'000'000u);  // infinite, saturated before the conversion
}

TEST(PhaseWatch, CurrentThatVanishesIsFoundInTheSameSample) {
  for (const float sign : {1.0f, -1.0f}) {
    Watch watch;
    for (int i = 0; i < 100; ++i) ASSERT_EQ(watch.update(c, dc(sign), dc(sign), true), PhaseCondition::good);
    EXPECT_EQ(watch.update(c, dc(0.0f), dc(sign), true), PhaseCondition::open);
  }
}

TEST(PhaseWatch, FindsEachOfThreePhases) {
  for (int open = 0; open < 3; ++open) {
    Watch watch;
    const Currents flowing{1.0f, -0.5f, -0.5f};
    ASSERT_EQ(watch.update(c, flowing, flowing, true), PhaseCondition::good);
    // The two that are left carry the same current.
    Currents left{};
    if (open == 0) left = {0.0f, 0.6f, -0.6f};
    if (open == 1) left = {0.8f, 0.0f, -0.8f};
    if (open == 2) left = {0.8f, -0.8f, 0.0f};
    EXPECT_EQ(watch.update(c, left, flowing, true), PhaseCondition::open) << open;
  }
}

TEST(PhaseWatch, CurrentThatNeverComesIsFoundAfterThePatience) {
  Watch watch;
  for (std::uint32_t i = 0; i < c.patience; ++i)
    ASSERT_EQ(watch.update(c, dc(0.0f), dc(1.0f), true), PhaseCondition::good) << i;
  EXPECT_EQ(watch.update(c, dc(0.0f), dc(1.0f), true), PhaseCondition::open);
}

TEST(PhaseWatch, AFastMotorIsNotJudgedByCurrentThatDoesNotCome) {
  Watch watch;
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(watch.update(c, dc(0.0f), dc(1.0f), false), PhaseCondition::good);
}

TEST(PhaseWatch, AFastMotorIsNotJudgedByCurrentThatVanishes) {
  Watch watch;
  ASSERT_EQ(watch.update(c, dc(1.0f), dc(1.0f), true), PhaseCondition::good);
  EXPECT_EQ(watch.update(c, dc(0.0f), dc(1.0f), false), PhaseCondition::good);
}

// A release of the force: the reference goes first, the current follows.
TEST(PhaseWatch, AReleaseOrAReversalIsNoOpenPhase) {
  Watch watch;
  float current = 2.0f;
  for (int i = 0; i < 2000; ++i) {
    const float reference = (i / 50) % 2 == 0 ? 2.0f : (i / 100) % 2 == 0 ? -2.0f : 0.0f;
    // The fastest loop that can be set: an eighth of the sampling frequency.
    current += 0.54f * (reference - current);
    ASSERT_EQ(watch.update(c, dc(current), dc(reference), true), PhaseCondition::good) << i;
  }
}

TEST(PhaseWatch, NoiseBelowPresentSaysNothing) {
  Watch watch;
  for (int i = 0; i < 1000; ++i) {
    const float noise = i % 2 == 0 ? 0.2f : 0.0f;
    ASSERT_EQ(watch.update(c, dc(noise), dc(0.24f), true), PhaseCondition::good);
  }
}

TEST(PhaseWatch, OverCurrentAndNanTripWhateverTheReference) {
  Watch watch;
  EXPECT_EQ(watch.update(c, dc(7.5f), dc(5.0f), true), PhaseCondition::good);
  EXPECT_EQ(watch.update(c, dc(7.6f), dc(5.0f), true), PhaseCondition::over_current);
  EXPECT_EQ(watch.update(c, {0.0f, -7.6f, 0.0f}, {}, false), PhaseCondition::over_current);
  EXPECT_EQ(watch.update(c, {-7.6f, 3.0f, 3.0f}, {}, false), PhaseCondition::over_current);
  EXPECT_EQ(watch.update(c, {0.0f, std::nanf(""), 0.0f}, {}, true), PhaseCondition::over_current);
}

TEST(PhaseWatch, ResetForgetsTheSampleBefore) {
  Watch watch;
  (void)watch.update(c, dc(1.0f), dc(1.0f), true);
  watch.reset();
  EXPECT_EQ(watch.update(c, dc(0.0f), dc(1.0f), true), PhaseCondition::good);
}

}  // namespace
}  // namespace kmax::control
