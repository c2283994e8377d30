#include "firmware/drive/motor_control.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace kmax::firmware::motor_control_test {
namespace {

constexpr double turn = 6.283185307179586;

MotorControlConfig dc() {
  MotorControlConfig config;
  config.modulation_limit = 0.88f;
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

std::uint32_t tick_number = 0;

MotorControl::Measured measured(float b, float c, float supply = 24.0f) {
  return {true, supply, b, c};
}

MotorControl::Output update(MotorControl& motor, const MotorControl::Coefficients& c,
                            const MotorControl::Measured& now, float force, std::uint32_t position,
                            float velocity, bool driving) {
  MotorControl::Output out;
  motor.update(c, now, force, position, velocity, driving, ++tick_number, out);
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
  EXPECT_EQ(out.electrical_angle, 0u);
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
  const auto out = update(motor, MotorControl::prepare(dc()), measured(0.4f, -0.85f), 3.0f, 0, 0.0f, false);
  EXPECT_EQ(out.current_reference, 0.0f);
  EXPECT_EQ(out.duty_b, 0.5f);
  EXPECT_FLOAT_EQ(out.current, 0.625f);
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
    ASSERT_NEAR(out.current, 1.2f, 5e-5f) << position;
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

// From whichever tick on it is open: within the patience, 5 / bandwidth, and two looks.
TEST(MotorControl, AnOpenPhaseOfEitherMotorIsNamedAfterThePatience) {
  for (const bool synchronous : {false, true}) {
    const auto c = MotorControl::prepare(synchronous ? pmsm() : dc());
    // 2 A of reference in both motors; electrical angle 0.9 turns of nothing special.
    const float force = synchronous ? 10.0f : 6.0f;
    const std::uint32_t position = 1000;
    const double angle = 7.0 * turn * position / 8192.0;
    const auto flowing = synchronous ? of_q_current(2.0, angle) : measured(2.0f, -2.0f);
    for (int before = 10; before < 14; ++before) {
      MotorControl motor;
      for (int i = 0; i < before; ++i)
        ASSERT_EQ(update(motor, c, flowing, force, position, 0.0f, true).fault, Fault::none) << synchronous;
      Fault found = Fault::none;
      int samples = 0;
      while (found == Fault::none && samples < 100) {
        found = update(motor, c, measured(0.0f, 0.0f), force, position, 0.0f, true).fault;
        ++samples;
      }
      EXPECT_EQ(found, Fault::phase_open) << synchronous;
      EXPECT_GT(samples, 33 - 4) << synchronous;
      EXPECT_LE(samples, 33 + 4) << synchronous << ": 1.85 ms";
    }
  }
}

TEST(MotorControl, AnOpenPhaseIsNamedOnlyBelowTheVelocityWhoseBackEmfTakesTheVoltage) {
  for (const bool synchronous : {false, true}) {
    const auto c = MotorControl::prepare(synchronous ? pmsm() : dc());
    for (const float velocity : {std::nextafter(c.slow_velocity, 0.0f), c.slow_velocity}) {
      MotorControl motor;
      Fault found = Fault::none;
      for (int sample = 0; found == Fault::none && sample < 100; ++sample)
        found =
            update(motor, c, measured(0.0f, 0.0f), synchronous ? 10.0f : 6.0f, 1000, velocity, true).fault;
      EXPECT_EQ(found, velocity < c.slow_velocity ? Fault::phase_open : Fault::none) << synchronous;
    }
  }
}

// A force that changes sides in step with the looks: its current goes through zero while all of it is asked
// for.
TEST(MotorControl, ACurrentThatAlternatesIsNoOpenPhaseWhereverItsZerosFall) {
  const auto c = MotorControl::prepare(dc());
  for (std::uint32_t zero = 0; zero < 4; ++zero) {
    MotorControl motor;
    MotorControl::Output out;
    for (std::uint32_t tick = 0; tick < 400; ++tick) {
      const float side = (tick - zero) / 4 % 2 == 0 ? 1.0f : -1.0f;
      const float current = tick % 4 == zero ? 0.0f : 2.0f * side;
      motor.update(c, measured(current, -current), 6.0f * side, 0, 0.0f, true, tick, out);
      ASSERT_EQ(out.fault, Fault::none) << zero << " " << tick;
    }
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

TEST(MotorControl, AForceMadeIsThatOfTheMeasuredCurrent) {
  MotorControlConfig config = dc();
  config.transmission = -0.01f;  // the handle runs against the motor
  MotorControl motor;
  auto out = update(motor, MotorControl::prepare(config), measured(2.0f, -2.0f), 0.0f, 0, 0.0f, true);
  EXPECT_FLOAT_EQ(out.force_made, -6.0f);
  motor = MotorControl();
  out = update(motor, MotorControl::prepare(pmsm()), of_q_current(-1.5, 0.0), 0.0f, 0, 0.0f, true);
  EXPECT_NEAR(out.force_made, -7.5f, 1e-4f);
  motor = MotorControl();
  out = update(motor, MotorControl::prepare(dc()), {}, 100.0f, 0, 0.0f, true);
  EXPECT_FLOAT_EQ(out.force_made, 15.0f) << "nothing is measured: what the bounded reference makes";
}

TEST(MotorControl, VoltageAndBothCurrentsAreThoseOfTheRotorsFrame) {
  MotorControl motor;
  const auto c = MotorControl::prepare(pmsm());
  // A current along the flux at angle 0: phase A has it all.
  const auto out = update(motor, c, measured(-0.5f, -0.5f), 5.0f, 0, 0.0f, true);
  EXPECT_NEAR(out.current_d, 1.0f, 1e-5f);
  EXPECT_NEAR(out.current, 0.0f, 1e-5f);
  EXPECT_LT(out.voltage_d, 0.0f) << "it shall vanish";
  EXPECT_GT(out.voltage, 0.0f);
  EXPECT_EQ(out.electrical_angle, 0u);
  EXPECT_EQ(update(motor, c, measured(0.0f, 0.0f), 0.0f, 8192 / 28, 0.0f, true).electrical_angle,
            (8192u / 28u) * c.angle_per_count);
}

TEST(MotorControl, SquareOfTheCurrentFollowsWithItsTimeConstantAndFallsWhenOff) {
  MotorControl motor;
  const auto c = MotorControl::prepare(dc());
  MotorControl::Output out;
  // 192 ticks are 24 looks whenever they begin.
  const float left = std::exp(-0.96f);
  for (int i = 0; i < 192; ++i)
    motor.update(c, measured(2.0f, -2.0f), 6.0f, 0, 0.0f, true, ++tick_number, out);
  EXPECT_NEAR(out.current_square, 4.0f * (1.0f - left), 1e-3f);
  for (int i = 0; i < 192; ++i)
    motor.update(c, measured(0.1f, 0.0f), 0.0f, 0, 0.0f, false, ++tick_number, out);
  EXPECT_NEAR(out.current_square, 4.0f * (1.0f - left) * left, 1e-3f);
  // Nor does it matter that the current goes to and fro from tick to tick.
  motor = MotorControl();
  for (int i = 0; i < 8000; ++i) {
    const float current = i % 2 == 0 ? 3.0f : 1.0f;
    motor.update(c, measured(current, -current), 6.0f, 0, 0.0f, true, ++tick_number, out);
  }
  EXPECT_NEAR(out.current_square, 5.0f, 0.4f);
  // A d current heats as well.
  motor = MotorControl();
  const auto synchronous = MotorControl::prepare(pmsm());
  for (int i = 0; i < 4000; ++i)
    motor.update(synchronous, measured(-1.0f, -1.0f), 0.0f, 0, 0.0f, true, ++tick_number, out);
  EXPECT_NEAR(out.current_square, 4.0f, 1e-3f);
}

// One broken sample: it may count as the most that a winding is allowed to carry, but not for ever.
TEST(MotorControl, ACurrentThatIsNotFiniteIsForgotten) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity(), 3e38f}) {
    for (const auto& config : {dc(), pmsm()}) {
      for (const bool driven : {true, false}) {
        MotorControl motor;
        const auto c = MotorControl::prepare(config);
        MotorControl::Output out;
        float most = 0.0f;
        for (int i = 0; i < 64; ++i) {
          motor.update(c, measured(bad, 0.0f), 0.0f, 0, 0.0f, driven, ++tick_number, out);
          EXPECT_EQ(out.fault, driven ? Fault::over_current : Fault::none);
          most = std::max(most, out.current_square);
        }
        const float over_current = over_current_factor * config.current_limit;
        EXPECT_EQ(most, driven ? over_current * over_current : 0.0f) << bad;
        for (int i = 0; i < 2000; ++i)
          motor.update(c, measured(0.0f, 0.0f), 0.0f, 0, 0.0f, i % 2 == 0, ++tick_number, out);
        EXPECT_LT(out.current_square, 0.01f) << bad;
        EXPECT_GE(out.current_square, 0.0f);
      }
    }
  }
}

TEST(MotorControl, AWarmWindingHasItsResistance) {
  for (const auto& config : {dc(), pmsm()}) {
    MotorControlConfig warm = config, as_warm = config;
    warm.winding_temperature = 125.0f;
    as_warm.resistance = config.resistance * 1.393f;
    const auto a = MotorControl::prepare(warm), b = MotorControl::prepare(as_warm);
    EXPECT_NEAR(a.dc.gains.proportional, b.dc.gains.proportional, 1e-5f);
    EXPECT_NEAR(a.dc.gains.tracking, b.dc.gains.tracking, 1e-6f);
    EXPECT_NEAR(a.pmsm.gains_q.tracking, b.pmsm.gains_q.tracking, 1e-6f);
    EXPECT_NE(a.pmsm.gains_q.tracking, MotorControl::prepare(config).pmsm.gains_q.tracking);
    for (const float absurd : {std::numeric_limits<float>::quiet_NaN(), -1e9f, 1e30f}) {
      warm.winding_temperature = absurd;
      const auto c = MotorControl::prepare(warm);
      EXPECT_TRUE(std::isfinite(c.dc.gains.proportional)) << absurd;
      EXPECT_TRUE(std::isfinite(c.pmsm.gains_d.proportional)) << absurd;
    }
  }
}

// Thermal derating takes current away, and must not make a trip of what is then too much to ask for.
TEST(MotorControl, CurrentShareBoundsTheReferenceOnly) {
  for (const auto& [share, current] : {std::pair{0.2f, 1.0f},
                                       {0.0f, 0.0f},
                                       {-1.0f, 0.0f},
                                       {2.0f, 5.0f},
                                       {std::numeric_limits<float>::quiet_NaN(), 0.0f}}) {
    MotorControlConfig config = dc();
    config.current_share = share;
    MotorControl motor;
    const auto out =
        update(motor, MotorControl::prepare(config), measured(4.9f, -4.9f), 100.0f, 0, 0.0f, true);
    EXPECT_FLOAT_EQ(out.current_reference, current) << share;
    EXPECT_EQ(out.fault, Fault::none) << share;
    EXPECT_TRUE(out.saturated);
  }
}

TEST(MotorControl, AnglesSpeedsAndBoundsFollowTheMotor) {
  MotorControlConfig config;
  config.transmission = 0.1f;
  config.electrical_offset = 1.5707963f;
  auto c = MotorControl::prepare(config);
  EXPECT_EQ(c.angle_per_count, 7u << 19) << "7 pole pairs, 8192 counts";
  EXPECT_EQ(c.shaft_angle_per_count, 1u << 19);
  EXPECT_NEAR(static_cast<double>(c.angle_offset), 0x4000'0000, 300.0) << "a float's last place";
  EXPECT_FLOAT_EQ(c.electrical_speed_per_velocity, 70.0f);
  EXPECT_FLOAT_EQ(c.slow_velocity, 8.0f) << "half of 8 V over 0.05 V s, at 0.1 m";
  EXPECT_NEAR(c.current_square_step, -std::expm1(-8 * 5e-5 / 0.01), 1e-8) << "every eighth tick";
  EXPECT_EQ(c.watch.over_current, 7.5f) << "half as much again as 5 A";
  config.electrical_offset = -1.5707963f;
  config.torque_constant = -0.05f;
  config.pole_pairs = 2;
  config.counts_per_turn = 3;
  c = MotorControl::prepare(config);
  EXPECT_NEAR(static_cast<double>(c.angle_offset), 0xC000'0000, 300.0);
  EXPECT_FLOAT_EQ(c.slow_velocity, 8.0f);
  EXPECT_EQ(c.angle_per_count, 2863311531u) << "to the nearest";
  EXPECT_EQ(c.shaft_angle_per_count, 1431655765u);
}

TEST(MotorControl, AShareIsWithinNothingAndAll) {
  for (const auto& [share, limit] : {std::pair{0.5f, 2.5f},
                                     {0.0f, 0.0f},
                                     {-0.1f, 0.0f},
                                     {1.0f, 5.0f},
                                     {1.5f, 5.0f},
                                     {std::numeric_limits<float>::quiet_NaN(), 0.0f}}) {
    MotorControlConfig config;
    config.current_share = share;
    EXPECT_EQ(MotorControl::prepare(config).transmission.current_limit, limit) << share;
  }
}

TEST(MotorControl, SaliencyAndDeadTimeReachTheControllers) {
  MotorControlConfig config = pmsm();
  EXPECT_EQ(MotorControl::prepare(config).pmsm.inductance_q, 3e-4f) << "0: as inductance";
  EXPECT_FALSE(MotorControl::prepare(config).pmsm.dead_time.active);
  config.inductance_q = 5e-4f;
  config.dead_time = 1e-6f;
  config.dead_time_current = 0.2f;
  const auto c = MotorControl::prepare(config);
  EXPECT_EQ(c.pmsm.inductance_d, 3e-4f);
  EXPECT_EQ(c.pmsm.inductance_q, 5e-4f);
  EXPECT_NEAR(c.pmsm.dead_time.share, 0.02f, 1e-6f);
  EXPECT_NEAR(c.dc.dead_time.share, 0.02f, 1e-6f);
  EXPECT_EQ(c.dc.dead_time.band, 0.2f);
}

TEST(MotorControl, CurrentsOfADcMotorThatDoNotAddUpAreTold) {
  MotorControl motor;
  const auto c = MotorControl::prepare(dc());
  MotorControl::Output out;
  int ticks = 0;
  while (ticks < 1000 && out.fault == Fault::none) {
    motor.update(c, measured(2.0f, -0.8f), 4.2f, 0, 0.0f, true, ++tick_number, out);
    ++ticks;
  }
  EXPECT_EQ(out.fault, Fault::current_sum);
  EXPECT_FLOAT_EQ(out.fault_value, 1.2f);
  EXPECT_LT(ticks, 100);
}

}  // namespace
}  // namespace kmax::firmware::motor_control_test
