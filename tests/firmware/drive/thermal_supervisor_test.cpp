#include "firmware/drive/thermal_supervisor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::firmware::thermal_supervisor_test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

ThermalSupervisorConfig small_motor() {
  ThermalSupervisorConfig config;
  config.winding.resistance = 2.0f;
  config.winding.winding_capacity = 5.0f;
  config.winding.winding_to_case = 4.0f;
  return config;
}

/// Runs for `seconds` in steps of a millisecond from a clock that is about to wrap.
struct Clock {
  ThermalSupervisor supervisor;
  std::uint32_t now = 0xFFFF'F000u;
  void pass(float seconds, float mean_square, float stage = 25.0f) {
    for (int ms = 0; ms < static_cast<int>(seconds * 1000.0f + 0.5f); ++ms)
      supervisor.poll(now += 1000, mean_square, stage);
  }
};

TEST(ThermalSupervisor, BeginsAtAmbientWithTheWholeCurrent) {
  Clock run;
  ThermalSupervisorConfig config = small_motor();
  config.winding.ambient_temperature = 31.0f;
  run.supervisor.configure(config);
  EXPECT_EQ(run.supervisor.winding_temperature(), 31.0f);
  run.pass(1.0f, 0.0f);
  EXPECT_EQ(run.supervisor.winding_temperature(), 31.0f);
  EXPECT_EQ(run.supervisor.allowance(), 1.0f);
  EXPECT_FALSE(run.supervisor.motor_too_hot());
}

TEST(ThermalSupervisor, TheModelIsSteppedEveryTenMilliseconds) {
  ThermalSupervisor supervisor;
  supervisor.configure(small_motor());
  constexpr std::uint32_t start = 0xFFFF'F000u, step_us = 10'000;
  supervisor.poll(start, 100.0f, 25.0f);
  for (std::uint32_t step = 0; step < 3; ++step) {
    const float before = supervisor.winding_temperature();
    supervisor.poll(start + (step + 1) * step_us - 1, 100.0f, 25.0f);
    EXPECT_EQ(supervisor.winding_temperature(), before);
    supervisor.poll(start + (step + 1) * step_us, 100.0f, 25.0f);
    EXPECT_GT(supervisor.winding_temperature(), before);
  }
}

// Who follows them looks at them only then.
TEST(ThermalSupervisor, CountsTheChangesOfAllowanceAndResistance) {
  Clock run;
  run.supervisor.configure(small_motor());
  run.pass(0.1f, 0.0f);
  std::uint32_t counted = run.supervisor.changes();
  float allowance = run.supervisor.allowance(), resistance = run.supervisor.resistance_temperature();
  int of_allowance = 0, of_resistance = 0;
  for (int i = 0; i < 20'000 && !run.supervisor.motor_too_hot(); ++i) {
    run.pass(0.01f, 25.0f);
    const bool less = run.supervisor.allowance() != allowance;
    const bool warmer = run.supervisor.resistance_temperature() != resistance;
    ASSERT_EQ(run.supervisor.changes() != counted, less || warmer);
    counted = run.supervisor.changes();
    allowance = run.supervisor.allowance();
    resistance = run.supervisor.resistance_temperature();
    of_allowance += less ? 1 : 0;
    of_resistance += warmer ? 1 : 0;
  }
  EXPECT_EQ(of_allowance, ThermalSupervisor::steps);
  EXPECT_GT(of_resistance, 10);
}

TEST(ThermalSupervisor, AnotherAmbientTemperatureBeforeTheFirstStepIsAChange) {
  ThermalSupervisor supervisor;
  supervisor.configure(small_motor());
  const std::uint32_t before = supervisor.changes();
  ThermalSupervisorConfig warmer = small_motor();
  warmer.winding.ambient_temperature = 60.0f;
  supervisor.configure(warmer);
  EXPECT_EQ(supervisor.resistance_temperature(), 60.0f);
  EXPECT_NE(supervisor.changes(), before);
}

TEST(ThermalSupervisor, TheAllowanceFallsBeforeTheTripAndComesBack) {
  Clock run;
  run.supervisor.configure(small_motor());
  float before = 1.0f;
  float hottest_with_current = 0.0f;
  while (!run.supervisor.motor_too_hot()) {
    run.pass(0.1f, 25.0f);
    ASSERT_LE(run.supervisor.allowance(), before);
    before = run.supervisor.allowance();
    if (before > 0.0f) hottest_with_current = run.supervisor.winding_temperature();
    if (before < 1.0f && before > 0.0f) {
      ASSERT_GT(run.supervisor.winding_temperature(), 100.0f);
    }
    ASSERT_LT(run.supervisor.winding_temperature(), 125.0f);
  }
  EXPECT_EQ(run.supervisor.allowance(), 0.0f) << "no current is left where it trips";
  EXPECT_GT(hottest_with_current, 115.0f);
  run.pass(30.0f, 0.0f);
  EXPECT_FALSE(run.supervisor.motor_too_hot());
  EXPECT_EQ(run.supervisor.allowance(), 1.0f);
}

TEST(ThermalSupervisor, ACallAfterALongSilenceCountsTheWholeTime) {
  Clock fine, coarse;
  fine.supervisor.configure(small_motor());
  coarse.supervisor.configure(small_motor());
  fine.pass(20.0f, 4.0f);
  coarse.pass(0.001f, 4.0f);
  coarse.supervisor.poll(coarse.now += 19'999'000, 4.0f, 25.0f);
  EXPECT_NEAR(fine.supervisor.winding_temperature(), coarse.supervisor.winding_temperature(), 0.05f);
  EXPECT_GT(fine.supervisor.winding_temperature(), 30.0f);
}

