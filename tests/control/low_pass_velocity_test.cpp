#include "control/low_pass_velocity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace kmax::control::low_pass_velocity_test {

constexpr double period = 5e-5;
constexpr double nanometre = 1e-9;
constexpr double bandwidth = 100.0;

std::int64_t counts(double position) {
  return static_cast<std::int64_t>(std::floor(position / nanometre));
}

TEST(LowPassVelocity, GainNeedsNoExponentialAndIsStableForEveryBandwidth) {
  const double turn = 2.0 * std::numbers::pi * bandwidth * period;
  EXPECT_NEAR(LowPassVelocity<double>::prepare(bandwidth, period, nanometre).gain, turn / (1.0 + turn),
              1e-15);
  EXPECT_EQ(LowPassVelocity<double>::prepare(0.0, period, nanometre).gain, 0.0);
  EXPECT_EQ(LowPassVelocity<double>::prepare(-5.0, period, nanometre).gain, 0.0);
  const double fast = LowPassVelocity<double>::prepare(1e12, period, nanometre).gain;
  EXPECT_GT(fast, 0.999);
  EXPECT_LE(fast, 1.0);
}

TEST(LowPassVelocity, StepOfVelocityRisesWithTheTimeConstant) {
  const auto coefficients = LowPassVelocity<double>::prepare(bandwidth, period, nanometre);
  LowPassVelocity<double> velocity;
  velocity.reset(0);
  const double time_constant = 1.0 / (2.0 * std::numbers::pi * bandwidth);
  for (int k = 1; k <= 400; ++k) {
    const double estimate = velocity.update(coefficients, counts(0.1 * k * period));
    EXPECT_NEAR(estimate, 0.1 * (1.0 - std::exp(-k * period / time_constant)), 0.1 * 0.02) << k;
  }
}

TEST(LowPassVelocity, SineHasTheAmplitudeAndLagOfAFirstOrderFilter) {
  const auto coefficients = LowPassVelocity<double>::prepare(bandwidth, period, nanometre);
  LowPassVelocity<double> velocity;
  velocity.reset(0);
  const double omega = 2.0 * std::numbers::pi * bandwidth;  // at the corner: 1/sqrt(2), 45 degrees
  const double peak = 0.2;
  double worst = 0.0;
  for (int k = 1; k <= 4000; ++k) {
    const double time = k * period;
    const double estimate = velocity.update(coefficients, counts(peak / omega * std::sin(omega * time)));
    const double expected = peak * std::sqrt(0.5) * std::cos(omega * time - std::numbers::pi / 4.0);
    if (k > 1000) worst = std::fmax(worst, std::fabs(estimate - expected));
  }
  EXPECT_LT(
      worst,
      0.025 * peak);  // half a sample of the difference and one of the discretization, at 0.031 rad each
}

}  // namespace kmax::control::low_pass_velocity_test
