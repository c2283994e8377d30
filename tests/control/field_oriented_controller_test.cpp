#include "control/field_oriented_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "tests/control/field_oriented_loop.hpp"
#include "tests/control/motor_winding.hpp"

namespace kmax::control::field_oriented_controller_test {

using test::Belief;
using test::SynchronousMotor;
using test::tick;
template <typename Scalar>
using Loop = test::FieldOrientedLoop<Scalar>;

// The largest magnitude of the current's `part` while the loop runs for so many ticks.
double largest(Loop<double>& loop, int ticks, double reference_d, double reference_q,
               double SynchronousMotor::*part, double around = 0.0) {
  double most = 0.0;
  for (int k = 0; k < ticks; ++k) {
    loop.run(reference_d, reference_q);
    most = std::max(most, std::fabs(loop.motor.*part - around));
  }
  return most;
}

TEST(FieldOrientedController, MeasuresTheCurrentsInTheRotorsFrame) {
  for (const double angle : {0.0, 0.3, 2.0, 4.5, 6.2}) {
    Loop<double> loop({}, 500.0);
    loop.motor.angle = angle;
    loop.motor.current_d = -1.25;
    loop.motor.current_q = 0.75;
    loop.run(0.0, 0.0);
    EXPECT_NEAR(loop.out.current_d, -1.25, 1e-8) << angle;
    EXPECT_NEAR(loop.out.current_q, 0.75, 1e-8) << angle;
  }
}

// At rest both axes are the DC controller's loop: the request is met without overshoot up to 1 kHz.
TEST(FieldOrientedController, StepsOfBothAxesAreFastAndDoNotDisturbTheOther) {
  struct Case {
    double hertz, overshoot;
    int ticks_to_90_percent;
  };
  for (const Case& test : {Case{200.0, 2e-3, 44}, Case{1000.0, 2e-3, 12}, Case{2500.0, 0.08, 6}}) {
    for (const bool on_q : {false, true}) {
      Loop<double> loop({.angle = 1.0}, test.hertz);
      double highest = 0.0;
      double other = 0.0;
      int reached = -1;
      for (int k = 0; k < 1000; ++k) {
        loop.run(on_q ? 0.0 : 1.0, on_q ? 1.0 : 0.0);
        const double stepped = on_q ? loop.motor.current_q : loop.motor.current_d;
        highest = std::max(highest, stepped);
        other = std::max(other, std::fabs(on_q ? loop.motor.current_d : loop.motor.current_q));
        if (reached < 0 && stepped > 0.9) reached = k + 1;
      }
      EXPECT_FALSE(loop.out.saturated);
      EXPECT_LE(highest, 1.0 + test.overshoot) << test.hertz;
      EXPECT_LE(reached, test.ticks_to_90_percent) << test.hertz;
      EXPECT_LE(other, 1e-6) << test.hertz;
    }
  }
}

// Turning fast, with saliency: without the decoupling the d axis would be disturbed several times as much.
TEST(FieldOrientedController, DecouplingKeepsTheAxesApartAtSpeed) {
  double disturbance[2] = {};
  for (int decoupled = 0; decoupled < 2; ++decoupled) {
    Loop<double> loop({.inductance_d = 0.8e-3, .inductance_q = 1.4e-3, .electrical_speed = 700.0}, 400.0);
    if (decoupled == 0) loop.c.inductance_d = loop.c.inductance_q = 0.0;
    for (int k = 0; k < 4000; ++k) loop.run(0.0, 0.0);
    disturbance[decoupled] = largest(loop, 400, 0.0, 3.0, &SynchronousMotor::current_d);
  }
  EXPECT_LT(disturbance[1], 0.35 * disturbance[0]);
  EXPECT_LT(disturbance[1], 0.25);
}

// With nothing to correct and empty integrators the voltage is the feed-forward alone.
TEST(FieldOrientedController, EachAxisIsDecoupledWithTheOthersInductance) {
  Loop<double> loop({.inductance_d = 0.5e-3,
                     .inductance_q = 0.9e-3,
                     .electrical_speed = 400.0,
                     .angle = 0.6,
                     .current_d = -2.0,
                     .current_q = 3.0},
                    500.0);
  loop.run(-2.0, 3.0);
  EXPECT_NEAR(loop.out.voltage_d, -400.0 * 0.9e-3 * 3.0, 1e-6);
  EXPECT_NEAR(loop.out.voltage_q, 400.0 * (0.5e-3 * -2.0 + 0.01), 1e-6);
}

TEST(FieldOrientedController, TheFeedForwardOfTheFluxKeepsASpeedStepOutOfTheCurrent) {
  double disturbed[2] = {};
  for (int with = 0; with < 2; ++with) {
    Loop<double> loop({}, 500.0, Belief{1.0, 1.0, static_cast<double>(with)});
    for (int k = 0; k < 2000; ++k) loop.run(0.0, 0.5);
    loop.motor.electrical_speed = 500.0;  // 5 V
    disturbed[with] = largest(loop, 200, 0.0, 0.5, &SynchronousMotor::current_q, 0.5);
  }
  EXPECT_LT(disturbed[1], 0.2 * disturbed[0]);
}

TEST(FieldOrientedController, NoSteadyErrorWithWrongParametersAtSpeed) {
  for (const double speed : {-700.0, 0.0, 300.0}) {
    for (const double r : {0.7, 1.3}) {
      for (const double l : {0.7, 1.3}) {
        Loop<double> loop({.electrical_speed = speed}, 1500.0, Belief{r, l, 0.6});
        for (int k = 0; k < 8000; ++k) loop.run(-0.5, 2.0);
        EXPECT_NEAR(loop.motor.current_d, -0.5, 2e-3) << speed << " " << r << " " << l;
        EXPECT_NEAR(loop.motor.current_q, 2.0, 2e-3) << speed << " " << r << " " << l;
      }
    }
  }
}

TEST(FieldOrientedController, AWindingThatSettlesWithinATickIsControlledAsWell) {
  Loop<double> loop({.resistance = 10.0, .inductance_d = 1e-4, .inductance_q = 1e-4}, 2500.0);
  EXPECT_LE(largest(loop, 500, 0.0, 0.4, &SynchronousMotor::current_q), 0.45);
  EXPECT_NEAR(loop.motor.current_q, 0.4, 1e-6);
}

TEST(FieldOrientedController, TheDAxisIsServedFirst) {
  // 20 V of back-EMF alone are more than the 13 V there are: a field weakening of -8 A must still be held.
  Loop<double> loop({.electrical_speed = 2000.0}, 500.0);
  for (int k = 0; k < 4000; ++k) loop.run(-8.0, 5.0);
  EXPECT_TRUE(loop.out.saturated);
  EXPECT_NEAR(loop.motor.current_d, -8.0, 0.4);
  EXPECT_LT(loop.motor.current_q, 4.5) << "there was room for all of it: nothing was tested";
  const double length = std::hypot(loop.out.voltage_d, loop.out.voltage_q);
  EXPECT_NEAR(length, 24.0 * 0.95 / std::sqrt(3.0) * FieldOrientedController<double>::circle_room, 1e-3);
}

TEST(FieldOrientedController, TheCircleIsNeverLeftAndVoltagesAreThoseOfTheDuties) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(-1.0F, 1.0F);
  for (const float limit : {0.95F, 0.3F, 1.0F, 0.0F, 3.0F}) {
    FieldOrientedControllerConfig<float> config;
    config.modulation_limit = limit;
    config.torque_constant = 0.05F;
    config.pole_pairs = 7;
    const auto c = FieldOrientedController<float>::prepare(config, 5e-5F);
    FieldOrientedController<float> controller;
    const float allowed = std::min(limit, 1.0F);
    int saturated = 0;
    int inside = 0;
    for (int k = 0; k < 20'000; ++k) {
      const float size = k % 3 == 0 ? 30.0F : 0.5F;
      const float supply = 24.0F + 12.0F * unit(random);
      const auto angle = static_cast<TurnFraction>(random());
      const float speed = k % 2 == 0 ? 0.0F : 500.0F * unit(random);
      const double tolerance = k % 2 == 0 ? 1e-3 : 1.3e-2;  // at speed the advance's p^2/2
      const auto out = controller.update(c, {.angle = angle,
                                             .current_b = size * unit(random),
                                             .current_c = size * unit(random),
                                             .electrical_speed = speed,
                                             .reference_d = size * unit(random),
                                             .reference_q = size * unit(random),
                                             .supply = supply});
      ASSERT_FALSE(out.not_finite);
      const std::array<float, 3> duties = {out.duty_a, out.duty_b, out.duty_c};
      // Min-max: centred, so that the largest and the smallest are equally far from the rails.
      const auto [least, most] = std::minmax_element(duties.begin(), duties.end());
      ASSERT_GE(*least, std::max(0.5F - allowed / 2, 0.0F));
      ASSERT_LE(*most, std::min(0.5F + allowed / 2, 1.0F));
      ASSERT_NEAR(*least + *most, 1.0F, 3e-7F);
      // The voltages between the phases are those of the inverse transformations where the rotor will be.
      const double ahead = static_cast<double>(speed) * tick;
      const auto [sine, cosine] = sine_cosine<double>(
          angle + static_cast<TurnFraction>(std::llround(ahead / radians_per_turn_fraction<double>)));
      const double alpha =
          static_cast<double>(out.voltage_d) * cosine - static_cast<double>(out.voltage_q) * sine;
      const double beta =
          static_cast<double>(out.voltage_d) * sine + static_cast<double>(out.voltage_q) * cosine;
      const double b = -alpha / 2 + std::sqrt(3.0) / 2 * beta;
      const double to_c = -alpha / 2 - std::sqrt(3.0) / 2 * beta;
      ASSERT_NEAR(static_cast<double>((out.duty_a - out.duty_b) * supply), alpha - b, tolerance);
      ASSERT_NEAR(static_cast<double>((out.duty_b - out.duty_c) * supply), b - to_c, tolerance);
      ASSERT_LE(std::hypot(out.voltage_d, out.voltage_q), allowed * supply / std::sqrt(3.0F) * 1.000001F);
      ++(out.saturated ? saturated : inside);
    }
    EXPECT_GT(saturated, 1000);
    if (allowed > 0.0F) {
      EXPECT_GT(inside, 1000);
    }
  }
}

