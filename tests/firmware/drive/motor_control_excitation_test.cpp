// MotorControl::excite() against windings: what the excitation asks for must flow, and only what cannot be
// right may be a fault.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "firmware/drive/motor_control.hpp"
#include "tests/control/motor_winding.hpp"

namespace kmax::firmware::motor_control_excitation_test {
namespace {

using control::test::DcMotor;
using control::test::SynchronousMotor;

constexpr double turn = 6.283185307179586;
std::uint32_t tick_number = 0;
constexpr float supply = 24.0f;

control::TurnFraction fraction(double radians) {
  return static_cast<control::TurnFraction>(
      static_cast<std::int64_t>(std::floor(radians / turn * 4294967296.0)));
}

MotorControlConfig configuration(MotorKind kind) {
  MotorControlConfig config;
  config.modulation_limit = 0.88f;
  config.kind = kind;
  config.transmission = 0.01f;
  config.torque_constant = 0.03f;
  config.resistance = 0.8f;
  config.inductance = 6e-4f;
  config.electrical_offset = 0.4f;
  return config;
}

Excitation::Output asked(ExcitationKind kind, float along, float across = 0.0f, double angle = 0.0) {
  Excitation::Output out;
  out.kind = kind;
  out.along = along;
  out.across = across;
  out.angle = fraction(angle);
  return out;
}

/// One motor of either kind with its control, at rest.
struct Bench {
  explicit Bench(MotorKind motor_kind) : Bench(configuration(motor_kind)) {}
  explicit Bench(const MotorControlConfig& config) : c(MotorControl::prepare(config)) {
    dc.resistance = synchronous.resistance = static_cast<double>(config.resistance);
    dc.inductance = synchronous.inductance_d = synchronous.inductance_q =
        static_cast<double>(config.inductance);
    synchronous.flux = 0.0;  // at rest it plays no part; the frame of the model is then as good as any
  }

  MotorControl::Measured measured() const {
    if (c.kind == MotorKind::dc) {
      const auto current = static_cast<float>(dc.current);
      return {true, supply, current, -current};
    }
    const auto phases = synchronous.currents();
    return {true, supply, static_cast<float>(phases.b), static_cast<float>(phases.c)};
  }

  void tick(const Excitation::Output& wanted, std::uint32_t position = 0) {
    force = motor.excite(c, measured(), wanted, position, 0.0f, ++tick_number, out);
    if (c.kind == MotorKind::dc) {
      dc.run(static_cast<double>(out.duty_b - out.duty_c) * static_cast<double>(supply));
    } else {
      synchronous.run(
          {static_cast<double>(out.duty_a), static_cast<double>(out.duty_b), static_cast<double>(out.duty_c)},
          static_cast<double>(supply));
    }
  }
  /// False: it has tripped.
  bool run(const Excitation::Output& wanted, int ticks, std::uint32_t position = 0) {
    for (int i = 0; i < ticks; ++i) {
      tick(wanted, position);
      if (out.fault != Fault::none) return false;
    }
    return true;
  }

