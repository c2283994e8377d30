#include "firmware/motor_control.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::firmware {
namespace {

constexpr double turn = 6.283185307179586;

MotorControlConfig dc() {
  MotorControlConfig config;
  config.transmission = 0.01f;
  config.torque_constant = 0.03f;
  return config;
}

MotorControlConfig pmsm() {
  MotorControlConfig config = dc();
  config.kind = MotorKind::pmsm;
  config.resistance = 0.6f;
  config.inductance = 3e-4f;
  config.torque_constant = 0.05f;
  return config;
}

MotorControl::Measured measured(float b, float c, float supply = 24.0f) {
  return {true, supply, b, c};
}

MotorControl::Output update(MotorControl& motor, const MotorControl::Coefficients& c,
                            const MotorControl::Measured& now, float force, std::uint32_t position,
                            float velocity, bool driving) {
  MotorControl::Output out;
  motor.update(c, now, force, position, velocity, driving, out);
  return out;
}

// Phase currents of a q current at an electrical angle (double, independent of the code under test).
MotorControl::Measured of_q_current(double q, double angle) {
  const double alpha = -q * std::sin(angle), beta = q * std::cos(angle);
  const double b = -0.5 * alpha + std::sqrt(3.0) / 2.0 * beta;
  return measured(static_cast<float>(b), static_cast<float>(-(alpha + b)));
}

TEST(MotorControl, WithoutMeasuredCurrentsOnlyTheReferenceIsMade) {
  MotorControl motor;
  const auto out = update(motor, MotorControl::prepare(dc()), {}, 3.0f, 0, 0.0f, true);
  EXPECT_FLOAT_EQ(out.current_reference, 1.0f);
  EXPECT_EQ(out.duty_a, 0.5f);
  EXPECT_EQ(out.duty_b, 0.5f);
  EXPECT_EQ(out.fault, Fault::none);
}

TEST(MotorControl, ReferenceIsBoundedAndSaysSo) {
  MotorControl motor;
  const auto out = update(motor, MotorControl::prepare(dc()), {}, -30.0f, 0, 0.0f, true);
  EXPECT_FLOAT_EQ(out.current_reference, -5.0f);
  EXPECT_TRUE(out.saturated);
}

TEST(MotorControl, NotDrivingMakesNothingButTellsTheCurrent) {
  MotorControl motor;
  const auto out = update(motor, MotorControl::prepare(dc()), measured(0.4f, -0.6f), 3.0f, 0, 0.0f, false);
  EXPECT_EQ(out.current_reference, 0.0f);
  EXPECT_EQ(out.duty_b, 0.5f);
  EXPECT_FLOAT_EQ(out.current, 0.5f);
}

// Legs B and C carry a DC motor: more force along +x needs more current out of B.
TEST(MotorControl, DcDrivesItsTwoLegsApart) {
  MotorControl motor;
  const auto out = update(motor, MotorControl::prepare(dc()), measured(0.0f, 0.0f), 3.0f, 0, 0.0f, true);
  EXPECT_GT(out.duty_b, 0.5f);
  EXPECT_FLOAT_EQ(out.duty_b + out.duty_c, 1.0f);
  EXPECT_EQ(out.duty_a, 0.5f);
}

TEST(MotorControl, SynchronousMotorReadsItsTorqueCurrentAtEveryPosition) {
  MotorControlConfig config = pmsm();
  config.electrical_offset = -1.0f;
  const auto c = MotorControl::prepare(config);
  for (std::int32_t position = -20'000; position < 20'000; position += 37) {
    const double angle = 7.0 * turn * position / 8192.0 - 1.0;
    MotorControl motor;
    const auto out =
        update(motor, c, of_q_current(1.2, angle), 0.0f, static_cast<std::uint32_t>(position), 0.0f, true);
    ASSERT_NEAR(out.current, 1.2f, 2e-5f) << position;
  }
}

TEST(MotorControl, CountsThatDoNotDivideTheTurnKeepTheAngle) {
  MotorControlConfig config = pmsm();
  config.counts_per_turn = 10'000;
  const auto c = MotorControl::prepare(config);
  for (const std::int32_t position : {999'999, -1'000'000, 123'457}) {
    const double angle = std::fmod(7.0 * turn * position / 10'000.0, turn);
    MotorControl motor;
    const auto out =
        update(motor, c, of_q_current(1.0, angle), 0.0f, static_cast<std::uint32_t>(position), 0.0f, true);
    EXPECT_NEAR(out.current, 1.0f, 1e-3f) << position;
  }
}

TEST(MotorControl, AnOpenPhaseOfEitherMotorIsNamedInTheSampleThatShowsIt) {
  for (const bool synchronous : {false, true}) {
    const auto c = MotorControl::prepare(synchronous ? pmsm() : dc());
    // 2 A of reference in both motors; electrical angle 0.9 turns of nothing special.
    const float force = synchronous ? 10.0f : 6.0f;
    const std::uint32_t position = 1000;
    const double angle = 7.0 * turn * position / 8192.0;
    const auto flowing = synchronous ? of_q_current(2.0, angle) : measured(2.0f, -2.0f);
    MotorControl motor;
    for (int i = 0; i < 10; ++i)
      ASSERT_EQ(update(motor, c, flowing, force, position, 0.0f, true).fault, Fault::none) << synchronous;
    EXPECT_EQ(update(motor, c, measured(0.0f, 0.0f), force, position, 0.0f, true).fault, Fault::phase_open)
        << synchronous;
  }
}

TEST(MotorControl, OverCurrentCarriesItsNumber) {
  MotorControl motor;
  const auto out = update(motor, MotorControl::prepare(dc()), measured(-9.0f, 2.0f), 0.0f, 0, 0.0f, true);
  EXPECT_EQ(out.fault, Fault::over_current);
  EXPECT_FLOAT_EQ(out.fault_value, 9.0f);
}

TEST(MotorControl, WhatIsNotANumberIsAFaultAndNoVoltage) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const auto& config : {dc(), pmsm()}) {
    const auto c = MotorControl::prepare(config);
    MotorControl motor;
    EXPECT_NE(update(motor, c, measured(nan, 0.0f), 1.0f, 0, 0.0f, true).fault, Fault::none);
    motor = MotorControl();
    const auto dead_supply = update(motor, c, measured(0.0f, 0.0f, 0.0f), 1.0f, 0, 0.0f, true);
    EXPECT_EQ(dead_supply.fault, Fault::not_finite);
    EXPECT_EQ(dead_supply.duty_b, 0.5f);
    motor = MotorControl();
    EXPECT_EQ(update(motor, c, measured(0.0f, 0.0f), nan, 0, 0.0f, true).fault, Fault::not_finite);
  }
}

}  // namespace
}  // namespace kmax::firmware