TEST(FieldOrientedController, LeavesSaturationWithoutWindUp) {
  for (const double sign : {1.0, -1.0}) {
    Loop<double> loop({.electrical_speed = 300.0}, 1000.0);
    for (int k = 0; k < 20'000; ++k) {
      loop.run(0.0, sign * 200.0);
      ASSERT_TRUE(loop.out.saturated);
    }
    int ticks = 0;
    while (std::fabs(loop.motor.current_q - sign) > 0.05 && ticks < 1000) {
      loop.run(0.0, sign * 1.0);
      ++ticks;
    }
    EXPECT_LE(ticks, 60);
    for (int k = 0; k < 400; ++k) {
      loop.run(0.0, sign * 1.0);
      ASSERT_NEAR(loop.motor.current_q, sign, 0.25) << k;
    }
    EXPECT_NEAR(loop.motor.current_q, sign, 1e-3);
    EXPECT_NEAR(loop.motor.current_d, 0.0, 1e-3);
  }
}

TEST(FieldOrientedController, WhatIsNotFiniteGivesNoVoltageAndAFaultAndLeavesNoTrace) {
  using Controller = FieldOrientedController<float>;
  FieldOrientedControllerConfig<float> config;
  config.torque_constant = 0.05F;
  const auto c = Controller::prepare(config, 5e-5F);
  const Controller::Input usual = {.angle = 0x23456789U,
                                   .current_b = 0.1F,
                                   .current_c = 0.2F,
                                   .electrical_speed = 100.0F,
                                   .reference_d = 0.1F,
                                   .reference_q = 0.5F,
                                   .supply = 24.0F};
  const std::array<float Controller::Input::*, 6> inputs = {
      &Controller::Input::current_b,   &Controller::Input::current_c,   &Controller::Input::electrical_speed,
      &Controller::Input::reference_d, &Controller::Input::reference_q, &Controller::Input::supply};
  for (const float bad :
       {std::nanf(""), std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()}) {
    for (const auto input : inputs) {
      if (input == &Controller::Input::supply && !std::isnan(bad))
        continue;  // an infinite supply is not measured
      Controller controller;
      for (int k = 0; k < 10; ++k) controller.update(c, usual);
      auto in = usual;
      in.*input = bad;
      const auto out = controller.update(c, in);
      EXPECT_TRUE(out.not_finite);
      for (const float duty : {out.duty_a, out.duty_b, out.duty_c}) EXPECT_EQ(duty, 0.5F);
      EXPECT_EQ(std::hypot(out.voltage_d, out.voltage_q), 0.0F);
      const auto next = controller.update(c, {.supply = 24.0F});
      EXPECT_FALSE(next.not_finite);
      EXPECT_EQ(std::hypot(next.voltage_d, next.voltage_q), 0.0F) << "an integrator kept something";
    }
  }
  auto without_supply = usual;
  without_supply.supply = 0.0F;
  Controller controller;
  EXPECT_TRUE(controller.update(c, without_supply).not_finite);
}

