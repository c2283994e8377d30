#include "firmware/drive/excitation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware::excitation_test {
namespace {

constexpr double turn = 6.283185307179586;
constexpr double tick = 5e-5;

ExcitationConfig of_kind(ExcitationKind kind) {
  ExcitationConfig config = excitation_configuration({}, 0);
  config.count_length = 1e-6;
  config.kind = kind;
  config.bias = 2.0f;
  config.ramp = 0.0f;
  return config;
}

double radians(control::TurnFraction angle) {
  return static_cast<double>(static_cast<std::int32_t>(angle)) * turn / 4294967296.0;
}

class ExcitationTest : public testing::Test {
 protected:
  Excitation::Output update(const ExcitationConfig& config, std::int64_t position = 0,
                            float velocity = 0.0f) {
    return excitation.update(started(config), position, velocity);
  }
  /// Run 0 was the one before: every configuration here is another.
  static Excitation::Coefficients started(ExcitationConfig config) {
    ++config.run;
    return Excitation::prepare(config);
  }
  /// As if the axis had been disarmed, with another run.
  void start_over() { excitation.stand_by(Excitation::Coefficients{}); }
  Excitation excitation;
};

// Of excitation.kind and excitation.alternation_axis.
TEST_F(ExcitationTest, NumbersOfTheKindsStay) {
  using enum ExcitationKind;
  int number = 0;
  for (const ExcitationKind kind : {off, voltage, current, torque, position})
    EXPECT_EQ(static_cast<int>(kind), number++);
  EXPECT_EQ(static_cast<int>(AlternationAxis::along), 0);
  EXPECT_EQ(static_cast<int>(AlternationAxis::across), 1);
}

TEST_F(ExcitationTest, SquareWaveOfHalfPeriodOneTickChangesInEveryTick) {
  auto config = of_kind(ExcitationKind::voltage);
  config.alternation = 0.5f;
  config.half_period = 1;
  for (int i = 0; i < 1000; ++i) {
    const auto out = update(config);
    ASSERT_EQ(out.along, i % 2 == 0 ? 2.5f : 1.5f) << i;
    ASSERT_EQ(out.across, 0.0f) << i;
    ASSERT_TRUE(out.alternating);
  }
}

TEST_F(ExcitationTest, SquareWaveKeepsItsHalfPeriodAndIsAsLongPositiveAsNegative) {
  auto config = of_kind(ExcitationKind::current);
  config.bias = 0.0f;
  config.alternation = -3.0f;
  config.half_period = 7;
  double sum = 0.0;
  for (int i = 0; i < 14 * 50; ++i) {
    const auto out = update(config);
    ASSERT_EQ(out.along, i / 7 % 2 == 0 ? -3.0f : 3.0f) << i;
    sum += static_cast<double>(out.along);
  }
  EXPECT_EQ(sum, 0.0);
}

TEST_F(ExcitationTest, AShorterHalfPeriodTakesEffectAtOnceAndNoneEndsTheWave) {
  auto config = of_kind(ExcitationKind::voltage);
  config.alternation = 1.0f;
  config.half_period = 1000;
  for (int i = 0; i < 100; ++i) ASSERT_EQ(update(config).along, 3.0f);
  config.half_period = 10;
  ASSERT_EQ(update(config).along, 1.0f);
  config.half_period = 0;
  const auto out = update(config);
  EXPECT_EQ(out.along, 2.0f);
  EXPECT_FALSE(out.alternating);
}

TEST_F(ExcitationTest, AlternationAcrossLeavesTheBiasAlone) {
  auto config = of_kind(ExcitationKind::current);
  config.alternation = 0.5f;
  config.half_period = 2;
  config.alternation_axis = AlternationAxis::across;
  for (int i = 0; i < 20; ++i) {
    const auto out = update(config);
    ASSERT_EQ(out.along, 2.0f);
    ASSERT_EQ(out.across, i / 2 % 2 == 0 ? 0.5f : -0.5f);
  }
}

TEST_F(ExcitationTest, RampBringsBothUpOverItsTimeAndNotPastIt) {
  auto config = of_kind(ExcitationKind::voltage);
  config.ramp = 0.01f;  // 200 ticks
  config.alternation = 1.0f;
  config.half_period = 1;
  float last = 0.0f;
  for (int i = 0; i < 400; ++i) {
    const auto out = update(config);
    const float factor = i < 200 ? static_cast<float>(i) / 200.0f : 1.0f;
    ASSERT_NEAR(out.along, factor * (i % 2 == 0 ? 3.0f : 1.0f), 1e-5f) << i;
    if (i == 0) {
      ASSERT_EQ(out.along, 0.0f);
    }
    ASSERT_LE(out.along, 3.0f);
    if (i % 2 == 0) {
      ASSERT_GE(out.along, last);
      last = out.along;
    }
  }
}

TEST_F(ExcitationTest, TurnsAtItsRateToTheSpanExactlyThenStands) {
  for (const double rate : {300.0, -300.0, 10'000.0, -0.5}) {
    auto config = of_kind(ExcitationKind::voltage);
    config.angle = 1.0f;
    config.angle_rate = static_cast<float>(rate);
    config.angle_span = 0.25f;
    config.duration = 60.0f;
    start_over();
    const double end = 1.0 + (rate > 0 ? 0.25 : -0.25);
    bool stood = false;
    for (int i = 0; i < 12'000; ++i) {
      const auto out = update(config);
      const double expected = 1.0 + rate * tick * i;
      if (std::abs(rate) * tick * i < 0.25) {
        ASSERT_NEAR(radians(out.angle), expected, 1e-5) << rate << " " << i;
        ASSERT_NEAR(static_cast<double>(out.electrical_speed), rate, 1e-4 * std::abs(rate));
      } else if (std::abs(rate) * tick * (i - 1) > 0.25 + 1e-5) {
        // Not past it by a fraction: what counts is where the vector stands.
        ASSERT_NEAR(radians(out.angle), end, 1e-8 + 6e-8) << rate << " " << i;
        ASSERT_EQ(out.electrical_speed, 0.0f);
        stood = true;
      }
    }
    EXPECT_TRUE(stood) << rate;
  }
}

// Wide spans and long runs: a turn more or less, or a drift, would show in where it ends.
TEST_F(ExcitationTest, ManyTurnsEndWhereTheyShould) {
  auto config = of_kind(ExcitationKind::current);
  config.angle_rate = -9000.0f;
  config.angle_span = 10'000.0f;
  config.duration = 60.0f;
  const auto c = started(config);
  Excitation::Output out;
  for (int i = 0; i < 30'000; ++i) out = excitation.update(c, 0, 0.0f);
  EXPECT_EQ(out.electrical_speed, 0.0f);
  const double expected = -10'000.0 - std::round(-10'000.0 / turn) * turn;
  EXPECT_NEAR(radians(out.angle), expected, 1e-5);
}

TEST_F(ExcitationTest, RateBeyondHalfATurnPerTickIsTakenAsThat) {
  auto config = of_kind(ExcitationKind::voltage);
  config.angle_rate = 1e9f;
  config.angle_span = 1e9f;
  EXPECT_EQ(Excitation::prepare(config).angle_step, INT32_MAX);
  config.angle_rate = -1e9f;
  EXPECT_EQ(Excitation::prepare(config).angle_step, -INT32_MAX);
}

TEST_F(ExcitationTest, SpanZeroNeverTurns) {
  auto config = of_kind(ExcitationKind::voltage);
  config.angle = -0.7f;
  config.angle_rate = 100.0f;
  config.angle_span = 0.0f;
  for (int i = 0; i < 100; ++i) {
    const auto out = update(config);
    ASSERT_NEAR(radians(out.angle), -0.7, 1e-7);
    ASSERT_EQ(out.electrical_speed, 0.0f);
  }
}

TEST_F(ExcitationTest, TurnsOnFromWhereItStandsWhenTheRateChanges) {
  auto config = of_kind(ExcitationKind::voltage);
  config.angle_rate = 200.0f;
  config.angle_span = 2.0f;
  for (int i = 0; i < 100; ++i) update(config);  // has turned by 1 rad
  config.angle_rate = -200.0f;
  EXPECT_NEAR(radians(update(config).angle), 1.0, 1e-5);
  EXPECT_NEAR(radians(update(config).angle), 0.99, 1e-5);
  config.angle_span = 0.5f;  // already beyond: it stays
  config.angle_rate = 200.0f;
  const double stands = radians(update(config).angle);
  for (int i = 0; i < 10; ++i) EXPECT_NEAR(radians(update(config).angle), stands, 1e-9);
}

TEST_F(ExcitationTest, DurationZeroExcitesNothing) {
  auto config = of_kind(ExcitationKind::voltage);
  config.duration = 0.0f;
  const auto first = update(config);
  EXPECT_TRUE(first.started);
  EXPECT_TRUE(first.finished);
  EXPECT_EQ(first.along, 0.0f);
  EXPECT_FALSE(update(config).started);
}

TEST_F(ExcitationTest, LastsForItsDurationToTheTickAndStaysFinished) {
  auto config = of_kind(ExcitationKind::voltage);
  config.duration = 0.005f;  // 100 ticks
  config.alternation = 1.0f;
  config.half_period = 1;
  for (int i = 0; i < 100; ++i) {
    const auto out = update(config);
    ASSERT_NE(out.along, 0.0f) << i;
    ASSERT_FALSE(out.finished) << i;
    ASSERT_EQ(out.started, i == 0);
  }
  for (int i = 0; i < 100; ++i) {
    if (i == 50) config.duration = 10.0f;  // too late
    const auto out = update(config);
    ASSERT_EQ(out.along, 0.0f) << i;
    ASSERT_EQ(out.across, 0.0f) << i;
    ASSERT_TRUE(out.finished) << i;
  }
}

TEST_F(ExcitationTest, OffAsksForNothingAndIsFinished) {
  auto config = of_kind(ExcitationKind::off);
  for (int i = 0; i < 10; ++i) {
    const auto out = update(config, 1000 * i, 0.5f);
    ASSERT_TRUE(out.finished);
    ASSERT_FALSE(out.started);
    ASSERT_EQ(out.along, 0.0f);
    ASSERT_EQ(out.force, 0.0f);
  }
}

TEST_F(ExcitationTest, WhatIsNotANumberOrHasNoMeaningExcitesNothingAndAllowsNoTravel) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  using Field = float ExcitationConfig::*;
  const std::vector<Field> fields = {
      &ExcitationConfig::bias,        &ExcitationConfig::alternation, &ExcitationConfig::angle,
      &ExcitationConfig::angle_rate,  &ExcitationConfig::angle_span,  &ExcitationConfig::ramp,
      &ExcitationConfig::duration,    &ExcitationConfig::travel,      &ExcitationConfig::stiffness,
      &ExcitationConfig::damping,     &ExcitationConfig::speed,       &ExcitationConfig::stroke,
      &ExcitationConfig::force_limit, &ExcitationConfig::tick_rate};
  for (const ExcitationKind kind : {ExcitationKind::voltage, ExcitationKind::position}) {
    for (const Field field : fields) {
      for (const float bad : {nan, infinity, -infinity, 0.0f}) {
        if (bad == 0.0f && field != &ExcitationConfig::tick_rate) continue;
        auto config = of_kind(kind);
        config.half_period = 3;
        config.stroke = 0.1f;
        config.*field = bad;
        const auto c = started(config);
        EXPECT_EQ(c.kind, ExcitationKind::off);
        EXPECT_EQ(c.travel_counts, 0u);
        Excitation fresh;
        for (int i = 0; i < 5; ++i) {
          const auto out = fresh.update(c, i * 100, 0.0f);
          ASSERT_EQ(out.along, 0.0f);
          ASSERT_EQ(out.force, 0.0f);
          ASSERT_TRUE(out.finished);
        }
      }
    }
  }
  for (const Field field : {&ExcitationConfig::duration, &ExcitationConfig::travel, &ExcitationConfig::ramp,
                            &ExcitationConfig::stiffness, &ExcitationConfig::damping}) {
    auto config = of_kind(ExcitationKind::voltage);
    config.*field = -1.0f;
    EXPECT_EQ(Excitation::prepare(config).kind, ExcitationKind::off);
  }
  auto config = of_kind(ExcitationKind::voltage);
  config.count_length = 0.0;
  EXPECT_EQ(Excitation::prepare(config).kind, ExcitationKind::off);
}

TEST_F(ExcitationTest, ExtremesOfTheParametersStayInRange) {
  auto config = of_kind(ExcitationKind::position);
  config.duration = std::numeric_limits<float>::max();
  config.ramp = config.travel = config.speed = config.angle_span = std::numeric_limits<float>::max();
  config.stroke = -std::numeric_limits<float>::max();
  config.angle = std::numeric_limits<float>::max();
  const auto c = started(config);
  EXPECT_EQ(c.duration, UINT32_MAX);
  EXPECT_EQ(c.travel_counts, UINT32_MAX);
  for (const std::int64_t position : {std::int64_t{0}, INT64_MAX / 2, INT64_MIN / 2}) {
    const auto out = excitation.update(c, position, 0.0f);
    EXPECT_LE(std::abs(out.force), config.force_limit);
  }
}

TEST_F(ExcitationTest, TravelIsWholeCounts) {
  auto config = of_kind(ExcitationKind::voltage);
  config.travel = 0.001f;
  config.count_length = 1e-6;
  EXPECT_EQ(Excitation::prepare(config).travel_counts, 1000u);
  config.travel = 0.0f;
  EXPECT_EQ(Excitation::prepare(config).travel_counts, 0u);
  config.travel = 1e-7f;
  EXPECT_EQ(Excitation::prepare(config).travel_counts, 0u);
}

TEST_F(ExcitationTest, PointMovesAtItsSpeedBothWaysAndStopsAtTheStroke) {
  for (const double stroke : {0.004, -0.004}) {
    auto config = of_kind(ExcitationKind::position);
    config.count_length = 1.6e-5;
    config.stiffness = 100.0f;
    config.damping = 2.0f;
    config.speed = 0.02f;
    config.stroke = static_cast<float>(stroke);
    config.duration = 10.0f;
    config.force_limit = 10.0f;
    Excitation fresh;
    const auto c = started(config);
    const double sign = stroke > 0 ? 1.0 : -1.0;
    for (int i = 0; i < 6000; ++i) {
      // The handle stands where it is: the force is what the point has gone.
      const auto out = fresh.update(c, 123'456'789'012, 0.0f);
      const double gone = std::min(0.02 * tick * i, 0.004);
      const double point_speed = 0.02 * tick * i < 0.004 ? 0.02 : 0.0;
      // Ticks in which the point arrives may be one off.
      if (std::abs(0.02 * tick * i - 0.004) > 2e-6) {
        ASSERT_NEAR(static_cast<double>(out.force), sign * (100.0 * gone + 2.0 * point_speed), 1e-5) << i;
      }
    }
  }
}

TEST_F(ExcitationTest, SpringAndDamperPullTheHandleToThePoint) {
  auto config = of_kind(ExcitationKind::position);
  config.count_length = 1e-5;
  config.stiffness = 100.0f;
  config.damping = 2.0f;
  update(config, 1000);
  EXPECT_NEAR(update(config, 1100).force, -0.1f, 1e-6f);
  EXPECT_NEAR(update(config, 900).force, 0.1f, 1e-6f);
  EXPECT_NEAR(update(config, 1000, 0.05f).force, -0.1f, 1e-6f);
}

TEST_F(ExcitationTest, ForceIsLimitedHoweverFarTheHandleIs) {
  auto config = of_kind(ExcitationKind::position);
  config.force_limit = 1.5f;
  update(config, 0);
  EXPECT_EQ(update(config, 10'000'000).force, -1.5f);
  EXPECT_EQ(update(config, -(std::int64_t{1} << 40)).force, 1.5f);
  EXPECT_EQ(update(config, 0, 100.0f).force, -1.5f);
}

TEST_F(ExcitationTest, AVelocityThatIsNotANumberIsHandedOn) {
  auto config = of_kind(ExcitationKind::position);
  EXPECT_TRUE(std::isnan(update(config, 0, std::numeric_limits<float>::quiet_NaN()).force));
}

TEST_F(ExcitationTest, ANewStrokeIsApproachedFromWhereThePointIs) {
  auto config = of_kind(ExcitationKind::position);
  config.stiffness = 1000.0f;
  config.damping = 0.0f;
  config.speed = 0.02f;  // 1 um per tick
  config.stroke = 0.001f;
  for (int i = 0; i < 101; ++i) update(config);
  config.stroke = -0.001f;
  EXPECT_NEAR(update(config).force, 0.101f, 1e-5f);
  EXPECT_NEAR(update(config).force, 0.100f, 1e-5f);
}

// What starts an excitation.

// Only another run starts, and not one that came while it stood by.
TEST_F(ExcitationTest, StandingByStartsNothing) {
  auto config = of_kind(ExcitationKind::voltage);
  config.duration = 0.0005f;  // 10 ticks
  EXPECT_TRUE(excitation.update(Excitation::prepare(config), 0, 0.0f).finished) << "never stood by, run 0";
  for (int i = 0; i < 20; ++i) update(config);
  EXPECT_TRUE(update(config).finished);
  ++config.run;
  EXPECT_EQ(update(config).along, 2.0f);
  for (const bool another : {false, true}) {
    if (another) ++config.run;
    excitation.stand_by(started(config));
    for (int i = 0; i < 20; ++i) {
      const auto out = update(config);
      ASSERT_FALSE(out.started);
      ASSERT_TRUE(out.finished);
      ASSERT_EQ(out.along, 0.0f);
      ASSERT_EQ(out.angle, 0u);
    }
  }
  --config.run;
  const auto out = update(config);
  EXPECT_TRUE(out.started) << "any other number";
  EXPECT_EQ(out.along, 2.0f);
}

TEST_F(ExcitationTest, AnotherKindEndsTheRunSinceItsUnitIsAnother) {
  auto config = of_kind(ExcitationKind::voltage);
  for (int i = 0; i < 500; ++i) ASSERT_EQ(update(config).along, 2.0f);
  for (const ExcitationKind kind : {ExcitationKind::current, ExcitationKind::voltage}) {
    config.kind = kind;
    for (int i = 0; i < 10; ++i) {
      const auto out = update(config);
      ASSERT_FALSE(out.started);
      ASSERT_TRUE(out.finished);
      ASSERT_EQ(out.along, 0.0f) << "also when it is the first kind again";
    }
  }
  ++config.run;
  EXPECT_EQ(update(config).along, 2.0f);
}

TEST_F(ExcitationTest, AnotherRunStartsAnewInMidRamp) {
  auto config = of_kind(ExcitationKind::voltage);
  config.ramp = 0.01f;
  config.angle_rate = 100.0f;
  config.angle_span = 1.0f;
  config.alternation = 1.0f;
  config.half_period = 30;
  for (int i = 0; i < 140; ++i) update(config);
  config.run = 65'535;
  auto out = update(config);
  EXPECT_TRUE(out.started);
  EXPECT_EQ(out.along, 0.0f);
  EXPECT_EQ(out.angle, 0u);
  out = update(config);
  EXPECT_FALSE(out.started);
  EXPECT_NEAR(out.along, 3.0f / 200.0f, 1e-6f) << "the square wave begins with its positive half again";
}

}  // namespace
}  // namespace kmax::firmware::excitation_test
