#include "host_tools/bench/still_watch.hpp"

#include <gtest/gtest.h>

namespace kmax::bench::still_watch_test {

using std::chrono::milliseconds;

constexpr StillLimits limits{.from_start = 0.1, .after_motion = 0.03};

TEST(StillWatch, WithoutLimitsWatchesNothing) {
  StillWatch watch;
  EXPECT_FALSE(watch.active());
  EXPECT_FALSE(watch.stands(0.0, 0.0, std::chrono::hours(1)));
}

TEST(StillWatch, WaitsLongerForAHandleThatHasNotMovedYet) {
  StillWatch watch(limits, 500.0, milliseconds(0));
  for (const int at : {0, 30, 60, 99}) EXPECT_FALSE(watch.stands(500.0, 0.0, milliseconds(at))) << at;
  EXPECT_FALSE(watch.doubtful());
  EXPECT_TRUE(watch.stands(501.0, 0.0, milliseconds(101)));
}

TEST(StillWatch, EndsSoonAfterAMotionThatWasClear) {
  StillWatch watch(limits, 500.0, milliseconds(0));
  EXPECT_FALSE(watch.stands(510.0, 0.0, milliseconds(50)));
  EXPECT_FALSE(watch.doubtful());
  for (const int at : {60, 70, 80}) {
    EXPECT_FALSE(watch.stands(510.0, 0.0, milliseconds(at))) << at;
    EXPECT_TRUE(watch.doubtful());
  }
  EXPECT_TRUE(watch.stands(510.0, 0.0, milliseconds(81)));
}

// Two looks that lie a swing apart prove nothing.
TEST(StillWatch, BelievesNoFewerThanFourLooks) {
  StillWatch watch(limits, 0.0, milliseconds(0));
  EXPECT_FALSE(watch.stands(10.0, 0.0, milliseconds(10)));
  for (const int at : {1000, 2000, 3000}) EXPECT_FALSE(watch.stands(10.0, 0.0, milliseconds(at))) << at;
  EXPECT_TRUE(watch.stands(10.0, 0.0, milliseconds(4000)));
}

TEST(StillWatch, TakesAFewCountsOfNoiseForNoMotion) {
  StillWatch watch(limits, 500.0, milliseconds(0));
  for (const int at : {10, 30, 60, 80, 110}) EXPECT_FALSE(watch.stands(509.0, 0.0, milliseconds(at))) << at;
  EXPECT_TRUE(watch.stands(509.0, 0.0, milliseconds(111)));
}

TEST(StillWatch, SeesASpeedWhereCountsAreFar) {
  StillWatch watch(limits, 500.0, milliseconds(0));
  EXPECT_FALSE(watch.stands(500.0, 0.0021, milliseconds(150)));
  for (const int at : {160, 200, 250}) EXPECT_FALSE(watch.stands(500.0, 0.0, milliseconds(at))) << at;
  EXPECT_TRUE(watch.stands(500.0, -0.0019, milliseconds(251)));
}

TEST(StillWatch, WatchesAfterMotionAloneIfNoOtherLimitIsSet) {
  StillWatch watch({.from_start = 0.0, .after_motion = 0.03}, 0.0, milliseconds(0));
  for (const int at : {1, 2, 3, 4, 10}) EXPECT_FALSE(watch.stands(0.0, 0.0, std::chrono::seconds(at))) << at;
  for (const int at : {11, 12, 13, 14})
    EXPECT_FALSE(watch.stands(-10.0, 0.0, std::chrono::seconds(at))) << at;
  EXPECT_TRUE(watch.stands(-10.0, 0.0, std::chrono::seconds(15)));
}

}  // namespace kmax::bench::still_watch_test
