#include "host_tools/experiment/tested_claim.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment::tested_claim_test {
namespace {

constexpr std::optional<bool> untested;

TEST(TestedClaim, AllHoldOnlyIfEachWasTestedAndHolds) {
  EXPECT_EQ(all_hold({true}), true);
  EXPECT_EQ(all_hold({true, true}), true);
  EXPECT_EQ(all_hold({true, untested}), untested);
  EXPECT_EQ(all_hold({untested}), untested);
}

TEST(TestedClaim, OneThatDoesNotHoldIsEnoughWhateverElseWasTested) {
  EXPECT_EQ(all_hold({false}), false);
  EXPECT_EQ(all_hold({true, false}), false);
  EXPECT_EQ(all_hold({untested, false, true}), false);
  EXPECT_EQ(all_hold({false, untested}), false);
}

TEST(TestedClaim, OfNoneNothingIsSaid) {
  EXPECT_EQ(all_hold({}), untested);
}

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

using Numbers = std::vector<double>;

TEST(Ranks, EqualValuesShareTheMeanOfTheirPlaces) {
  EXPECT_EQ(ranks(Numbers{30, 10, 20}), (Numbers{3, 1, 2}));
  EXPECT_EQ(ranks(Numbers{5, 1, 5, 5}), (Numbers{3, 1, 3, 3}));
  EXPECT_EQ(ranks(Numbers{2, 2, 1, 1}), (Numbers{3.5, 3.5, 1.5, 1.5}));
  EXPECT_EQ(ranks(Numbers{}), Numbers{});
}

// A published example: T. Lehmann's IQ against hours of television, rho = -29/165.
TEST(RankCorrelation, AgreesWithAPublishedExample) {
  const Numbers iq{106, 100, 86, 101, 99, 103, 97, 113, 112, 110};
  const Numbers hours{7, 27, 2, 50, 28, 29, 20, 12, 6, 17};
  EXPECT_NEAR(rank_correlation(iq, hours).value(), -29.0 / 165.0, 1e-12);
}

TEST(RankCorrelation, NothingToCompareIsNothing) {
  EXPECT_FALSE(rank_correlation(Numbers{}, Numbers{}));
  EXPECT_FALSE(rank_correlation(Numbers{1}, Numbers{2}));
  EXPECT_FALSE(rank_correlation(Numbers{1, 2, 3}, Numbers{7, 7, 7}));
  EXPECT_THROW(rank_correlation(Numbers{1, 2}, Numbers{1}), std::invalid_argument);
  EXPECT_THROW(rank_correlation(Numbers{1, 2}, Numbers{1, std::numeric_limits<double>::quiet_NaN()}),
               std::invalid_argument);
}

RC_GTEST_PROP(RankCorrelationProperty, OnlyTheOrderCounts, ()) {
  const auto numbers = *rc::gen::suchThat(
      rc::gen::container<std::vector<int>>(rc::gen::inRange(-20, 20)), [](const std::vector<int>& values) {
        return std::adjacent_find(values.begin(), values.end(), std::not_equal_to<>()) != values.end();
      });
  Numbers a(numbers.begin(), numbers.end()), cubed, negative;
  for (const double value : a) {
    cubed.push_back(value * value * value + 5);
    negative.push_back(-value);
  }
  RC_ASSERT(std::abs(rank_correlation(a, cubed).value() - 1.0) < 1e-12);
  RC_ASSERT(std::abs(rank_correlation(a, negative).value() + 1.0) < 1e-12);
}

}  // namespace

}  // namespace kmax::experiment::tested_claim_test
