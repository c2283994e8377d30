#include "host_tools/experiment/progress_report.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <utility>
#include <vector>

namespace kmax::experiment::progress_report_test {
namespace {

using Reported = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(PartOf, PartsFollowEachOtherUpToTheWhole) {
  Reported reported;
  const ProgressReport whole = [&](std::size_t done, std::size_t count) {
    reported.emplace_back(done, count);
  };
  const ProgressReport first = part_of(whole, 0, 1, 4), rest = part_of(whole, 1, 3, 4);
  for (std::size_t done = 0; done <= 2; ++done) first(done, 2);
  for (std::size_t done = 0; done <= 2; ++done) rest(done, 2);
  EXPECT_EQ(reported, (Reported{{0, 8}, {1, 8}, {2, 8}, {2, 8}, {5, 8}, {8, 8}}));
}

TEST(PartOf, NobodyNeedsToBeTold) {
  const ProgressReport nobody;
  EXPECT_NO_THROW(part_of(nobody, 0, 1, 2)(1, 2));
}

TEST(RemainingTime, IsTheMeanOfTheJobsDoneTimesTheRest) {
  const RemainingTime time(100.0);
  EXPECT_FALSE(time.seconds(130.0, 0, 10));
  EXPECT_DOUBLE_EQ(*time.seconds(130.0, 3, 10), 70.0);
  EXPECT_DOUBLE_EQ(*time.seconds(200.0, 10, 10), 0.0);
}

// A run that was resumed has most of its jobs for nothing.
TEST(RemainingTime, JobsOfAnEarlierRunCostNothing) {
  const RemainingTime time(0.0, 90);
  EXPECT_FALSE(time.seconds(5.0, 90, 100));
  EXPECT_DOUBLE_EQ(*time.seconds(5.0, 95, 100), 5.0);
  EXPECT_DOUBLE_EQ(*RemainingTime(0.0, 100).seconds(0.0, 100, 100), 0.0);
}

TEST(RemainingTime, OddArgumentsGiveNothingAbsurd) {
  const RemainingTime time(50.0, 2);
  EXPECT_FALSE(time.seconds(60.0, 1, 10));            // fewer than at the beginning
  EXPECT_DOUBLE_EQ(*time.seconds(40.0, 5, 10), 0.0);  // a clock that went back
  EXPECT_DOUBLE_EQ(*time.seconds(60.0, 12, 10), 0.0);
  EXPECT_DOUBLE_EQ(*time.seconds(60.0, 0, 0), 0.0);
}

TEST(DurationWords, AreAsPreciseAsAnEstimate) {
  EXPECT_EQ(duration_words(0.0), "1 s");
  EXPECT_EQ(duration_words(4.6), "5 s");
  EXPECT_EQ(duration_words(9.49), "9 s");
  EXPECT_EQ(duration_words(9.5), "10 s");
  EXPECT_EQ(duration_words(44.0), "40 s");
  EXPECT_EQ(duration_words(84.9), "80 s");
  EXPECT_EQ(duration_words(85.0), "1 min");
  EXPECT_EQ(duration_words(3569.0), "59 min");
  EXPECT_EQ(duration_words(3570.0), "1 h");
  EXPECT_EQ(duration_words(7800.0), "2 h 10 min");
  EXPECT_EQ(duration_words(3 * 86400.0), "3 days");
  EXPECT_EQ(duration_words(-1.0), "some time");
  EXPECT_EQ(duration_words(std::numeric_limits<double>::quiet_NaN()), "some time");
  EXPECT_EQ(duration_words(std::numeric_limits<double>::infinity()), "some time");
}

RC_GTEST_PROP(DurationWordsProperty, NeverSayZeroOfAnythingOrSixtyMinutes, ()) {
  const double seconds = *rc::gen::inRange(0, 400'000) * 0.5;
  const std::string words = duration_words(seconds);
  RC_ASSERT(!words.starts_with("0 ") && words.find("60 min") == std::string::npos);
  RC_ASSERT(words.find(" 0 min") == std::string::npos);
}

TEST(ProgressWords, NameTheRestOnlyWhenItIsKnown) {
  EXPECT_EQ(progress_words(0, 96, std::nullopt), "0 of 96 done");
  EXPECT_EQ(progress_words(12, 96, 40.0), "12 of 96 done, 40 s left");
  EXPECT_EQ(progress_words(96, 96, 0.0), "96 of 96 done");
}

}  // namespace

}  // namespace kmax::experiment::progress_report_test