TEST(ThermalSupervisor, TheHotterOfMotorAndPowerStageDecides) {
  Clock run;
  run.supervisor.configure(small_motor());
  run.pass(0.01f, 0.0f, 90.0f);
  EXPECT_EQ(run.supervisor.allowance(), 0.5f);
  EXPECT_FALSE(run.supervisor.power_stage_too_hot());
  run.pass(0.01f, 0.0f, 100.0f);
  EXPECT_EQ(run.supervisor.allowance(), 0.0f);
  EXPECT_FALSE(run.supervisor.power_stage_too_hot()) << "at the limit, not above";
  run.pass(0.01f, 0.0f, std::nextafter(100.0f, 101.0f));
  EXPECT_TRUE(run.supervisor.power_stage_too_hot());
}

TEST(ThermalSupervisor, WhatCannotBeMeasuredOrComputedIsTooHot) {
  Clock run;
  run.supervisor.configure(small_motor());
  run.pass(0.01f, 0.0f, nan);
  EXPECT_TRUE(run.supervisor.power_stage_too_hot());
  EXPECT_EQ(run.supervisor.allowance(), 0.0f);
  Clock current;
  current.supervisor.configure(small_motor());
  current.pass(0.05f, nan);
  EXPECT_TRUE(current.supervisor.motor_too_hot());
  EXPECT_EQ(current.supervisor.allowance(), 0.0f);
}

TEST(ThermalSupervisor, AMotorLimitOfZeroIsNotSupervised) {
  Clock run;
  ThermalSupervisorConfig config = small_motor();
  config.motor_limit = 0.0f;
  run.supervisor.configure(config);
  run.pass(100.0f, 100.0f);
  EXPECT_GT(run.supervisor.winding_temperature(), 150.0f);
  EXPECT_FALSE(run.supervisor.motor_too_hot());
  EXPECT_EQ(run.supervisor.allowance(), 1.0f);
}

TEST(ThermalSupervisor, NewValuesKeepTheTemperature) {
  Clock run;
  run.supervisor.configure(small_motor());
  run.pass(5.0f, 10.0f);
  const float warm = run.supervisor.winding_temperature();
  ASSERT_GT(warm, 35.0f);
  ThermalSupervisorConfig other = small_motor();
  other.winding.ambient_temperature = 0.0f;
  run.supervisor.configure(other);
  EXPECT_EQ(run.supervisor.winding_temperature(), warm);
}

// Every change of the allowance makes new settings for the tick.
TEST(ThermalSupervisor, NoiseDoesNotMakeTheAllowanceFlutter) {
  Clock clock;
  clock.supervisor.configure(small_motor());
  int changes = 0;
  float before = 1.0f;
  for (int i = 0; i < 2000; ++i) {
    clock.pass(0.01f, 0.0f, 85.0f + static_cast<float>((i * 7919) % 100 - 50) * 0.001f);
    changes += clock.supervisor.allowance() != before ? 1 : 0;
    before = clock.supervisor.allowance();
  }
  EXPECT_LE(changes, 2);
}

// 20 K below the limit in 32 steps: all of these temperatures are exact.
TEST(ThermalSupervisor, TheAllowanceFallsAtAWholeStepAndRisesHalfAStepLater) {
  const auto at = [](float steps) { return 100.0f - steps * 20.0f / 32.0f; };
  for (int step = 1; step < ThermalSupervisor::steps; ++step) {
    Clock clock;
    clock.supervisor.configure(small_motor());
    const auto steps_at = [&](float temperature) {
      clock.pass(0.01f, 0.0f, temperature);
      return clock.supervisor.allowance() * 32.0f;
    };
    const auto whole = static_cast<float>(step);
    EXPECT_EQ(steps_at(at(whole)), whole);
    EXPECT_EQ(steps_at(at(whole + 0.5f)), whole);
    EXPECT_EQ(steps_at(std::nextafter(at(whole + 0.5f), 0.0f)), whole + 1.0f);
    EXPECT_EQ(steps_at(std::nextafter(at(whole), 0.0f)), whole + 1.0f);
    EXPECT_EQ(steps_at(at(whole)), whole);
  }
}

TEST(ThermalSupervisor, SomeCurrentIsLeftBelowTheLimit) {
  Clock clock;
  clock.supervisor.configure(small_motor());
  clock.pass(0.02f, 0.0f, 99.9f);
  EXPECT_FALSE(clock.supervisor.power_stage_too_hot());
  EXPECT_GT(clock.supervisor.allowance(), 0.0f);
}

TEST(ThermalSupervisor, TheResistanceFollowsInSteps) {
  Clock clock;
  clock.supervisor.configure(small_motor());
  int changes = 0;
  float before = clock.supervisor.resistance_temperature();
  for (int i = 0; i < 500; ++i) {
    clock.pass(0.02f, 9.0f);
    changes += clock.supervisor.resistance_temperature() != before ? 1 : 0;
    before = clock.supervisor.resistance_temperature();
    ASSERT_LE(std::abs(clock.supervisor.winding_temperature() - before), 5.0f);
  }
  EXPECT_GT(changes, 2);
  EXPECT_LE(changes, 8);
}

}  // namespace
}  // namespace kmax::firmware::thermal_supervisor_test
