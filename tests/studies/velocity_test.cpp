#include "tests/studies/velocity.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace kmax::studies::velocity_test {

// What docs/velocity_estimators.md says of the winner.
TEST(VelocityStudy, TheEdgePeriodIsRightWhereFoawIsNoisyAndAsGoodInImpacts) {
  ASSERT_EQ(velocity_candidates[edge_period].name, "edge period, 16");
  const auto cases = measure_velocity_errors();
  ASSERT_EQ(cases.size(), 45U);
  const auto mean_at = [&cases](double rate) { return against_foaw(at_rate(cases, rate))[edge_period].mean; };
  EXPECT_LT(mean_at(20e3), 0.2);
  EXPECT_LT(mean_at(2e3), 0.75);
  EXPECT_NEAR(mean_at(500.0), 1.0, 0.05) << "no better there";
  for (const VelocityCase& one : cases) {
    const double error = one.errors[edge_period].rms, foaw = one.errors[0].rms;
    SCOPED_TRACE(one.motion + ", " + std::to_string(one.quantum) + ", " + std::to_string(one.rate));
    const bool slow_on_coarse = one.quantum == 55e-6 && one.rate == 20e3 && one.motion[0] != 'i';
    // Where neither is off by more than a fraction of what one count in a sample is, nobody feels which it
    // is.
    EXPECT_LT(error, slow_on_coarse ? foaw / 10.0 : 1.25 * foaw + 0.05 * one.quantum * one.rate);
  }
}

// Why the firmware's FOAW takes every second sample beyond 10 kHz, and each up to there.
TEST(VelocityStudy, FoawOfEverySecondSampleIsBetterAt20KilohertzAndNotBelow) {
  const auto cases = measure_velocity_errors();
  const auto at = [&cases](double rate) { return against_foaw(at_rate(cases, rate))[foaw_of_every_second]; };
  EXPECT_LT(at(20e3).mean, 0.75);
  EXPECT_LT(at(20e3).largest, 1.3);
  EXPECT_GT(at(2e3).largest, 2.0);
  EXPECT_GT(at(500.0).mean, 1.2);
}

TEST(VelocityStudy, FoawsWindowLeapsSoNoSearchCanGoOnFromTheLast) {
  EXPECT_GT(share_of_leaps(), 0.001);
}

TEST(VelocityStudy, ACandidateThatWasNotCountedIsNamed) {
  EXPECT_THROW(velocity_page({}, {}, ""), std::invalid_argument);
}

}  // namespace kmax::studies::velocity_test