  MotorControl motor;
  MotorControl::Coefficients c;
  MotorControl::Output out;
  DcMotor dc;
  SynchronousMotor synchronous;
  float force = 0.0f;
};

TEST(MotorControlExcitation, DcVoltageMakesTheCurrentOfItsResistance) {
  for (const float volts : {1.6f, -1.6f}) {
    Bench bench(MotorKind::dc);
    ASSERT_TRUE(bench.run(asked(ExcitationKind::voltage, volts), 1000));
    EXPECT_NEAR(bench.out.current, volts / 0.8f, 1e-4f);
    EXPECT_FLOAT_EQ(bench.out.voltage, volts);
    EXPECT_EQ(bench.out.current_d, 0.0f);
    EXPECT_EQ(bench.out.voltage_d, 0.0f);
    EXPECT_EQ(bench.out.current_reference, 0.0f);
    EXPECT_EQ(bench.out.duty_a, 0.5f);
    EXPECT_NEAR(bench.out.force_made, volts / 0.8f * 3.0f, 1e-3f);
    EXPECT_EQ(bench.force, 0.0f);
  }
}

TEST(MotorControlExcitation, SynchronousVoltageStandsInTheStatorWhereverTheRotorIs) {
  for (const std::uint32_t position : {0u, 777u, 0xFFFFF000u}) {
    for (double angle = -3.0; angle < 3.2; angle += 0.37) {
      Bench bench(MotorKind::pmsm);
      ASSERT_TRUE(bench.run(asked(ExcitationKind::voltage, 1.2f, -0.4f, angle), 500, position));
      EXPECT_NEAR(bench.out.current, 1.5f, 2e-3f) << angle;
      EXPECT_NEAR(bench.out.current_d, -0.5f, 2e-3f) << angle;
      EXPECT_FLOAT_EQ(bench.out.voltage, 1.2f);
      EXPECT_FLOAT_EQ(bench.out.voltage_d, -0.4f);
      EXPECT_EQ(bench.out.electrical_angle, fraction(angle));
      // Phase A by the definition of the vector.
      const auto phases = bench.synchronous.currents();
      EXPECT_NEAR(-(phases.b + phases.c), 1.5 * std::cos(angle) + 0.5 * std::sin(angle), 2e-3);
    }
  }
}

TEST(MotorControlExcitation, CurrentKindReachesWhatIsAskedInBothDirections) {
  for (double angle = -3.0; angle < 3.2; angle += 0.61) {
    Bench bench(MotorKind::pmsm);
    ASSERT_TRUE(bench.run(asked(ExcitationKind::current, 2.0f, 1.0f, angle), 300, 4321)) << angle;
    EXPECT_NEAR(bench.out.current, 2.0f, 2e-3f);
    EXPECT_NEAR(bench.out.current_d, 1.0f, 2e-3f);
    EXPECT_EQ(bench.out.current_reference, 2.0f);
  }
  Bench bench(MotorKind::dc);
  ASSERT_TRUE(bench.run(asked(ExcitationKind::current, -2.0f), 300));
  EXPECT_NEAR(bench.out.current, -2.0f, 2e-3f);
  EXPECT_FLOAT_EQ(bench.force, -6.0f);
}

TEST(MotorControlExcitation, CurrentLimitBoundsTheVectorAlongFirst) {
  Bench bench(MotorKind::pmsm);
  ASSERT_TRUE(bench.run(asked(ExcitationKind::current, 4.0f, 40.0f, 1.0), 300));
  EXPECT_TRUE(bench.out.saturated);
  EXPECT_NEAR(bench.out.current, 4.0f, 5e-3f);
  EXPECT_NEAR(bench.out.current_d, 3.0f, 5e-3f);
  ASSERT_TRUE(bench.run(asked(ExcitationKind::current, -400.0f, 40.0f, 1.0), 300));
  EXPECT_NEAR(bench.out.current, -5.0f, 5e-3f);
  EXPECT_NEAR(bench.out.current_d, 0.0f, 5e-3f);
  Bench dc(MotorKind::dc);
  ASSERT_TRUE(dc.run(asked(ExcitationKind::torque, 99.0f), 300));
  EXPECT_EQ(dc.out.current_reference, 5.0f);
  EXPECT_TRUE(dc.out.saturated);
}

TEST(MotorControlExcitation, ATurningCurrentStaysOnItsVector) {
  Bench bench(MotorKind::pmsm);
  auto wanted = asked(ExcitationKind::current, 2.0f);
  wanted.electrical_speed = 500.0f;
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    wanted.angle = fraction(std::fmod(500.0 * control::test::tick * i, turn));
    bench.tick(wanted);
    ASSERT_EQ(bench.out.fault, Fault::none);
    if (i > 500)
      worst = std::max(worst, std::hypot(static_cast<double>(bench.out.current) - 2.0,
                                         static_cast<double>(bench.out.current_d)));
  }
  EXPECT_LT(worst, 0.05);
}

// Torque and position kinds are what a force would have made, to the bit.
TEST(MotorControlExcitation, TorqueAndPositionAreTheUsualWay) {
  for (const MotorKind kind : {MotorKind::dc, MotorKind::pmsm}) {
    const auto c = MotorControl::prepare(configuration(kind));
    MotorControl by_force, by_torque, by_position;
    MotorControl::Output a, b, p;
    for (std::uint32_t i = 0; i < 50; ++i) {
      const auto shake = static_cast<float>(i % 7) * 0.1f;
      const MotorControl::Measured now{true, supply, 0.5f - shake, shake - 0.4f};
      by_force.update(c, now, 3.0f, 100 * i, 0.1f, true, i, a);
      Excitation::Output wanted = asked(ExcitationKind::torque, a.current_reference);
      EXPECT_FLOAT_EQ(by_torque.excite(c, now, wanted, 100 * i, 0.1f, i, b), 3.0f);
      wanted = asked(ExcitationKind::position, 0.0f);
      wanted.force = 3.0f;
      EXPECT_FLOAT_EQ(by_position.excite(c, now, wanted, 100 * i, 0.1f, i, p), 3.0f);
      for (const auto* out : {&b, &p}) {
        ASSERT_EQ(a.duty_a, out->duty_a);
        ASSERT_EQ(a.duty_b, out->duty_b);
        ASSERT_EQ(a.duty_c, out->duty_c);
        ASSERT_EQ(a.current, out->current);
        ASSERT_EQ(a.current_d, out->current_d);
        ASSERT_EQ(a.force_made, out->force_made);
        ASSERT_EQ(a.electrical_angle, out->electrical_angle);
        ASSERT_EQ(a.current_square, out->current_square);
        ASSERT_EQ(a.fault, out->fault);
      }
    }
  }
}

// Nobody knows yet what a voltage should make: a winding that is not there, or so weak that its current
// looks like none, must not be called an open phase. Nor may a wave that the loop cannot follow.
TEST(MotorControlExcitation, NoOpenPhaseIsToldWhereTheCurrentIsNotKnown) {
  for (const MotorKind kind : {MotorKind::dc, MotorKind::pmsm}) {
    const auto c = MotorControl::prepare(configuration(kind));
    for (const MotorControl::Measured now : {MotorControl::Measured{true, supply, 0.0f, 0.0f},
                                             MotorControl::Measured{true, supply, 2.0f, -2.0f}}) {
      MotorControl motor;
      MotorControl::Output out;
      for (int i = 0; i < 5000; ++i) {
        // Flows and vanishes within a sample as well.
        const auto sample = i % 100 < 50 ? now : MotorControl::Measured{true, supply, 0.0f, 0.0f};
        motor.excite(c, sample, asked(ExcitationKind::voltage, 5.0f, 0.0f, 0.3), 0, 0.0f, ++tick_number, out);
        ASSERT_EQ(out.fault, Fault::none) << i;
      }
    }
    for (const ExcitationKind fast : {ExcitationKind::current, ExcitationKind::torque}) {
      Bench bench(kind);
      for (int i = 0; i < 5000; ++i) {
        auto wanted = asked(fast, i % 2 == 0 ? 3.0f : -3.0f, 0.0f, 0.3);
        wanted.alternating = true;
        bench.tick(wanted, 100);
        ASSERT_EQ(bench.out.fault, Fault::none) << i;
      }
    }
  }
}

TEST(MotorControlExcitation, AnOpenPhaseIsToldWhereASteadyCurrentIsAsked) {
  for (const MotorKind kind : {MotorKind::dc, MotorKind::pmsm}) {
    for (const ExcitationKind steady : {ExcitationKind::current, ExcitationKind::torque}) {
      Bench bench(kind);
      const auto wanted = asked(steady, 2.0f, 0.0f, 0.3);
      ASSERT_TRUE(bench.run(wanted, 300, 100));
      const MotorControl::Measured cut{true, supply, 0.0f, 0.0f};
      for (int i = 0; i < 37 && bench.out.fault == Fault::none; ++i)
        bench.motor.excite(bench.c, cut, wanted, 100, 0.0f, ++tick_number, bench.out);
      EXPECT_EQ(bench.out.fault, Fault::phase_open);
      // And where it never came.
      MotorControl motor;
      MotorControl::Output out;
      for (int i = 0; i < 100 && out.fault == Fault::none; ++i)
        motor.excite(bench.c, cut, wanted, 100, 0.0f, ++tick_number, out);
      EXPECT_EQ(out.fault, Fault::phase_open);
    }
  }
}

TEST(MotorControlExcitation, OverCurrentAndLeakageAreWatchedWithAVoltageToo) {
  for (const MotorKind kind : {MotorKind::dc, MotorKind::pmsm}) {
    Bench bench(kind);
    EXPECT_FALSE(bench.run(asked(ExcitationKind::voltage, 9.0f), 1000));  // 11 A, in phase A
    EXPECT_EQ(bench.out.fault, Fault::over_current);
    EXPECT_GT(bench.out.fault_value, 7.5f);
  }
  const auto c = MotorControl::prepare(configuration(MotorKind::dc));
  MotorControl motor;
  MotorControl::Output out;
  for (int i = 0; i < 200 && out.fault == Fault::none; ++i)
    motor.excite(c, {true, supply, 2.0f, -0.5f}, asked(ExcitationKind::voltage, 1.0f), 0, 0.0f, ++tick_number,
                 out);
  EXPECT_EQ(out.fault, Fault::current_sum);
}

TEST(MotorControlExcitation, VoltageBeyondTheSupplyIsBoundedAndSaysSo) {
  MotorControlConfig config = configuration(MotorKind::dc);
  config.resistance = 100.0f;
  Bench dc(config);
  ASSERT_TRUE(dc.run(asked(ExcitationKind::voltage, 200.0f), 100));
  EXPECT_TRUE(dc.out.saturated);
  EXPECT_NEAR(dc.out.voltage, 0.88f * supply, 1e-3f);
  config.kind = MotorKind::pmsm;
  Bench synchronous(config);
  ASSERT_TRUE(synchronous.run(asked(ExcitationKind::voltage, 0.0f, -200.0f, 2.0), 100));
  EXPECT_TRUE(synchronous.out.saturated);
  EXPECT_NEAR(synchronous.out.voltage_d, -0.88f * supply / std::sqrt(3.0f) * 127.0f / 128.0f, 0.02f);
  for (const float duty : {synchronous.out.duty_a, synchronous.out.duty_b, synchronous.out.duty_c}) {
    EXPECT_GE(duty, 0.06f - 1e-6f);
    EXPECT_LE(duty, 0.94f + 1e-6f);
  }
  synchronous.tick(asked(ExcitationKind::voltage, 1.0f));
  EXPECT_FALSE(synchronous.out.saturated) << "not of the tick before";
}

// The integrators of one frame are worth nothing in another.
TEST(MotorControlExcitation, AnotherKindBeginsWithEmptyControllers) {
  for (const MotorKind kind : {MotorKind::dc, MotorKind::pmsm}) {
    Bench bench(kind);
    ASSERT_TRUE(bench.run(asked(ExcitationKind::current, 3.0f, 0.0f, 1.0), 300));
    ASSERT_GT(bench.out.voltage, 2.0f);
    ASSERT_TRUE(bench.run(asked(ExcitationKind::voltage, 0.0f), 300));
    bench.tick(asked(ExcitationKind::current, 0.0f));
    EXPECT_NEAR(bench.out.voltage, 0.0f, 0.02f);
  }
}

TEST(MotorControlExcitation, OffAndFinishedLeaveNoCurrent) {
  for (const MotorKind kind : {MotorKind::dc, MotorKind::pmsm}) {
    for (const ExcitationKind ending :
         {ExcitationKind::off, ExcitationKind::voltage, ExcitationKind::current}) {
      Bench bench(kind);
      ASSERT_TRUE(bench.run(asked(ExcitationKind::voltage, 2.0f, 0.0f, 1.0), 300));
      auto wanted = asked(ending, 0.0f);
      wanted.finished = true;
      ASSERT_TRUE(bench.run(wanted, 300));
      EXPECT_NEAR(bench.out.current, 0.0f, 1e-3f);
      EXPECT_NEAR(bench.out.current_d, 0.0f, 1e-3f);
      EXPECT_TRUE(bench.out.excitation_finished);
    }
  }
}

TEST(MotorControlExcitation, ForceMadeByAVectorInTheStatorIsItsPartAcrossTheRotor) {
  const auto c = MotorControl::prepare(configuration(MotorKind::pmsm));
  const std::uint32_t position = 1000;
  const double rotor = 7.0 * turn * 1000.0 / 8192.0 + 0.4;
  for (const double ahead : {0.0, turn / 4, turn / 2, -turn / 4, 0.5}) {
    MotorControl motor;
    MotorControl::Output out;
    const double angle = rotor + ahead;
    const double alpha = 2.0 * std::cos(angle), beta = 2.0 * std::sin(angle);
    const MotorControl::Measured now{true, supply, static_cast<float>(-alpha / 2 + std::sqrt(3.0) / 2 * beta),
                                     static_cast<float>(-alpha / 2 - std::sqrt(3.0) / 2 * beta)};
    EXPECT_EQ(motor.excite(c, now, asked(ExcitationKind::voltage, 1.6f, 0.0f, angle), position, 0.0f,
                           ++tick_number, out),
              0.0f);
    EXPECT_NEAR(static_cast<double>(out.current), 2.0, 1e-3);
    EXPECT_NEAR(static_cast<double>(out.force_made), 6.0 * std::sin(ahead), 5e-3) << ahead;
  }
}

TEST(MotorControlExcitation, WithoutMeasuredCurrentsOnlyWhatNeedsNoneIsMade) {
  const auto c = MotorControl::prepare(configuration(MotorKind::pmsm));
  MotorControl motor;
  MotorControl::Output out;
  EXPECT_FLOAT_EQ(motor.excite(c, {}, asked(ExcitationKind::torque, 1.0f), 0, 0.0f, ++tick_number, out),
                  3.0f);
  EXPECT_FLOAT_EQ(out.force_made, 3.0f);
  EXPECT_EQ(motor.excite(c, {}, asked(ExcitationKind::voltage, 1.0f), 0, 0.0f, ++tick_number, out), 0.0f);
  EXPECT_EQ(out.force_made, 0.0f);
  EXPECT_EQ(out.duty_b, 0.5f);
  EXPECT_EQ(out.current_reference, 0.0f);
}

TEST(MotorControlExcitation, WhatIsNotANumberIsAFaultAndNoVoltage) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const MotorKind motor_kind : {MotorKind::dc, MotorKind::pmsm}) {
    const auto c = MotorControl::prepare(configuration(motor_kind));
    for (const ExcitationKind kind : {ExcitationKind::voltage, ExcitationKind::current,
                                      ExcitationKind::torque, ExcitationKind::position}) {
      for (const float bad : {nan, 0.0f}) {
        MotorControl motor;
        MotorControl::Output out;
        motor.excite(c, {true, bad, 0.1f, 0.1f}, asked(kind, 1.0f), 0, 0.0f, ++tick_number, out);
        EXPECT_EQ(out.fault, Fault::not_finite) << static_cast<int>(kind) << " supply " << bad;
        EXPECT_EQ(out.duty_b, 0.5f);
      }
      MotorControl motor;
      MotorControl::Output out;
      motor.excite(c, {true, supply, nan, 0.1f}, asked(kind, 1.0f), 0, 0.0f, ++tick_number, out);
      EXPECT_NE(out.fault, Fault::none);
      auto wanted = asked(kind, 0.0f);
      wanted.force = nan;
      MotorControl other;
      other.excite(c, {true, supply, 0.0f, 0.0f}, wanted, 0, 0.0f, ++tick_number, out);
      EXPECT_EQ(out.fault, kind == ExcitationKind::position ? Fault::not_finite : Fault::none);
    }
  }
}

TEST(MotorControlExcitation, ItsFlagsGoWhenTheAxisIsNotDriven) {
  Bench bench(MotorKind::dc);
  auto wanted = asked(ExcitationKind::voltage, 1.0f);
  wanted.started = true;
  bench.tick(wanted);
  EXPECT_TRUE(bench.out.excitation_started);
  wanted.started = false;
  bench.tick(wanted);
  EXPECT_FALSE(bench.out.excitation_started);
  wanted.finished = true;
  bench.tick(wanted);
  EXPECT_TRUE(bench.out.excitation_finished);
  bench.motor.update(bench.c, bench.measured(), 0.0f, 0, 0.0f, false, ++tick_number, bench.out);
  EXPECT_FALSE(bench.out.excitation_finished);
}

}  // namespace
}  // namespace kmax::firmware::motor_control_excitation_test
