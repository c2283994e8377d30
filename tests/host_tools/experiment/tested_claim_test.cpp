#include "host_tools/experiment/tested_claim.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace kmax::experiment::tested_claim_test
