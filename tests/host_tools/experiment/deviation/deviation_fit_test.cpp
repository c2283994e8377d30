#include "host_tools/experiment/deviation/deviation_fit.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace kmax::experiment::deviation_fit_test {

std::vector<paper::DeviationCell> made_by(const HandResistance& hand) {
  std::vector<paper::DeviationCell> cells(paper::table_2.begin(), paper::table_2.end());
  for (paper::DeviationCell& cell : cells)
    cell.deviation = quasi_static_deviation(hand, cell.background, cell.interference);
  return cells;
}

TEST(QuasiStaticDeviation, IsNothingBelowTheThreshold) {
  const HandResistance hand{250.0, 2.75, 0.3, 0.0};
  EXPECT_EQ(quasi_static_deviation(hand, 0.0, 1.0), 0.0);
  EXPECT_NEAR(quasi_static_deviation(hand, 2.0, 5.0), 2.25 / (250.0 * 1.6), 1e-15);
  EXPECT_NEAR(quasi_static_deviation({250.0, 2.0, 0.0, 0.5}, 2.0, 5.0), 2.0 / 250.0, 1e-15);
}

RC_GTEST_PROP(FitDeviationProperty, FindsTheHandThatMadeATable, ()) {
  const auto number = [](int least, int most) { return static_cast<double>(*rc::gen::inRange(least, most)); };
  const HandResistance hand{number(150, 600), number(5, 28) / 10.0, number(0, 10) / 10.0, 0.0};
  const DeviationFit fit = fit_deviation(made_by(hand), fit_stiffening);
  RC_ASSERT(fit.rms < 1e-7);
  RC_ASSERT(std::abs(fit.hand.stiffness / hand.stiffness - 1.0) < 1e-3);
  RC_ASSERT(std::abs(fit.hand.threshold - hand.threshold) < 1e-3);
  RC_ASSERT(std::abs(fit.hand.stiffening - hand.stiffening) < 1e-3);
}

TEST(FitDeviation, FindsARisingThresholdToo) {
  const DeviationFit fit = fit_deviation(made_by({300.0, 2.2, 0.0, 0.6}), fit_threshold);
  EXPECT_LT(fit.rms, 1e-7);
  EXPECT_NEAR(fit.hand.threshold_rise, 0.6, 1e-3);
  EXPECT_EQ(fit.hand.stiffening, 0.0);
  EXPECT_EQ(fit.error.stiffening, 0.0);
}

// Two codes agree on the paper's table: 240 N/m, 2.75 N, 0.32 /N, rms 0.81 mm; without stiffening 0.71 mm.
TEST(FitTable2, StiffeningIsNotWhatFitsBest) {
  const std::vector<DeviationFit> fits = fit_table_2();
  ASSERT_EQ(fits.size(), 4u);
  const DeviationFit &neither = fits[0], &stiffening = fits[1], &threshold = fits[2], &both = fits[3];
  EXPECT_NEAR(stiffening.hand.stiffness, 240.0, 5.0);
  EXPECT_NEAR(stiffening.hand.threshold, 2.75, 0.02);
  EXPECT_NEAR(stiffening.hand.stiffening, 0.32, 0.01);
  EXPECT_NEAR(stiffening.rms, 0.81e-3, 0.02e-3);
  EXPECT_NEAR(threshold.rms, 0.71e-3, 0.01e-3);
  EXPECT_LT(threshold.rms, stiffening.rms);
  EXPECT_LT(both.rms, threshold.rms);
  EXPECT_GT(neither.rms, 2e-3);
  EXPECT_LT(both.hand.stiffening, 0.5 * stiffening.hand.stiffening);
  EXPECT_GT(both.error.stiffening, 0.0);
}

TEST(FitDeviation, FewerCellsThanNumbersAreRefused) {
  EXPECT_THROW(fit_deviation(std::span(paper::table_2).first(3), fit_both), std::invalid_argument);
}

}  // namespace kmax::experiment::deviation_fit_test