TEST(FieldOrientedController, ReferencesOfThePhasesAreThoseOfTheRotorsFrame) {
  for (const double angle : {0.0, 0.7, 2.0, 3.9, 6.2}) {
    Loop<double> loop({.electrical_speed = 500.0, .angle = angle}, 1000.0);
    const auto made = FieldOrientedController<double>::phase_references(loop.input(-0.75, 1.5));
    for (const auto& [phase, value] : {std::pair{0, made.a}, {1, made.b}, {2, made.c}}) {
      const double place = angle - 2.0943951023931953 * phase;
      EXPECT_NEAR(value, -0.75 * std::cos(place) - 1.5 * std::sin(place), 1e-8) << angle << " " << phase;
    }
  }
}

TEST(FieldOrientedController, TheDeadTimesShareFollowsThePhasesReferencesWithinTheLimitsOfTheDuties) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Loop<double> loop({}, 1000.0);
  loop.config.dead_time = 1e-6;  // 2 % of the period
  loop.config.dead_time_current = 0.2;
  loop.prepare();
  int saturated = 0;
  for (int k = 0; k < 20'000; ++k) {
    loop.motor.angle = 3.14 * (1.0 + unit(random));
    loop.motor.current_q = (k % 4 == 0 ? 20.0 : 0.2) * unit(random);
    const auto in = loop.input(0.2 * unit(random), (k % 4 == 0 ? 20.0 : 0.2) * unit(random));
    auto off = loop.c;
    off.dead_time = {};
    FieldOrientedController<double> with, without;
    const auto a = with.update(loop.c, in);
    const auto b = without.update(off, in);
    for (const double duty : {a.duty_a, a.duty_b, a.duty_c}) ASSERT_LE(std::fabs(duty - 0.5), 0.475 + 1e-12);
    const auto share = [&](double reference) {
      return a.saturated ? 0.0 : 0.02 * std::clamp(reference / 0.2, -1.0, 1.0);
    };
    const auto reference = FieldOrientedController<double>::phase_references(in);
    ASSERT_NEAR(a.duty_a - b.duty_a, share(reference.a), 1e-12);
    ASSERT_NEAR(a.duty_b - b.duty_b, share(reference.b), 1e-12);
    ASSERT_NEAR(a.duty_c - b.duty_c, share(reference.c), 1e-12);
    saturated += a.saturated ? 1 : 0;
  }
  EXPECT_GT(saturated, 100);
  EXPECT_LT(saturated, 15'000);
}

