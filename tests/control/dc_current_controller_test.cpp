#include "control/dc_current_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "tests/control/motor_winding.hpp"

namespace kmax::control {
namespace {

using test::DcMotor;
using test::tick;
constexpr double two_pi = 2.0 * std::numbers::pi;

template <typename Scalar>
struct Loop {
  DcCurrentControllerConfig<Scalar> config;
  DcMotor motor;
  double supply = 24.0;
  DcCurrentController<Scalar> controller;
  typename DcCurrentController<Scalar>::Coefficients c;
  typename DcCurrentController<Scalar>::Output out;

  // The controller is told the motor's values times these.
  explicit Loop(const DcMotor& plant, double bandwidth_hertz, double resistance_error = 1.0,
                double inductance_error = 1.0, double torque_constant_error = 1.0)
      : motor(plant) {
    config.resistance = static_cast<Scalar>(plant.resistance * resistance_error);
    config.inductance = static_cast<Scalar>(plant.inductance * inductance_error);
    config.torque_constant = static_cast<Scalar>(plant.torque_constant * torque_constant_error);
    config.bandwidth = static_cast<Scalar>(two_pi * bandwidth_hertz);
    c = DcCurrentController<Scalar>::prepare(config, static_cast<Scalar>(tick));
  }
  double run(double reference) {
    out = controller.update(c, static_cast<Scalar>(reference), static_cast<Scalar>(motor.current),
                            static_cast<Scalar>(motor.speed), static_cast<Scalar>(supply));
    motor.run(static_cast<double>(out.duty_b - out.duty_c) * supply);
    return motor.current;
  }
};

double overshoot(Loop<double>& loop, double step, int ticks = 2000) {
  double highest = 0.0;
  for (int k = 0; k < ticks; ++k) highest = std::max(highest, loop.run(step) / step);
  return highest - 1.0;
}

// Gain of the closed loop from reference to current at a frequency, by correlation.
double gain_at(Loop<double> loop, double hertz) {
  const int settle = 4000;
  const int periods = std::max(1, static_cast<int>(0.05 * hertz));
  const int length = static_cast<int>(std::lround(periods / hertz / tick));
  std::complex<double> in = 0.0;
  std::complex<double> out = 0.0;
  for (int k = 0; k < settle + length; ++k) {
    const double phase = two_pi * hertz * tick * k;
    const double current = loop.motor.current;
    loop.run(0.1 * std::cos(phase));
    if (k < settle) continue;
    in += 0.1 * std::cos(phase) * std::polar(1.0, -phase);
    out += current * std::polar(1.0, -phase);
  }
  return std::abs(out / in);
}

double bandwidth_of(const Loop<double>& loop) {
  double hertz = 50.0;
  while (hertz < 9000.0 && gain_at(loop, hertz) > std::sqrt(0.5)) hertz *= 1.02;
  return hertz;
}

TEST(DcCurrentController, BandwidthIsWhatWasAskedForAndOvershootStaysSmall) {
  struct Case {
    double asked, least, most, overshoot;
  };
  // The delay of half a tick raises the -3 dB frequency above the request as that nears the ceiling.
  for (const Case& test : {Case{200.0, 198.0, 230.0, 1e-3}, Case{500.0, 495.0, 640.0, 1e-3},
                           Case{1000.0, 990.0, 1600.0, 1e-3}, Case{2500.0, 2475.0, 6000.0, 0.11}}) {
    const DcMotor motor{.resistance = 1.2, .inductance = 2e-3};
    Loop<double> loop(motor, test.asked);
    const double measured = bandwidth_of(loop);
    EXPECT_GE(measured, test.least) << test.asked;
    EXPECT_LE(measured, test.most) << test.asked;
    const double over = overshoot(loop, 0.2);
    EXPECT_LE(over, test.overshoot) << test.asked;
    RecordProperty("bandwidth_at_" + std::to_string(static_cast<int>(test.asked)), std::to_string(measured));
    RecordProperty("overshoot_at_" + std::to_string(static_cast<int>(test.asked)), std::to_string(over));
  }
}

TEST(DcCurrentController, StaysStableWithResistanceAndInductanceWrongByAThird) {
  for (const double hertz : {200.0, 1000.0, 2500.0}) {
    for (const double r : {0.7, 1.0, 1.3}) {
      for (const double l : {0.7, 1.0, 1.3}) {
        Loop<double> loop({.resistance = 1.2, .inductance = 2e-3}, hertz, r, l);
        EXPECT_LE(overshoot(loop, 0.2), 0.45) << hertz << " " << r << " " << l;
        for (int k = 0; k < 4000; ++k) loop.run(0.2);
        EXPECT_NEAR(loop.motor.current, 0.2, 1e-6) << hertz << " " << r << " " << l;
      }
    }
  }
}

TEST(DcCurrentController, AWindingThatSettlesWithinATickIsControlledAsWell) {
  for (const double inductance : {4e-4, 1e-4, 1e-5, 0.0}) {  // L/R: 40, 10, 1, 0 us
    for (const double hertz : {200.0, 1000.0, 2500.0}) {
      Loop<double> loop({.resistance = 10.0, .inductance = inductance}, hertz);
      EXPECT_LE(overshoot(loop, 0.5), 0.12) << inductance << " " << hertz;
      EXPECT_NEAR(loop.motor.current, 0.5, 1e-9) << inductance << " " << hertz;
    }
  }
}

TEST(DcCurrentController, NoSteadyErrorWithAWrongBackEmfAndWrongResistance) {
  DcMotor motor{.resistance = 1.2, .inductance = 2e-3, .torque_constant = 0.05};
  motor.speed = 120.0;
  Loop<double> loop(motor, 1000.0, 0.7, 1.0, 0.5);
  for (int k = 0; k < 20'000; ++k) loop.run(1.0);
  EXPECT_NEAR(loop.motor.current, 1.0, 1e-9);
  Loop<float> single(motor, 1000.0, 0.7, 1.0, 0.5);
  for (int k = 0; k < 20'000; ++k) single.run(1.0);
  EXPECT_NEAR(single.motor.current, 1.0, 1e-5);
}

TEST(DcCurrentController, TheFeedForwardKeepsASpeedStepOutOfTheCurrent) {
  const DcMotor motor{.resistance = 1.2, .inductance = 2e-3, .torque_constant = 0.05};
  double disturbed[2] = {};
  for (int with = 0; with < 2; ++with) {
    Loop<double> loop(motor, 500.0, 1.0, 1.0, with);
    for (int k = 0; k < 2000; ++k) loop.run(0.5);
    loop.motor.speed = 200.0;  // 10 V
    for (int k = 0; k < 200; ++k) disturbed[with] = std::max(disturbed[with], std::fabs(loop.run(0.5) - 0.5));
  }
  EXPECT_LT(disturbed[1], 0.2 * disturbed[0]);
}

// A second against the supply, then back: the same as never having been there, but for the way back itself.
TEST(DcCurrentController, LeavesSaturationWithoutWindUp) {
  for (const double sign : {1.0, -1.0}) {
    Loop<double> loop({.resistance = 1.2, .inductance = 2e-3}, 1000.0);
    for (int k = 0; k < 20'000; ++k) {
      loop.run(sign * 100.0);
      ASSERT_TRUE(loop.out.saturated);
    }
    EXPECT_NEAR(loop.motor.current, sign * 24.0 * 0.95 / 1.2, 1e-6);
    int ticks = 0;
    while (std::fabs(loop.run(sign * 1.0) - sign) > 0.02 && ticks < 1000) {
      ++ticks;
      EXPECT_GT(sign * loop.motor.current, 1.0 - 0.02) << "undershoot: the integrator was wound up";
    }
    // 18 A at (22.8 V + some 10 V of resistance)/2 mH is some 22 ticks at the limit; then the linear loop's.
    EXPECT_LE(ticks, 50);
    for (int k = 0; k < 200; ++k) EXPECT_NEAR(loop.run(sign * 1.0), sign, 0.021);
  }
}

TEST(DcCurrentController, DutiesMakeTheVoltageAndStayWithinTheLimit) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1.0F, 1.0F);
  for (const float limit : {0.95F, 0.5F, 1.0F, 0.0F, 2.0F, -1.0F, std::nanf("")}) {
    DcCurrentControllerConfig<float> config;
    config.modulation_limit = limit;
    config.torque_constant = 0.05F;
    const auto c = DcCurrentController<float>::prepare(config, 5e-5F);
    DcCurrentController<float> controller;
    const float allowed = !(limit < 1.0F) ? 1.0F : std::max(limit, 0.0F);
    bool both[2] = {};
    for (int k = 0; k < 5000; ++k) {
      const float supply = 24.0F + 12.0F * unit(random);
      const auto out =
          controller.update(c, 4.0F * unit(random), 4.0F * unit(random), 100.0F * unit(random), supply);
      ASSERT_FALSE(out.not_finite);
      ASSERT_NEAR((out.duty_b - out.duty_c) * supply, out.voltage, 2e-5F);
      ASSERT_NEAR(out.duty_b + out.duty_c, 1.0F, 1e-6F);
      for (const float duty : {out.duty_b, out.duty_c}) {
        ASSERT_GE(duty, 0.5F - allowed / 2);
        ASSERT_LE(duty, 0.5F + allowed / 2);
      }
      both[out.saturated] = true;
    }
    EXPECT_TRUE(both[1]);
    EXPECT_EQ(both[0], allowed > 0.0F);
  }
}

TEST(DcCurrentController, WhatIsNotFiniteGivesNoVoltageAndAFaultAndLeavesNoTrace) {
  const float nan = std::nanf("");
  const float infinity = std::numeric_limits<float>::infinity();
  DcCurrentControllerConfig<float> config;
  config.torque_constant = 0.05F;
  const auto c = DcCurrentController<float>::prepare(config, 5e-5F);
  for (const float bad : {nan, infinity, -infinity}) {
    for (int input = 0; input < 4; ++input) {
      if (input == 3 && !std::isnan(bad)) continue;  // an infinite supply is not measured
      DcCurrentController<float> controller;
      for (int k = 0; k < 10; ++k) controller.update(c, 1.0F, 0.0F, 0.0F, 24.0F);
      float in[] = {1.0F, 0.5F, 10.0F, 24.0F};
      in[input] = bad;
      const auto out = controller.update(c, in[0], in[1], in[2], in[3]);
      EXPECT_TRUE(out.not_finite) << input << " " << bad;
      EXPECT_EQ(out.voltage, 0.0F);
      EXPECT_EQ(out.duty_b, 0.5F);
      EXPECT_EQ(out.duty_c, 0.5F);
      const auto next = controller.update(c, 0.0F, 0.0F, 0.0F, 24.0F);
      EXPECT_FALSE(next.not_finite);
      EXPECT_EQ(next.voltage, 0.0F) << "the integrator kept something";
    }
  }
  DcCurrentController<float> controller;
  EXPECT_TRUE(controller.update(c, 0.0F, 0.0F, 0.0F, 0.0F).not_finite) << "no supply";
  for (int field = 0; field < 3; ++field) {
    auto broken = c;
    (field == 0 ? broken.gains.proportional : field == 1 ? broken.gains.tracking : broken.back_emf) = nan;
    DcCurrentController<float> fresh;
    for (int k = 0; k < 5; ++k) {
      const auto out = fresh.update(broken, 1.0F, 0.0F, 1.0F, 24.0F);
      EXPECT_TRUE(std::isfinite(out.duty_b) && std::isfinite(out.voltage)) << field;
    }
  }
}

TEST(DcCurrentController, FloatFollowsDouble) {
  const DcMotor motor{.resistance = 1.2, .inductance = 2e-3, .torque_constant = 0.05};
  Loop<float> single(motor, 1500.0);
  Loop<double> wide(motor, 1500.0);
  for (int k = 0; k < 40'000; ++k) {
    const double reference = 3.0 * std::sin(0.01 * k) * std::sin(0.0003 * k);
    single.motor.speed = wide.motor.speed = 100.0 * std::sin(0.002 * k);
    ASSERT_NEAR(single.run(reference), wide.run(reference), 2e-5) << k;
  }
}

TEST(DcCurrentController, ResetEmptiesTheIntegrator) {
  Loop<double> loop({.resistance = 1.2, .inductance = 2e-3}, 1000.0);
  for (int k = 0; k < 1000; ++k) loop.run(2.0);
  loop.controller.reset();
  EXPECT_EQ(loop.controller.update(loop.c, 1.0, 1.0, 0.0, 24.0).voltage, 0.0);
}

}  // namespace
}  // namespace kmax::control
