#include "host_tools/simulation/noise_generator.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kmax::simulation::noise_generator_test {

// The sequence that the authors' reference implementation gives for seed 1234567.
TEST(NoiseGenerator, GivesThePublishedSequence) {
  NoiseGenerator noise(1234567);
  EXPECT_EQ(noise.bits(), 6457827717110365317u);
  EXPECT_EQ(noise.bits(), 3203168211198807973u);
  EXPECT_EQ(noise.bits(), 9817491932198370423u);
  EXPECT_EQ(noise.bits(), 4593380528125082431u);
}

TEST(NoiseGenerator, UniformFillsItsInterval) {
  NoiseGenerator noise(1);
  double low = 1.0, high = 0.0, sum = 0.0;
  constexpr int draws = 100000;
  for (int n = 0; n < draws; ++n) {
    const double value = noise.uniform();
    low = std::fmin(low, value);
    high = std::fmax(high, value);
    sum += value;
  }
  EXPECT_GE(low, 0.0);
  EXPECT_LT(low, 1e-3);
  EXPECT_LT(high, 1.0);
  EXPECT_GT(high, 1.0 - 1e-3);
  EXPECT_NEAR(sum / draws, 0.5, 4.0 / std::sqrt(12.0 * draws));
}

TEST(NoiseGenerator, GaussianHasMeanVarianceAndIsWhite) {
  NoiseGenerator noise(99);
  constexpr int draws = 200000;
  double sum = 0.0, squares = 0.0, fourth = 0.0, product = 0.0, last = 0.0, most = 0.0;
  for (int n = 0; n < draws; ++n) {
    const double value = noise.gaussian();
    sum += value;
    squares += value * value;
    fourth += value * value * value * value;
    product += value * last;
    last = value;
    most = std::fmax(most, std::fabs(value));
  }
  const double tolerance = 4.0 / std::sqrt(draws);
  EXPECT_NEAR(sum / draws, 0.0, tolerance);
  EXPECT_NEAR(squares / draws, 1.0, 1.5 * tolerance);
  EXPECT_NEAR(product / draws, 0.0, tolerance);
  EXPECT_NEAR(fourth / draws, 2.85, 0.1);
  EXPECT_LT(most, 4.9);
}

}  // namespace kmax::simulation::noise_generator_test