TEST(FieldOrientedController, AnOpenLoopVoltageHasTheSameLimitsAndTheSameFault) {
  Loop<float> loop({.angle = 1.0}, 1000.0);
  using Controller = FieldOrientedController<float>;
  loop.motor.current_q = 0.5;
  const auto in = loop.input(7.0, 7.0);
  const auto inside = Controller::voltage(loop.c, in, -2.0F, 3.0F);
  EXPECT_FALSE(inside.saturated || inside.not_finite);
  EXPECT_EQ(inside.voltage_d, -2.0F);
  EXPECT_EQ(inside.voltage_q, 3.0F);
  EXPECT_NEAR(inside.current_q, 0.5F, 2e-5F);
  const auto beyond = Controller::voltage(loop.c, in, -5.0F, 40.0F);
  EXPECT_TRUE(beyond.saturated);
  EXPECT_NEAR(beyond.voltage_d, -5.0F, 1e-5F) << "the d axis is served first";
  EXPECT_NEAR(std::hypot(beyond.voltage_d, beyond.voltage_q),
              24.0F * 0.95F / std::sqrt(3.0F) * Controller::circle_room, 1e-4F);
  EXPECT_NEAR(Controller::voltage(loop.c, in, -50.0F, 40.0F).voltage_q, 0.0F, 1e-6F);
  const float nan = std::nanf("");
  for (const float bad : {nan, std::numeric_limits<float>::infinity()}) {
    EXPECT_TRUE(Controller::voltage(loop.c, in, bad, 0.0F).not_finite);
    EXPECT_TRUE(Controller::voltage(loop.c, in, 0.0F, bad).not_finite);
    for (const auto input : {&Controller::Input::current_b, &Controller::Input::current_c,
                             &Controller::Input::electrical_speed}) {
      auto broken = in;
      broken.*input = bad;
      const auto out = Controller::voltage(loop.c, broken, 1.0F, 1.0F);
      EXPECT_TRUE(out.not_finite);
      EXPECT_EQ(out.duty_a, 0.5F);
    }
  }
  auto without_supply = in;
  without_supply.supply = 0.0F;
  EXPECT_TRUE(Controller::voltage(loop.c, without_supply, 0.0F, 0.0F).not_finite);
}

