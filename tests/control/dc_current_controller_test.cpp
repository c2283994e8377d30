#include "control/dc_current_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "tests/control/dc_current_loop.hpp"
#include "tests/control/motor_winding.hpp"

namespace kmax::control::dc_current_controller_test {

using test::Belief;
using test::DcMotor;
template <typename Scalar>
using Loop = test::DcLoop<Scalar>;

// L/R from a fifth of a tick to a hundred ticks.
constexpr DcMotor motors[] = {{.resistance = 10.0, .inductance = 0.1e-3},
                              {.resistance = 8.0, .inductance = 0.4e-3},
                              {.resistance = 2.0, .inductance = 0.3e-3},
                              {.resistance = 1.2, .inductance = 2e-3},
                              {.resistance = 0.4, .inductance = 2e-3}};

TEST(DcCurrentController, BandwidthIsWhatWasAskedForAndOvershootStaysSmall) {
  for (const DcMotor& motor : motors) {
    for (const double asked : {200.0, 500.0, 1000.0, 2500.0}) {
      const Loop<double> loop(motor, asked);
      EXPECT_NEAR(test::bandwidth_of(loop) / asked, 1.0, 0.02) << motor.inductance << " H, " << asked;
      EXPECT_LE(test::overshoot_of(loop, 0.2), 0.08) << motor.inductance << " H, " << asked;
    }
  }
}

TEST(DcCurrentController, StaysStableWithResistanceAndInductanceWrongByAThird) {
  for (const DcMotor& motor : motors) {
    for (const double hertz : {200.0, 1000.0, 2500.0}) {
      for (const double r : {0.7, 1.0, 1.3}) {
        for (const double l : {0.7, 1.0, 1.3}) {
          Loop<double> loop(motor, hertz, Belief{r, l});
          EXPECT_LE(test::overshoot_of(loop, 0.2), 0.25)
              << motor.inductance << " H, " << hertz << " " << r << " " << l;
          for (int k = 0; k < 4000; ++k) loop.run(0.2);
          EXPECT_NEAR(loop.motor.current, 0.2, 1e-6) << motor.inductance << " H, " << hertz;
        }
      }
    }
  }
}

// The supply falls to a half while the current rises: the loop gain in amperes per ampere stays, and the
// limit moves with the supply.
TEST(DcCurrentController, TheSupplyIsHalvedInMidStep) {
  for (const double hertz : {500.0, 2500.0}) {
    for (const double step : {1.0, 8.0}) {  // 1 A: never saturated; 8 A: 9.6 V of the 11.4 that are left
      Loop<double> loop(motors[3], hertz);
      double highest = 0.0;
      for (int k = 0; k < 4000; ++k) {
        if (k == 5) loop.supply = 12.0;
        highest = std::max(highest, loop.run(step));
        ASSERT_LE(std::fabs(static_cast<double>(loop.out.duty_b - loop.out.duty_c)), 0.95 + 1e-12);
      }
      EXPECT_LE(highest, 1.08 * step) << hertz;
      EXPECT_NEAR(loop.motor.current, step, 1e-6) << hertz;
    }
  }
}

TEST(DcCurrentController, TheDeadTimesShareFollowsTheReferenceWithinTheLimitsOfTheDuties) {
  Loop<double> loop(motors[3], 1000.0);
  const auto plain = loop.controller.update(loop.c, 1.0, 0.9, 0.0, 24.0);
  loop.config.dead_time = 1e-6;  // 2 % of the period
  loop.config.dead_time_current = 0.1;
  loop.prepare();
  for (const double reference : {-1.0, -0.05, 0.0, 0.05, 1.0}) {
    DcCurrentController<double> with, without;
    auto off = loop.c;
    off.dead_time = {};
    const auto a = with.update(loop.c, reference, reference, 0.0, 24.0);
    const auto b = without.update(off, reference, reference, 0.0, 24.0);
    EXPECT_NEAR(a.duty_b - b.duty_b, 0.02 * std::clamp(reference / 0.1, -1.0, 1.0), 1e-12) << reference;
    EXPECT_NEAR(a.duty_c - b.duty_c, -0.02 * std::clamp(reference / 0.1, -1.0, 1.0), 1e-12) << reference;
    EXPECT_EQ(a.voltage, b.voltage);
  }
  EXPECT_GT(plain.voltage, 0.0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int k = 0; k < 20'000; ++k) {
    const auto out = loop.controller.update(loop.c, 4.0 * unit(random), 4.0 * unit(random), 0.0, 24.0);
    ASSERT_LE(std::fabs(out.duty_b - 0.5), 0.475 + 1e-12);
    ASSERT_LE(std::fabs(out.duty_c - 0.5), 0.475 + 1e-12);
  }
}

TEST(DcCurrentController, AnOpenLoopVoltageHasTheSameLimitsAndTheSameFault) {
  const Loop<float> loop(motors[3], 1000.0);
  using Controller = DcCurrentController<float>;
  const auto inside = Controller::voltage(loop.c, 6.0F, 24.0F);
  EXPECT_FALSE(inside.saturated);
  EXPECT_EQ(inside.voltage, 6.0F);
  EXPECT_NEAR(inside.duty_b, 0.625F, 1e-7F);
  EXPECT_NEAR(inside.duty_c, 0.375F, 1e-7F);
  for (const float sign : {1.0F, -1.0F}) {
    const auto beyond = Controller::voltage(loop.c, sign * 30.0F, 24.0F);
    EXPECT_TRUE(beyond.saturated);
    EXPECT_NEAR(beyond.voltage, sign * 0.95F * 24.0F, 1e-5F);
    EXPECT_NEAR(beyond.duty_b, 0.5F + sign * 0.475F, 1e-6F);
  }
  const float nan = std::nanf("");
  const float infinity = std::numeric_limits<float>::infinity();
  for (const auto& [voltage, supply] :
       {std::pair{nan, 24.0F}, {infinity, 24.0F}, {1.0F, nan}, {1.0F, 0.0F}, {0.0F, 0.0F}}) {
    const auto out = Controller::voltage(loop.c, voltage, supply);
    EXPECT_TRUE(out.not_finite) << voltage << " " << supply;
    EXPECT_EQ(out.duty_b, 0.5F);
    EXPECT_EQ(out.voltage, 0.0F);
  }
}

TEST(DcCurrentController, AWindingThatSettlesWithinATickIsControlledAsWell) {
  for (const double inductance : {4e-4, 1e-4, 1e-5, 0.0}) {  // L/R: 40, 10, 1, 0 us
    for (const double hertz : {200.0, 1000.0, 2500.0}) {
      Loop<double> loop({.resistance = 10.0, .inductance = inductance}, hertz);
      EXPECT_LE(test::overshoot_of(loop, 0.5), 0.08) << inductance << " " << hertz;
      for (int k = 0; k < 2000; ++k) loop.run(0.5);
      EXPECT_NEAR(loop.motor.current, 0.5, 1e-9) << inductance << " " << hertz;
    }
  }
}

TEST(DcCurrentController, NoSteadyErrorWithAWrongBackEmfAndWrongResistance) {
  DcMotor motor{.resistance = 1.2, .inductance = 2e-3, .torque_constant = 0.05};
  motor.speed = 120.0;
  Loop<double> loop(motor, 1000.0, Belief{0.7, 1.0, 0.5});
  for (int k = 0; k < 20'000; ++k) loop.run(1.0);
  EXPECT_NEAR(loop.motor.current, 1.0, 1e-9);
  Loop<float> single(motor, 1000.0, Belief{0.7, 1.0, 0.5});
  for (int k = 0; k < 20'000; ++k) single.run(1.0);
  EXPECT_NEAR(single.motor.current, 1.0, 1e-5);
}

TEST(DcCurrentController, TheFeedForwardKeepsASpeedStepOutOfTheCurrent) {
  const DcMotor motor{.resistance = 1.2, .inductance = 2e-3, .torque_constant = 0.05};
  double disturbed[2] = {};
  for (int with = 0; with < 2; ++with) {
    Loop<double> loop(motor, 500.0, Belief{1.0, 1.0, static_cast<double>(with)});
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

}  // namespace kmax::control::dc_current_controller_test
