#include "control/current_loop_gains.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace kmax::control::current_loop_gains_test {

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

TEST(CurrentLoopGains, OneMinusCosineAndTheSquareRootAreExactToTheLastPlaces) {
  for (double x = 1e-9; x <= 1.0; x *= 1.31) {
    const double half = std::sin(x / 2);
    EXPECT_NEAR(one_minus_cosine(x) / (2 * half * half), 1.0, 1e-15) << x;
    EXPECT_NEAR(static_cast<double>(one_minus_cosine(static_cast<float>(x))) / (2 * half * half), 1.0, 5e-7)
        << x;
  }
  EXPECT_EQ(one_minus_cosine(0.0), 0.0);
  for (double x = 1e-30; x < 1e30; x *= 7.3) {
    EXPECT_NEAR(square_root_by_iteration(x) / std::sqrt(x), 1.0, 1e-15) << x;
  }
  EXPECT_EQ(square_root_by_iteration(0.0), 0.0);
  EXPECT_EQ(square_root_by_iteration(-1.0), 0.0);
  EXPECT_EQ(square_root_by_iteration(std::nan("")), 0.0);
  static_assert(square_root_by_iteration(4.0F) == 2.0F);
}

// The closed loop's gain from the transfer function itself: sqrt(1/2) at the request, more below, less above.
TEST(CurrentLoopGains, TheGainFallsThroughThreeDecibelsWhereItWasAskedTo) {
  for (double h = 0.0; h <= 1.0; h += 0.05) {
    for (double angle = 0.001; angle <= 0.786; angle *= 1.2) {
      const double g = CurrentLoopGains<double>::loop_gain(angle, h);
      const auto gain = [&](double at) {
        const std::complex<double> z = std::polar(1.0, at);
        const auto open = g / (1 + h) * (z + h) / (z * (z - 1.0));
        return std::abs(open / (1.0 + open));
      };
      EXPECT_NEAR(gain(angle), std::sqrt(0.5), 1e-9) << h << " " << angle;
      for (double share = 0.1; share < 0.99; share += 0.1) {
        EXPECT_GT(gain(share * angle), std::sqrt(0.5)) << h << " " << angle << " at " << share;
        EXPECT_LT(gain(share * angle), 1.03) << h << " " << angle << " at " << share;
      }
      for (double at = 1.01 * angle; at < 3.1; at += 0.1) {
        EXPECT_LT(gain(at), std::sqrt(0.5)) << h << " " << angle << " at " << at;
      }
      EXPECT_NEAR(static_cast<double>(
                      CurrentLoopGains<float>::loop_gain(static_cast<float>(angle), static_cast<float>(h))) /
                      g,
                  1.0, 2e-6);
    }
  }
}

TEST(CurrentLoopGains, AWindingWithoutResistanceHasAProportionalGainOnly) {
  const auto gains = CurrentLoopGains<double>::prepare(0.0, 1e-3, 1000.0, period);
  EXPECT_NEAR(gains.proportional, 1e-3 / period * CurrentLoopGains<double>::loop_gain(0.05, 1.0), 1e-12);
  const auto little = CurrentLoopGains<double>::prepare(1e-6, 1e-3, 1000.0, period);
  EXPECT_NEAR(little.proportional / gains.proportional, 1.0, 1e-6);
  EXPECT_EQ(gains.tracking, 0.0);
  const auto nothing = CurrentLoopGains<double>::prepare(0.0, 0.0, 1000.0, period);
  EXPECT_EQ(nothing.proportional, 0.0);
}

TEST(CurrentLoopGains, AreThoseOfTheWindingThatWasSampled) {
  for (const double resistance : {0.05, 0.7, 20.0}) {
    for (const double inductance : {1e-5, 1e-3, 0.1}) {
      for (const double bandwidth : {20.0, 1000.0, 9000.0}) {
        const double kept = std::exp(-resistance * period / (2.0 * inductance));
        const double tracking = -std::expm1(-resistance * period / inductance);
        const auto gains = CurrentLoopGains<double>::prepare(resistance, inductance, bandwidth, period);
        EXPECT_NEAR(gains.tracking / tracking, 1.0, 1e-12);
        const double gain = CurrentLoopGains<double>::loop_gain(bandwidth * period, kept);
        EXPECT_NEAR(gains.proportional / (resistance / tracking * gain), 1.0, 1e-12);
      }
    }
  }
  const auto resistor = CurrentLoopGains<double>::prepare(3.0, 0.0, 1000.0, period);
  EXPECT_EQ(resistor.tracking, 1.0);
  EXPECT_EQ(resistor.proportional, 3.0 * CurrentLoopGains<double>::loop_gain(0.05, 0.0));
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

}  // namespace kmax::control::current_loop_gains_test
