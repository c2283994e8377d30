#include "control/current_loop_gains.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace kmax::control {
namespace {

constexpr double period = 5e-5;

TEST(CurrentLoopGains, OneMinusExponentialIsExactToTheLastPlaces) {
  for (double x = 1e-12; x < 100.0; x *= 1.37) {
    EXPECT_NEAR(one_minus_exponential(x) / -std::expm1(-x), 1.0, 2e-15) << x;
    EXPECT_NEAR(static_cast<double>(one_minus_exponential(static_cast<float>(x))) / -std::expm1(-x), 1.0,
                1e-6)
        << x;
  }
  EXPECT_EQ(one_minus_exponential(0.0), 0.0);
  EXPECT_EQ(one_minus_exponential(-1.0), 0.0);
  EXPECT_EQ(one_minus_exponential(std::numeric_limits<double>::infinity()), 1.0);
  EXPECT_EQ(one_minus_exponential(std::nan("")), 0.0);
}

// For a slow winding and a low bandwidth they are the textbook's: kp = L w, ki = R w.
TEST(CurrentLoopGains, ApproachTheContinuousOnes) {
  const double resistance = 0.7;
  const double inductance = 0.05;
  const double bandwidth = 20.0;
  const auto gains = CurrentLoopGains<double>::prepare(resistance, inductance, bandwidth, period);
  EXPECT_NEAR(gains.proportional / (inductance * bandwidth), 1.0, 1e-3);
  EXPECT_NEAR(gains.proportional * gains.tracking / (resistance * bandwidth * period), 1.0, 1e-3);
}

// Under a plain zero-order hold without the half tick of delay the closed loop has the one pole e^(-w T).
TEST(CurrentLoopGains, PlaceThePoleExactlyHoweverFastTheWinding) {
  for (const double inductance : {1e-1, 1e-3, 1e-4, 1e-5, 1e-6, 0.0}) {
    const double resistance = 2.0;
    const double bandwidth = 2.0 * std::numbers::pi * 1000.0;
    const auto gains = CurrentLoopGains<double>::prepare(resistance, inductance, bandwidth, period);
    const double kept = inductance > 0.0 ? std::exp(-resistance * period / inductance) : 0.0;
    double current = 0.0;
    double drop = 0.0;
    for (int k = 0; k < 50; ++k) {
      ASSERT_NEAR(current, 1.0 - std::exp(-bandwidth * period * k), 1e-9) << inductance << " tick " << k;
      const double voltage = gains.proportional * (1.0 - current) + drop;
      drop += gains.tracking * (voltage - drop);
      current = kept * current + (1.0 - kept) * voltage / resistance;
    }
  }
}

TEST(CurrentLoopGains, AWindingWithoutResistanceHasAProportionalGainOnly) {
  const auto gains = CurrentLoopGains<double>::prepare(0.0, 1e-3, 1000.0, period);
  EXPECT_NEAR(gains.proportional, 1e-3 / period * -std::expm1(-1000.0 * period), 1e-12);
  EXPECT_EQ(gains.tracking, 0.0);
  const auto nothing = CurrentLoopGains<double>::prepare(0.0, 0.0, 1000.0, period);
  EXPECT_EQ(nothing.proportional, 0.0);
}

TEST(CurrentLoopGains, BandwidthsAboveTheCeilingAreTakenAsTheCeiling) {
  EXPECT_NEAR(current_bandwidth_ceiling(period) / (2.0 * std::numbers::pi), 2500.0, 1e-9);
  const auto highest =
      CurrentLoopGains<double>::prepare(1.0, 1e-3, current_bandwidth_ceiling(period), period);
  for (const double bandwidth : {2e4, 1e9, std::numeric_limits<double>::infinity(), std::nan("")}) {
    const auto gains = CurrentLoopGains<double>::prepare(1.0, 1e-3, bandwidth, period);
    EXPECT_EQ(gains.proportional, highest.proportional) << bandwidth;
  }
}

TEST(CurrentLoopGains, FloatFollowsDouble) {
  for (const double inductance : {1.0, 1e-3, 1e-5}) {
    for (const double resistance : {1e-6, 0.1, 10.0}) {
      const auto wide = CurrentLoopGains<double>::prepare(resistance, inductance, 6000.0, period);
      const auto narrow = CurrentLoopGains<float>::prepare(static_cast<float>(resistance),
                                                           static_cast<float>(inductance), 6000.0F, 5e-5F);
      EXPECT_NEAR(static_cast<double>(narrow.proportional) / wide.proportional, 1.0, 2e-6);
      EXPECT_NEAR(static_cast<double>(narrow.tracking) / wide.tracking, 1.0, 2e-6);
    }
  }
}

}  // namespace
}  // namespace kmax::control
