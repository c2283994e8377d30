#include "host_tools/experiment/wilson_interval.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::wilson_interval_test {

// z = 1.96 in the formula by hand; 81 of 263 is the example of R. G. Newcombe, "Two-sided confidence
// intervals for the single proportion", 1998, table I: 0.2553 to 0.3662.
TEST(WilsonInterval, IsTheKnownOne) {
  const auto expect = [](std::size_t hits, std::size_t trials, double low, double high) {
    const ShareInterval interval = wilson_interval(hits, trials);
    EXPECT_NEAR(interval.low, low, 5e-5) << hits << " of " << trials;
    EXPECT_NEAR(interval.high, high, 5e-5) << hits << " of " << trials;
  };
  expect(81, 263, 0.2553, 0.3662);
  expect(15, 148, 0.0624, 0.1605);
  expect(0, 20, 0.0, 0.1611);
  expect(1, 29, 0.0061, 0.1718);
  expect(3, 3, 0.4385, 1.0);
  expect(0, 3, 0.0, 0.5615);
}

RC_GTEST_PROP(WilsonIntervalProperty, HoldsTheShareAndMirrorsIt, ()) {
  const auto trials = *rc::gen::inRange<std::size_t>(1, 2000);
  const auto hits = *rc::gen::inRange<std::size_t>(0, trials + 1);
  const ShareInterval interval = wilson_interval(hits, trials),
                      other = wilson_interval(trials - hits, trials);
  const double share = static_cast<double>(hits) / static_cast<double>(trials);
  RC_ASSERT(interval.low >= 0.0 && interval.high <= 1.0);
  RC_ASSERT(interval.low <= share && share <= interval.high);
  RC_ASSERT(interval.low < interval.high);
  RC_ASSERT(std::abs(interval.low - (1.0 - other.high)) < 1e-12);
}

TEST(WilsonInterval, NeedsTrials) {
  using host_tools_test::thrown_message;
  EXPECT_CONTAINS(thrown_message<std::invalid_argument>([] { wilson_interval(0, 0); }), "0 of 0");
  EXPECT_CONTAINS(thrown_message<std::invalid_argument>([] { wilson_interval(4, 3); }), "4 of 3");
}

}  // namespace kmax::experiment::wilson_interval_test
