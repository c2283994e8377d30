// The field-oriented controller's loops as a whole: bandwidth, the angle's advance, the edge of the voltage,
// and what a supply or a sensor can do to them. What one call returns is in
// field_oriented_controller_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "control/field_oriented_controller.hpp"
#include "tests/control/field_oriented_loop.hpp"
#include "tests/control/motor_winding.hpp"

namespace kmax::control::field_oriented_controller_at_speed_test {
namespace {

using test::AxisLoop;
using test::Belief;
using test::SynchronousMotor;
using test::tick;
using Loop = test::FieldOrientedLoop<double>;

// L/R from a fifth of a tick to a hundred ticks, salient ones among them.
constexpr SynchronousMotor motors[] = {
    {.resistance = 10.0, .inductance_d = 0.1e-3, .inductance_q = 0.1e-3},
    {.resistance = 0.5, .inductance_d = 0.05e-3, .inductance_q = 0.08e-3, .flux = 0.002},
    {.resistance = 0.5, .inductance_d = 1e-3, .inductance_q = 1e-3},
    {.resistance = 0.4, .inductance_d = 1.2e-3, .inductance_q = 2e-3}};

TEST(FieldOrientedControllerAtSpeed, BandwidthIsWhatWasAskedForAtRestAndAtSpeed) {
  for (const SynchronousMotor& motor : motors) {
    for (const double speed : {0.0, 700.0}) {
      for (const double asked : {200.0, 1000.0, 2500.0}) {
        for (const bool on_q : {false, true}) {
          AxisLoop axis{Loop(motor, asked), on_q};
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

TEST(FieldOrientedControllerAtSpeed, StaysStableWithResistanceAndInductancesWrongByAThird) {
  for (const SynchronousMotor& motor : motors) {
    for (const double hertz : {200.0, 2500.0}) {
      for (const double r : {0.7, 1.0, 1.3}) {
        for (const double l : {0.7, 1.0, 1.3}) {
          Loop loop(motor, hertz, Belief{r, l});
          loop.motor.electrical_speed = 500.0;
          double highest = 0.0;
          for (int k = 0; k < 4000; ++k) {
            loop.run(0.0, 0.5);
            if (k > 100) highest = std::max(highest, std::fabs(loop.motor.current_q));
          }
          EXPECT_LE(highest, 0.75) << motor.inductance_q << " H, " << hertz << " " << r << " " << l;
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

TEST(FieldOrientedControllerAtSpeed, TheVoltageIsWhereTheRotorWillBe) {
  for (const double speed : {-2490.0, -700.0, 0.0, 700.0, 1400.0, 2490.0}) {
    for (double angle = 0.0; angle < 6.28; angle += 0.1) {
      Loop loop({.angle = angle}, 1000.0);
      loop.motor.electrical_speed = speed;
      const double turn = speed * tick;
      const double middle = test::fraction_of(angle) * radians_per_turn_fraction<double> + turn;
      const auto in = loop.input(0.0, 0.0);
      const auto with = seen(Loop::Controller::voltage(loop.c, in, 3.0, -5.0), loop.supply, middle);
      const double error = std::hypot(with.d - 3.0, with.q + 5.0) / std::hypot(3.0, 5.0);
      EXPECT_LE(error, 0.55 * turn * turn + 1e-9) << speed;
      auto c = loop.c;
      c.half_advance = 0.0;
      const auto without = seen(Loop::Controller::voltage(c, in, 3.0, -5.0), loop.supply, middle);
      EXPECT_NEAR(std::hypot(without.d - 3.0, without.q + 5.0) / std::hypot(3.0, 5.0),
                  2.0 * std::fabs(std::sin(turn / 2)), 1e-9)
          << speed;
    }
  }
}

TEST(FieldOrientedControllerAtSpeed, TheAdvanceIsBoundedAndTheDutiesStayInTheirRange) {
  for (const double speed : {3000.0, 1e5, -1e9, 1e30}) {
    for (double angle = 0.0; angle < 6.28; angle += 0.05) {
      Loop loop({.angle = angle}, 1000.0);
      loop.config.modulation_limit = 1.0;
      loop.prepare();
      loop.motor.electrical_speed = speed;
      const auto out = Loop::Controller::voltage(loop.c, loop.input(0.0, 0.0), 10.0, 20.0);
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
TEST(FieldOrientedControllerAtSpeed, TheAdvanceKeepsTheAxesApart) {
  double disturbance[2] = {};
  for (int with = 0; with < 2; ++with) {
    Loop loop(motors[2], 1000.0);
    loop.supply = 48.0;
    loop.motor.electrical_speed = 1400.0;
    if (with == 0) loop.c.half_advance = 0.0;
    for (int k = 0; k < 4000; ++k) loop.run(0.0, 0.0);
    for (int k = 0; k < 200; ++k) {
      loop.run(0.0, 2.0);
      disturbance[with] = std::max(disturbance[with], std::fabs(loop.motor.current_d));
    }
  }
  EXPECT_LT(disturbance[1], 0.7 * disturbance[0]) << disturbance[0];
}

// With d = 0 the steady voltage is v_d = -w L_q i, v_q = R i + w flux; it reaches the circle's radius at the
// positive root w of w^2 (L_q^2 i^2 + flux^2) + 2 w R i flux + R^2 i^2 = radius^2.
TEST(FieldOrientedControllerAtSpeed, TheVoltageSaturatesAtTheSpeedOfTheClosedForm) {
  for (const double limit : {0.95, 0.88}) {
    for (const double current : {0.0, 2.0, 5.0}) {
      const SynchronousMotor motor{.resistance = 0.4, .inductance_d = 0.6e-3, .inductance_q = 0.9e-3};
      const double radius =
          24.0 * limit / std::sqrt(3.0) * Loop::Controller::circle_room;  // what the advance's length needs
      const double a = std::pow(motor.inductance_q * current, 2) + std::pow(motor.flux, 2);
      const double b = motor.resistance * current * motor.flux;
      const double c = std::pow(motor.resistance * current, 2) - radius * radius;
      const double expected = (-b + std::sqrt(b * b - a * c)) / a;
      double below = 0.5 * expected, above = 1.5 * expected;
      for (int step = 0; step < 12; ++step) {
        Loop loop(motor, 500.0);
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

TEST(FieldOrientedControllerAtSpeed, TheSupplyIsHalvedInMidStep) {
  for (const double hertz : {500.0, 2500.0}) {
    for (const double step : {1.0, 8.0}) {
      Loop loop(motors[2], hertz);
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

}  // namespace
}  // namespace kmax::control::field_oriented_controller_at_speed_test
