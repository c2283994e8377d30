#include "control/difference_velocity.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstdint>

namespace kmax::control::difference_velocity_test {

TEST(DifferenceVelocity, OneCountIsOneQuantumPerPeriod) {
  const auto coefficients = DifferenceVelocity<double>::prepare(2e-3, 55e-6);
  DifferenceVelocity<double> velocity;
  velocity.reset(7);
  EXPECT_DOUBLE_EQ(velocity.update(coefficients, 8), 27.5e-3);
  EXPECT_DOUBLE_EQ(velocity.update(coefficients, 8), 0.0);
  EXPECT_DOUBLE_EQ(velocity.update(coefficients, 6), -55e-3);
}

// One count in 10,000 ticks: 0.2 um/s. Any single sample is 0 or 2 mm/s; the sum is the path travelled.
TEST(DifferenceVelocity, SumsToThePathAtVeryLowSpeed) {
  const auto coefficients = DifferenceVelocity<double>::prepare(5e-5, 1e-7);
  DifferenceVelocity<double> velocity;
  velocity.reset(0);
  double path = 0.0;
  for (int k = 1; k <= 200'000; ++k) path += 5e-5 * velocity.update(coefficients, k / 10'000);
  EXPECT_NEAR(path, 20e-7, 1e-15);
}

RC_GTEST_PROP(DifferenceVelocity, EveryPairOfCountsGivesAFiniteValue,
              (std::int64_t first, std::int64_t second)) {
  const auto coefficients = DifferenceVelocity<float>::prepare(5e-5F, 1e-7F);
  DifferenceVelocity<float> velocity;
  velocity.reset(first);
  const float value = velocity.update(coefficients, second);
  RC_ASSERT(std::isfinite(value));
  RC_ASSERT(value == 0.0F || (value > 0.0F) == (second > first));
}

}  // namespace kmax::control::difference_velocity_test
