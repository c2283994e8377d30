#include "host_tools/experiment/background_trend.hpp"

#include <gtest/gtest.h>

#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment::background_trend_test {
namespace {

struct Result {
  paper::DeviationCell paper;
  double number = 0.0;
  std::size_t touches = 1;
};

BackgroundTrend trend_of(const std::vector<Result>& results, double interference = 5.0) {
  return background_trend(interference, std::span(results), &Result::number);
}

TEST(BackgroundTrend, IsFromTheLeastToTheLargestForceInWhateverOrder) {
  const BackgroundTrend trend =
      trend_of({{{2, 5, 0}, 7.0}, {{4, 5, 0}, 3.0}, {{0, 5, 0}, 8.0}, {{3, 5, 0}, 1.0}});
  EXPECT_EQ(trend.interference, 5.0);
  EXPECT_EQ(trend.without, 8.0);
  EXPECT_EQ(trend.with, 3.0);
  EXPECT_DOUBLE_EQ(trend.rank.value(), -0.8);
  EXPECT_EQ(trend.falls(), true);
}

TEST(BackgroundTrend, OtherForcesAndPairsThatNobodyTouchedDoNotCount) {
  const BackgroundTrend trend =
      trend_of({{{0, 5, 0}, 9.0}, {{1, 5, 0}, 4.0}, {{2, 5, 0}, 5.0}, {{4, 7, 0}, 1.0}, {{4, 5, 0}, 2.0, 0}});
  EXPECT_EQ(trend.without, 9.0);
  EXPECT_EQ(trend.with, 5.0);
  EXPECT_EQ(trend.falls(), true);
}

TEST(BackgroundTrend, WithoutABackgroundForceIsAtNoneAndNotAtASmallOne) {
  const BackgroundTrend trend = trend_of({{{0, 5, 0}, 9.0, 0}, {{1, 5, 0}, 4.0}, {{2, 5, 0}, 1.0}});
  EXPECT_EQ(trend.without, std::nullopt);
  EXPECT_EQ(trend.with, 1.0);
  EXPECT_EQ(trend.rank, -1.0);
  EXPECT_EQ(trend.falls(), std::nullopt);
}

TEST(BackgroundTrend, ThePairWithoutABackgroundForceIsNotTheOneWithIt) {
  const BackgroundTrend trend = trend_of({{{0, 5, 0}, 9.0}, {{4, 5, 0}, 1.0, 0}});
  EXPECT_EQ(trend.without, 9.0);
  EXPECT_EQ(trend.with, std::nullopt);
  EXPECT_EQ(trend.falls(), std::nullopt);
}

TEST(BackgroundTrend, OfNothingIsNoTrend) {
  const BackgroundTrend trend = trend_of({{{0, 3, 0}, 9.0}});
  EXPECT_EQ(trend.without, std::nullopt);
  EXPECT_EQ(trend.with, std::nullopt);
  EXPECT_EQ(trend.rank, std::nullopt);
  EXPECT_EQ(trend.falls(), std::nullopt);
}

TEST(BackgroundTrend, TheNumberMayBeAFunctionOfTheResult) {
  const std::vector<Result> results{{{0, 5, 6e-3}}, {{3, 5, 4e-3}}};
  const auto printed = [](const Result& result) { return result.paper.deviation; };
  EXPECT_EQ(background_trend(5.0, std::span(results), printed).with, 4e-3);
}

TEST(BackgroundTrend, FallsByATenthAtLeast) {
  EXPECT_EQ((BackgroundTrend{5.0, 1.0, 0.9, {}}.falls()), true);
  EXPECT_EQ((BackgroundTrend{5.0, 1.0, 0.91, {}}.falls()), false);
  EXPECT_EQ((BackgroundTrend{5.0, 0.0, -1.0, {}}.falls()), false) << "what is not there cannot fall";
}

TEST(AllFall, NeedsATrendAndNoneThatStays) {
  const BackgroundTrend falling{5.0, 1.0, 0.5, {}}, staying{7.0, 1.0, 1.0, {}}, untouched{3.0, 1.0, {}, {}};
  EXPECT_EQ(all_fall({falling, falling}), true);
  EXPECT_EQ(all_fall({falling, staying}), false);
  EXPECT_EQ(all_fall({falling, untouched}), std::nullopt);
  EXPECT_EQ(all_fall({untouched, staying}), false);
  EXPECT_EQ(all_fall({}), std::nullopt);
}

}  // namespace
}  // namespace kmax::experiment::background_trend_test
