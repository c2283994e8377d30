#include "host_tools/experiment/rank_correlation.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

namespace kmax::experiment::rank_correlation_test {
namespace {

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
}  // namespace kmax::experiment::rank_correlation_test
