#include "host_tools/calibration/winding_excitation.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace kmax::calibration::winding_excitation_test {

TEST(WindingExcitation, HalfPeriodIsThreeTimeConstantsWithinItsBounds) {
  constexpr double tick = 50e-6;
  EXPECT_EQ(winding_half_period(10.0 * tick, tick), 30);
  EXPECT_EQ(winding_half_period(0.0, tick), shortest_half_period);
  EXPECT_EQ(winding_half_period(1.0, tick), longest_half_period);
  EXPECT_EQ(winding_half_period(std::numeric_limits<double>::infinity(), tick), longest_half_period);
  EXPECT_EQ(winding_half_period(std::numeric_limits<double>::quiet_NaN(), tick), longest_half_period);
  for (int half = shortest_half_period; half <= longest_half_period; ++half) {
    EXPECT_GE(winding_slow_half_period(half), half);
    EXPECT_LE(winding_slow_half_period(half), std::max(half, 40));
  }
}

// Along the angle 0 the phases B and C carry minus half of the vector; across it, plus and minus 0.87.
TEST(WindingExcitation, NoPhaseCurrentChangesItsSign) {
  const WindingExcitation along = vector_excitation(5.0, 1e-3, 1.0, 50e-6);
  EXPECT_GT(along.bias, along.alternation);
  const WindingExcitation across = across_excitation(5.0, 1e-3, 1.0, 50e-6);
  EXPECT_GT(0.5 * across.bias, 0.866 * across.alternation);
  EXPECT_EQ(brushed_excitation(5.0, 1e-3, 1.0, 50e-6).bias, 0.0);
}

}  // namespace kmax::calibration::winding_excitation_test
