#include "control/tracking_velocity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace kmax::control::tracking_velocity_test {

constexpr double period = 5e-5;
constexpr double nanometre = 1e-9;
constexpr double bandwidth = 100.0;
constexpr double omega = 2.0 * std::numbers::pi * bandwidth;

std::int64_t counts(double position) {
  return static_cast<std::int64_t>(std::floor(position / nanometre));
}

TEST(TrackingVelocity, GainsPlaceADoublePole) {
  for (const double hertz : {0.1, 10.0, 100.0, 5000.0}) {
    const double pole = 1.0 / (1.0 + 2.0 * std::numbers::pi * hertz * period);
    const auto coefficients = TrackingVelocity<double>::prepare(hertz, period, nanometre);
    const double alpha = 1.0 - coefficients.kept;
    EXPECT_NEAR(alpha, 1.0 - pole * pole, 1e-15);
    EXPECT_NEAR(coefficients.beta, (1.0 - pole) * (1.0 - pole), 1e-15);
    // z^2 - (2 - alpha - beta) z + (1 - alpha) = (z - p)^2
    EXPECT_NEAR(2.0 - alpha - coefficients.beta, 2.0 * pole, 1e-14);
    EXPECT_NEAR(1.0 - alpha, pole * pole, 1e-14);
  }
}

TEST(TrackingVelocity, StepOfVelocitySettlesOnTheRampWithoutOvershoot) {
  const auto coefficients = TrackingVelocity<double>::prepare(bandwidth, period, nanometre);
  TrackingVelocity<double> velocity;
  velocity.reset(0);
  double estimate = 0.0;
  for (int k = 1; k <= 2000; ++k) {
    const double time = k * period;
    estimate = velocity.update(coefficients, counts(0.1 * time));
    ASSERT_LT(estimate, 0.1 * 1.0001);
    ASSERT_NEAR(estimate, 0.1 * (1.0 - (1.0 + omega * time) * std::exp(-omega * time)), 0.1 * 0.03) << k;
  }
  EXPECT_NEAR(estimate, 0.1, 1e-6);
}

TEST(TrackingVelocity, SineAtThePoleHasHalfTheAmplitudeAndAQuarterTurnOfLag) {
  const auto coefficients = TrackingVelocity<double>::prepare(bandwidth, period, nanometre);
  TrackingVelocity<double> velocity;
  velocity.reset(0);
  const double peak = 0.2;
  double worst = 0.0;
  for (int k = 1; k <= 4000; ++k) {
    const double time = k * period;
    const double estimate = velocity.update(coefficients, counts(peak / omega * std::sin(omega * time)));
    if (k > 1000) worst = std::fmax(worst, std::fabs(estimate - 0.5 * peak * std::sin(omega * time)));
  }
  EXPECT_LT(worst, 0.03 * peak);
}

TEST(TrackingVelocity, StartsOnAKnownVelocity) {
  const auto coefficients = TrackingVelocity<double>::prepare(bandwidth, period, nanometre);
  TrackingVelocity<double> velocity;
  velocity.reset(coefficients, counts(0.0), 0.1);
  for (int k = 1; k <= 100; ++k)
    EXPECT_NEAR(velocity.update(coefficients, counts(0.1 * k * period)), 0.1, 1e-5);
}

// A day at 20 kHz is 1.7e9 ticks. The state of a stable filter does not remember its age, so what could drift
// is the accumulation within its memory: a million ticks (a thousand of its time constants) on a ramp of 0.37
// counts per tick.
TEST(TrackingVelocity, FloatDoesNotDriftOnALongRamp) {
  const auto coefficients = TrackingVelocity<float>::prepare(10.0F, 5e-5F, 1e-7F);
  TrackingVelocity<float> velocity;
  velocity.reset(864'000'000'000);
  double sum = 0.0;
  int samples = 0;
  for (std::int64_t k = 1; k <= 1'000'000; ++k) {
    const float estimate = velocity.update(coefficients, 864'000'000'000 + 37 * k / 100);
    if (k > 900'000) {
      sum += static_cast<double>(estimate);
      ++samples;
    }
  }
  EXPECT_NEAR(sum / samples, 0.37 * 2e-3, 0.37 * 2e-3 * 1e-5);
  for (int k = 0; k < 200'000; ++k) velocity.update(coefficients, 864'000'370'000);
  EXPECT_LT(std::fabs(velocity.update(coefficients, 864'000'370'000)), 1e-12F);
}

TEST(TrackingVelocity, OneThatWasNeverResetStandsAtTheOrigin) {
  TrackingVelocity<double> velocity;
  EXPECT_EQ(velocity.update(TrackingVelocity<double>::prepare(50.0, 0.002, 1e-6), 0), 0.0);
}

}  // namespace kmax::control::tracking_velocity_test
