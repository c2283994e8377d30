#include "board/power/sample_hold.hpp"

#include <gtest/gtest.h>

namespace kmax::board::sample_hold_test {
namespace {

/// A tick of an axis whose sample is invalid, or not.
bool holds(SampleHold& samples, std::size_t axis, bool invalid) {
  if (invalid) samples.ISR_invalidate(axis);
  return samples.ISR_has_action() && samples.ISR_take(axis).hold;
}

TEST(SampleHold, AValidSampleAsksForNothing) {
  SampleHold samples;
  EXPECT_FALSE(samples.ISR_has_action());
  EXPECT_TRUE(holds(samples, 0, true));
  EXPECT_FALSE(holds(samples, 0, false));
  EXPECT_FALSE(samples.ISR_has_action()) << "the tick after is as cheap as before";
}

TEST(SampleHold, HoldsNoMoreThanTheLongestRunAndThenTakesOneSample) {
  SampleHold samples;
  for (int round = 0; round < 3; ++round) {
    for (unsigned n = 0; n < SampleHold::longest; ++n) EXPECT_TRUE(holds(samples, 0, true)) << round << n;
    EXPECT_FALSE(holds(samples, 0, true)) << "interference in every period does not hide an over-current";
  }
}

TEST(SampleHold, OneValidSampleBeginsTheCountAnew) {
  SampleHold samples;
  for (unsigned run = 1; run <= SampleHold::longest; ++run) {
    for (unsigned n = 0; n < run; ++n) EXPECT_TRUE(holds(samples, 0, true)) << run << n;
    EXPECT_FALSE(holds(samples, 0, false));
  }
  // Exactly the bound, one valid sample, and interference again.
  for (unsigned n = 0; n < SampleHold::longest; ++n) EXPECT_TRUE(holds(samples, 0, true)) << n;
  EXPECT_FALSE(holds(samples, 0, true));
}

TEST(SampleHold, TwoEdgesBeforeOneSampleAreOneInvalidSample) {
  SampleHold samples;
  for (unsigned n = 0; n < SampleHold::longest; ++n) {
    samples.ISR_invalidate(0);
    EXPECT_TRUE(holds(samples, 0, true)) << n;
  }
  EXPECT_FALSE(holds(samples, 0, true));
}

TEST(SampleHold, AnAxisCountsItsOwnSamplesAlone) {
  SampleHold samples;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) samples.ISR_invalidate(axis);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) EXPECT_TRUE(samples.ISR_take(axis).hold);
  EXPECT_TRUE(holds(samples, 0, true));
  EXPECT_FALSE(holds(samples, 1, false));
  EXPECT_TRUE(holds(samples, 0, true));
  EXPECT_TRUE(holds(samples, 1, true));
  EXPECT_FALSE(holds(samples, 0, true)) << "the fourth of this axis";
  EXPECT_TRUE(holds(samples, 1, true)) << "the second of that one";
}

TEST(SampleHold, CalibrationAndInvalidSamplesAreToldApart) {
  SampleHold samples;
  samples.set_calibrating(true);
  for (int n = 0; n < 10; ++n) {
    ASSERT_TRUE(samples.ISR_has_action());
    const auto action = samples.ISR_take(1);
    EXPECT_TRUE(action.calibrate);
    EXPECT_FALSE(action.hold);
  }
  samples.ISR_invalidate(1);
  samples.set_calibrating(false);
  const auto action = samples.ISR_take(1);
  EXPECT_TRUE(action.hold);
  EXPECT_FALSE(action.calibrate);
  samples.ISR_invalidate(0);
  samples.set_calibrating(true);
  const auto both = samples.ISR_take(0);
  EXPECT_TRUE(both.hold && both.calibrate);
}

TEST(InterferenceBudget, ForgivesItsMostAndItsLeakForEachMillisecondThatPasses) {
  InterferenceBudget budget;
  std::uint32_t now = 0xFFFF'FF00;  // the clock wraps
  budget.poll(now);
  for (unsigned n = 0; n < InterferenceBudget::most; ++n) {
    EXPECT_FALSE(budget.ISR_spent()) << n;
    budget.ISR_forgive();
  }
  EXPECT_TRUE(budget.ISR_spent());
  EXPECT_EQ(budget.forgiven(), InterferenceBudget::most);
  budget.poll(now + 999);
  EXPECT_TRUE(budget.ISR_spent()) << "just before the bound";
  for (int n = 0; n < 3; ++n) {
    budget.poll(now += 1'000);
    budget.poll(now + 999);
    for (unsigned leaked = 0; leaked < InterferenceBudget::leak; ++leaked) {
      ASSERT_FALSE(budget.ISR_spent()) << n;
      budget.ISR_forgive();
    }
    EXPECT_TRUE(budget.ISR_spent()) << "what comes back just after the bound spends what has leaked";
  }
}

// Whenever it is polled: the same number in the long run.
TEST(InterferenceBudget, LeaksForTheWholeTimeHoweverSeldomItIsPolled) {
  for (const unsigned interval : {200U, 999U, 1'001U, 1'900U, 3'100U}) {
    SCOPED_TRACE(interval);
    InterferenceBudget budget;
    unsigned forgiven = 0;
    constexpr std::uint32_t duration = 10'000'000;
    for (std::uint32_t passed = 0; passed < duration; passed += interval) {
      budget.poll(0xFFFF'0000 + passed);
      for (; !budget.ISR_spent(); ++forgiven) budget.ISR_forgive();
    }
    EXPECT_NEAR(forgiven, InterferenceBudget::leak * duration / 1'000, InterferenceBudget::most);
    EXPECT_EQ(budget.forgiven(), forgiven) << "what has leaked too";
  }
}

TEST(InterferenceBudget, QuietSavesNothingUp) {
  InterferenceBudget budget;
  for (std::uint32_t now = 0; now <= 1'000'000; now += 1'000) budget.poll(now);
  for (unsigned n = 0; n < InterferenceBudget::most; ++n) {
    EXPECT_FALSE(budget.ISR_spent()) << n;
    budget.ISR_forgive();
  }
  EXPECT_TRUE(budget.ISR_spent());
}

}  // namespace
}  // namespace kmax::board::sample_hold_test