TEST(FieldOrientedController, FloatFollowsDouble) {
  const SynchronousMotor motor{.inductance_d = 0.8e-3, .inductance_q = 1.2e-3};
  Loop<float> single(motor, 1500.0);
  Loop<double> wide(motor, 1500.0);
  for (int k = 0; k < 20'000; ++k) {
    single.motor.electrical_speed = wide.motor.electrical_speed = 600.0 * std::sin(0.002 * k);
    const double reference = 3.0 * std::sin(0.01 * k) * std::sin(0.0003 * k);
    single.run(-0.2, reference);
    wide.run(-0.2, reference);
    ASSERT_NEAR(single.motor.current_d, wide.motor.current_d, 1e-4) << k;
    ASSERT_NEAR(single.motor.current_q, wide.motor.current_q, 1e-4) << k;
  }
}

// A positive q current drives in the direction in which the angle grows: with it the motor takes up power.
TEST(FieldOrientedController, PositiveTorqueIsInTheDirectionOfGrowingAngle) {
  Loop<double> loop({.electrical_speed = 200.0}, 1000.0);
  for (int k = 0; k < 2000; ++k) loop.run(0.0, 1.0);
  EXPECT_NEAR(loop.out.voltage_q, 0.5 * 1.0 + 200.0 * 0.01, 0.05);
}

// L/R from a fifth of a tick to a hundred ticks, salient ones among them.
constexpr SynchronousMotor motors[] = {
    {.resistance = 10.0, .inductance_d = 0.1e-3, .inductance_q = 0.1e-3},
    {.resistance = 0.5, .inductance_d = 0.05e-3, .inductance_q = 0.08e-3, .flux = 0.002},
    {.resistance = 0.5, .inductance_d = 1e-3, .inductance_q = 1e-3},
    {.resistance = 0.4, .inductance_d = 1.2e-3, .inductance_q = 2e-3}};

TEST(FieldOrientedController, BandwidthIsWhatWasAskedForAtRestAndAtSpeed) {
  for (const SynchronousMotor& motor : motors) {
    for (const double speed : {0.0, 700.0}) {
      for (const double asked : {200.0, 1000.0, 2500.0}) {
        for (const bool on_q : {false, true}) {
          test::AxisLoop axis{Loop<double>(motor, asked), on_q};
          axis.loop.supply = 48.0;
          axis.loop.motor.electrical_speed = speed;
          EXPECT_NEAR(test::bandwidth_of(axis, 0.8 * asked) / asked, 1.0, 0.1)
              << motor.inductance_q << " H, " << speed << " rad/s, " << asked << " Hz, " << on_q;
          for (int k = 0; k < 2000; ++k) axis.run(0.0);  // let the back-EMF's first ticks go by
          EXPECT_LE(test::overshoot_of(axis, 0.5), 0.08)
              << motor.inductance_q << " H, " << speed << " rad/s, " << asked << " Hz, " << on_q;
        }
      }
    }
  }
}

