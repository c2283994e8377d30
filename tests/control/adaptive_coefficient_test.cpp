#include "control/adaptive_coefficient.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

namespace kmax::control::adaptive_coefficient_test {

using Config = AdaptiveCoefficientConfig<double>;
using Coefficient = AdaptiveCoefficient<double>;
constexpr double period = 0.002;

double at(const Config& config, double outward_velocity) {
  return Coefficient::at_velocity(Coefficient::prepare(config, period), outward_velocity);
}

Config literal() {
  Config config;
  config.force_min = 0;
  config.force_max = 1000;
  return config;
}

double any_velocity() {
  return *rc::gen::map(rc::gen::inRange(-500000, 500000), [](int n) { return n * 1e-5; });
}

TEST(AdaptiveCoefficient, EquationSevenIsVelocityPlusEightTenthsWithThePapersNumbers) {
  for (double speed : {0.0, 0.1, 1.0, 1.2, 2.0, 2.4}) EXPECT_NEAR(at(literal(), -speed), speed + 0.8, 1e-12);
}

TEST(AdaptiveCoefficient, DefaultsKeepThePapersBestInterval) {
  EXPECT_DOUBLE_EQ(at(Config{}, 0.0), 0.8);
  EXPECT_NEAR(at(Config{}, -1.2), 2.0, 1e-12) << "reached at 1.2 m/s";
  EXPECT_DOUBLE_EQ(at(Config{}, -1e300), 2.0);
  EXPECT_NEAR(at(literal(), -24.0), 3.2, 1e-12) << "the normalised velocity stops at one";
}

TEST(AdaptiveCoefficient, ApproachIgnoresMotionAwayAndSpeedDoesNot) {
  Config config = literal();
  EXPECT_DOUBLE_EQ(at(config, 1.0), 0.8);
  config.velocity = AdaptiveVelocity::speed;
  EXPECT_NEAR(at(config, 1.0), 1.8, 1e-12);
  EXPECT_NEAR(at(config, -1.0), 1.8, 1e-12);
}

RC_GTEST_PROP(AdaptiveCoefficient, RelationsAreTheirFormulas, ()) {
  Config config = literal();
  const double velocity = any_velocity();
  const double normalised = std::min(std::max(-velocity, 0.0) / 2.4, 1.0);
  config.relation = AdaptiveRelation::square;
  RC_ASSERT(std::abs(at(config, velocity) - (2.4 * normalised * normalised + 0.8)) < 1e-12);
  config.relation = AdaptiveRelation::square_root;
  RC_ASSERT(std::abs(at(config, velocity) - (2.4 * std::sqrt(normalised) + 0.8)) < 1e-12);
}

RC_GTEST_PROP(AdaptiveCoefficient, NeverLeavesItsInterval, ()) {
  Config config;
  config.force_min = *rc::gen::map(rc::gen::inRange(0, 1000), [](int n) { return n * 0.01; });
  config.force_max =
      config.force_min + *rc::gen::map(rc::gen::inRange(0, 1000), [](int n) { return n * 0.01; });
  config.mode = *rc::gen::element(AdaptiveMode::instant, AdaptiveMode::latched, AdaptiveMode::peak_hold);
  config.relation =
      *rc::gen::element(AdaptiveRelation::linear, AdaptiveRelation::square, AdaptiveRelation::square_root);
  config.velocity = *rc::gen::element(AdaptiveVelocity::approach, AdaptiveVelocity::speed);
  Coefficient coefficient;
  const auto c = Coefficient::prepare(config, period);
  for (int i = 0; i < 20; ++i) {
    const double force = coefficient.update(c, any_velocity(), *rc::gen::arbitrary<bool>());
    RC_ASSERT(force >= config.force_min);
    RC_ASSERT(force <= config.force_max);
  }
}

RC_GTEST_PROP(AdaptiveCoefficient, FasterApproachNeverGivesLess, ()) {
  Config config;
  config.relation =
      *rc::gen::element(AdaptiveRelation::linear, AdaptiveRelation::square, AdaptiveRelation::square_root);
  const double slow = -std::abs(any_velocity());
  const double fast = slow - std::abs(any_velocity());
  RC_ASSERT(at(config, fast) >= at(config, slow));
}

TEST(AdaptiveCoefficient, InstantForgetsAtOnce) {
  Config config;
  Coefficient coefficient;
  const auto c = Coefficient::prepare(config, period);
  EXPECT_NEAR(coefficient.update(c, -1.0, false), 1.8, 1e-12);
  EXPECT_NEAR(coefficient.update(c, 0.0, true), 0.8, 1e-12);
}

TEST(AdaptiveCoefficient, LatchedKeepsTheValueOfTheContactUntilTheWallIsLeft) {
  Config config;
  config.mode = AdaptiveMode::latched;
  Coefficient coefficient;
  const auto c = Coefficient::prepare(config, period);
  EXPECT_NEAR(coefficient.update(c, -1.0, false), 1.8, 1e-12) << "outside: at once";
  EXPECT_NEAR(coefficient.update(c, -0.5, true), 1.3, 1e-12) << "contact";
  for (int i = 0; i < 1000; ++i)
    ASSERT_NEAR(coefficient.update(c, i % 2 == 0 ? -2.0 : 0.5, true), 1.3, 1e-12);
  EXPECT_NEAR(coefficient.update(c, 0.0, false), 0.8, 1e-12) << "left";
  EXPECT_NEAR(coefficient.update(c, -0.2, true), 1.0, 1e-12) << "next contact";
}

TEST(AdaptiveCoefficient, PeakHoldDecaysWithItsTimeConstant) {
  Config config;
  config.mode = AdaptiveMode::peak_hold;
  for (const double rate : {500.0, 20000.0}) {
    Coefficient coefficient;
    const auto c = Coefficient::prepare(config, 1 / rate);
    EXPECT_NEAR(coefficient.update(c, -1.0, false), 1.8, 1e-12);
    double force = 0;
    for (int i = 0; i < static_cast<int>(1.2 * rate + 0.5); ++i) force = coefficient.update(c, 0.0, true);
    // After one time constant 1/e of the 1 N excess is left; backward Euler at T = 2 ms is 0.0003 off.
    EXPECT_NEAR(force, 0.8 + std::exp(-1.0), 1e-3);
    EXPECT_NEAR(coefficient.update(c, -1.0, true), 1.8, 1e-12) << "a new peak counts at once";
  }
}

TEST(AdaptiveCoefficient, PeakHoldNeverStallsShortOfItsRestInFloat) {
  // Kept as an absolute force, a float would stop decaying 3 mN above its rest at 20 kHz.
  AdaptiveCoefficientConfig<float> config;
  config.mode = AdaptiveMode::peak_hold;
  AdaptiveCoefficient<float> coefficient;
  const auto c = AdaptiveCoefficient<float>::prepare(config, 5e-5f);
  coefficient.update(c, -1.0f, true);
  float force = 0;
  for (int i = 0; i < 20000 * 30; ++i) force = coefficient.update(c, 0.0f, true);
  EXPECT_EQ(force, 0.8f);
}

// The stability guard judges a wall by `most`: an ulp above it is above what was judged.
TEST(AdaptiveCoefficient, NoModeGivesMoreThanAtTheTopSpeedNotByRoundingEither) {
  AdaptiveCoefficientConfig<float> config{
      .gain = 1.46f, .offset = 0.363f, .force_min = 0.756f, .force_max = 5.19242f};
  for (const AdaptiveMode mode : {AdaptiveMode::instant, AdaptiveMode::latched, AdaptiveMode::peak_hold}) {
    config.mode = mode;
    int reached = 0;
    for (int i = 0; i < 1000; ++i) {
      config.gain = 1.0f + static_cast<float>(i) * 1.3e-3f;
      AdaptiveCoefficient<float> coefficient;
      const auto c = AdaptiveCoefficient<float>::prepare(config, 0.001f);
      const float force = coefficient.update(c, -2.0f * config.velocity_max, true);
      ASSERT_LE(force, c.most) << config.gain;
      if (force == c.most) ++reached;
    }
    EXPECT_GT(reached, 500);
  }
}

TEST(AdaptiveCoefficient, AResetForgetsContactAndPeak) {
  for (const AdaptiveMode mode : {AdaptiveMode::latched, AdaptiveMode::peak_hold}) {
    Config config;
    config.mode = mode;
    Coefficient coefficient;
    const auto c = Coefficient::prepare(config, period);
    EXPECT_NEAR(coefficient.update(c, -1.0, true), 1.8, 1e-12);
    coefficient.reset();
    EXPECT_NEAR(coefficient.update(c, -0.1, true), 0.9, 1e-12) << "a contact of its own";
  }
}

// A bound that has been lowered holds for what was latched before.
TEST(AdaptiveCoefficient, ALatchedValueKeepsWithinNewBounds) {
  Config config;
  config.mode = AdaptiveMode::latched;
  Coefficient coefficient;
  EXPECT_NEAR(coefficient.update(Coefficient::prepare(config, period), -1.0, true), 1.8, 1e-12);
  config.force_max = 1.5;
  EXPECT_EQ(coefficient.update(Coefficient::prepare(config, period), -1.0, true), 1.5);
  config.force_max = 3.0;
  config.force_min = 2.5;
  EXPECT_EQ(coefficient.update(Coefficient::prepare(config, period), -1.0, true), 2.5);
}

TEST(AdaptiveCoefficient, ZeroHoldTimeIsInstant) {
  Config config;
  config.mode = AdaptiveMode::peak_hold;
  config.hold_time = 0;
  Coefficient coefficient;
  const auto c = Coefficient::prepare(config, period);
  coefficient.update(c, -1.0, true);
  EXPECT_NEAR(coefficient.update(c, 0.0, true), 0.8, 1e-12);
}

TEST(AdaptiveCoefficient, ANotANumberDoesNotPoisonTheMemory) {
  for (const AdaptiveMode mode : {AdaptiveMode::instant, AdaptiveMode::peak_hold}) {
    Config config;
    config.mode = mode;
    Coefficient coefficient;
    const auto c = Coefficient::prepare(config, period);
    coefficient.update(c, std::nan(""), false);
    EXPECT_NEAR(coefficient.update(c, 0.0, false), 0.8, 1e-12);
  }
}

}  // namespace kmax::control::adaptive_coefficient_test
