#include "drivers/periodic_timer.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::periodic_timer_test {
namespace {

int times_due(PeriodicTimer& timer, std::uint32_t from_us, std::uint32_t step_us, int calls) {
  int due = 0;
  for (int i = 0; i < calls; ++i) due += timer.due(from_us + static_cast<std::uint32_t>(i) * step_us) ? 1 : 0;
  return due;
}

TEST(PeriodicTimer, IsDueAtOnceAndThenOnceInAnInterval) {
  for (const std::uint32_t start : {0U, 5'000'000U, 0xFFFF'F000U}) {
    PeriodicTimer timer(1'000);
    EXPECT_TRUE(timer.due(start)) << start;
    EXPECT_FALSE(timer.due(start + 999)) << start;
    EXPECT_TRUE(timer.due(start + 1'000)) << start;
    EXPECT_FALSE(timer.due(start + 1'000)) << start;
  }
}

TEST(PeriodicTimer, CloseToTheWrapOfTheClockItIsFirstDueAtTheWrap) {
  PeriodicTimer timer(1'000);
  EXPECT_EQ(times_due(timer, 0U - 256, 50, 5), 0);
  EXPECT_TRUE(timer.due(0));
}

TEST(PeriodicTimer, LeavesNoneOutThatComesALittleLate) {
  for (const std::uint32_t step : {200U, 999U, 1'000U, 1'001U, 1'900U}) {
    PeriodicTimer timer(1'000);
    const int due = times_due(timer, 70, step, 2'000);
    const int intervals = static_cast<int>(2'000 * std::uint64_t{step} / 1'000);
    EXPECT_NEAR(due, step > 1'000 ? 2'000 : intervals, step > 1'000 ? 0 : 1) << step;
  }
}

TEST(PeriodicTimer, IntervalsThatWereMissedAreLeftOut) {
  for (const std::uint32_t late : {2'000U, 2'400U, 10'400U}) {
    PeriodicTimer timer(1'000);
    EXPECT_TRUE(timer.due(0));
    EXPECT_TRUE(timer.due(late));
    EXPECT_FALSE(timer.due(late + 999)) << late;
    EXPECT_TRUE(timer.due(late + 1'000)) << late;
  }
}

}  // namespace
}  // namespace kmax::drivers::periodic_timer_test