TEST(FieldOrientedController, StaysStableWithResistanceAndInductancesWrongByAThird) {
  for (const SynchronousMotor& motor : motors) {
    for (const double hertz : {200.0, 2500.0}) {
      for (const double r : {0.7, 1.0, 1.3}) {
        for (const double l : {0.7, 1.0, 1.3}) {
          Loop<double> loop(motor, hertz, Belief{r, l});
          loop.motor.electrical_speed = 500.0;
          for (int k = 0; k <= 100; ++k) loop.run(0.0, 0.5);
          EXPECT_LE(largest(loop, 3899, 0.0, 0.5, &SynchronousMotor::current_q), 0.75)
              << motor.inductance_q << " H, " << hertz << " " << r << " " << l;
          EXPECT_NEAR(loop.motor.current_q, 0.5, 2e-3) << motor.inductance_q << " H, " << hertz;
          EXPECT_NEAR(loop.motor.current_d, 0.0, 2e-3) << motor.inductance_q << " H, " << hertz;
        }
      }
    }
  }
}

// The voltage that the duties make, seen from the rotor in the middle of the time in which they are active.
struct Seen {
  double d, q;
};
Seen seen(const FieldOrientedController<double>::Output& out, double supply, double angle) {
  const double alpha = (2 * out.duty_a - out.duty_b - out.duty_c) / 3 * supply;
  const double beta = (out.duty_b - out.duty_c) / std::sqrt(3.0) * supply;
  return {alpha * std::cos(angle) + beta * std::sin(angle), beta * std::cos(angle) - alpha * std::sin(angle)};
}

TEST(FieldOrientedController, TheVoltageIsWhereTheRotorWillBe) {
  for (const double speed : {-2490.0, -700.0, 0.0, 700.0, 1400.0, 2490.0}) {
    for (double angle = 0.0; angle < 6.28; angle += 0.1) {
      Loop<double> loop({.angle = angle}, 1000.0);
      loop.motor.electrical_speed = speed;
      const double turn = speed * tick;
      const double middle = test::fraction_of(angle) * radians_per_turn_fraction<double> + turn;
      const auto in = loop.input(0.0, 0.0);
      const auto with =
          seen(FieldOrientedController<double>::voltage(loop.c, in, 3.0, -5.0), loop.supply, middle);
      const double error = std::hypot(with.d - 3.0, with.q + 5.0) / std::hypot(3.0, 5.0);
      EXPECT_LE(error, 0.55 * turn * turn + 1e-9) << speed;
      auto c = loop.c;
      c.half_advance = 0.0;
      const auto without =
          seen(FieldOrientedController<double>::voltage(c, in, 3.0, -5.0), loop.supply, middle);
      EXPECT_NEAR(std::hypot(without.d - 3.0, without.q + 5.0) / std::hypot(3.0, 5.0),
                  2.0 * std::fabs(std::sin(turn / 2)), 1e-9)
          << speed;
    }
  }
}

TEST(FieldOrientedController, TheAdvanceIsBoundedAndTheDutiesStayInTheirRange) {
  for (const double speed : {3000.0, 1e5, -1e9, 1e30}) {
    for (double angle = 0.0; angle < 6.28; angle += 0.05) {
      Loop<double> loop({.angle = angle}, 1000.0);
      loop.config.modulation_limit = 1.0;
      loop.prepare();
      loop.motor.electrical_speed = speed;
      const auto out = FieldOrientedController<double>::voltage(loop.c, loop.input(0.0, 0.0), 10.0, 20.0);
      EXPECT_TRUE(out.saturated);
      const auto [d, q] = seen(out, loop.supply, angle + std::copysign(0.125, speed));
      // 1e30 rad/s: the bound drowns in the speed, and nothing is advanced.
      if (speed < 1e20) {
        EXPECT_NEAR(std::hypot(d - out.voltage_d, q - out.voltage_q) / std::hypot(d, q), 0.0, 8.5e-3)
            << speed;
      }
      for (const double duty : {out.duty_a, out.duty_b, out.duty_c}) {
        EXPECT_GE(duty, 0.0);
        EXPECT_LE(duty, 1.0);
      }
    }
  }
}

// What it is good for: with a voltage that lags, a step of the q current disturbs the d current at speed.
TEST(FieldOrientedController, TheAdvanceKeepsTheAxesApart) {
  double disturbance[2] = {};
  for (int with = 0; with < 2; ++with) {
    Loop<double> loop(motors[2], 1000.0);
    loop.supply = 48.0;
    loop.motor.electrical_speed = 1400.0;
    if (with == 0) loop.c.half_advance = 0.0;
    for (int k = 0; k < 4000; ++k) loop.run(0.0, 0.0);
    disturbance[with] = largest(loop, 200, 0.0, 2.0, &SynchronousMotor::current_d);
  }
  EXPECT_LT(disturbance[1], 0.7 * disturbance[0]) << disturbance[0];
}

// With d = 0 the steady voltage is v_d = -w L_q i, v_q = R i + w flux; it reaches the circle's radius at the
// positive root w of w^2 (L_q^2 i^2 + flux^2) + 2 w R i flux + R^2 i^2 = radius^2.
TEST(FieldOrientedController, TheVoltageSaturatesAtTheSpeedOfTheClosedForm) {
  for (const double limit : {0.95, 0.88}) {
    for (const double current : {0.0, 2.0, 5.0}) {
      const SynchronousMotor motor{.resistance = 0.4, .inductance_d = 0.6e-3, .inductance_q = 0.9e-3};
      const double radius = 24.0 * limit / std::sqrt(3.0) *
                            FieldOrientedController<double>::circle_room;  // what the advance's length needs
      const double a = std::pow(motor.inductance_q * current, 2) + std::pow(motor.flux, 2);
      const double b = motor.resistance * current * motor.flux;
      const double c = std::pow(motor.resistance * current, 2) - radius * radius;
      const double expected = (-b + std::sqrt(b * b - a * c)) / a;
      double below = 0.5 * expected, above = 1.5 * expected;
      for (int step = 0; step < 12; ++step) {
        Loop<double> loop(motor, 500.0);
        loop.config.modulation_limit = limit;
        loop.prepare();
        loop.motor.electrical_speed = 0.5 * (below + above);
        int saturated = 0;
        for (int k = 0; k < 3000; ++k) {
          loop.run(0.0, current);
          if (k >= 2900) saturated += loop.out.saturated ? 1 : 0;
        }
        (saturated > 50 ? above : below) = loop.motor.electrical_speed;
      }
      EXPECT_NEAR(below / expected, 1.0, 0.01) << limit << " " << current;
    }
  }
}

TEST(FieldOrientedController, TheSupplyIsHalvedInMidStep) {
  for (const double hertz : {500.0, 2500.0}) {
    for (const double step : {1.0, 8.0}) {
      Loop<double> loop(motors[2], hertz);
      loop.motor.electrical_speed = 200.0;
      double highest = 0.0;
      for (int k = 0; k < 4000; ++k) {
        if (k == 4) loop.supply = 12.0;
        loop.run(0.0, step);
        highest = std::max(highest, loop.motor.current_q);
        ASSERT_LE(std::hypot(loop.out.voltage_d, loop.out.voltage_q),
                  loop.supply * 0.95 / std::sqrt(3.0) + 1e-9);
      }
      EXPECT_LE(highest, 1.08 * step) << hertz;
      EXPECT_NEAR(loop.motor.current_q, step, 1e-3 * step) << hertz;
      EXPECT_NEAR(loop.motor.current_d, 0.0, 2e-3 * step) << hertz;
    }
  }
}

}  // namespace kmax::control::field_oriented_controller_test
