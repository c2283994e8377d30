#include "host_tools/simulation/brushed_dc_motor.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace kmax::simulation::brushed_dc_motor_test {

TerminalDrive between(double u_b, double u_c, double leg_resistance = 0.0) {
  return {{0.0, u_b, u_c}, {false, true, true}, leg_resistance};
}

// di/dt of the header's equation, by classical Runge-Kutta in long double; the integral of i goes along.
struct Reference {
  long double current;
  long double integral;
};
Reference reference(const BrushedDcMotorConfig& m, double voltage, double speed, double series, double from,
                    double duration, int steps) {
  const long double h = static_cast<long double>(duration) / steps;
  const auto slope = [&](long double i) {
    return (static_cast<long double>(voltage) - (m.resistance + 2.0L * series) * i -
            static_cast<long double>(m.torque_constant) * speed) /
           m.inductance;
  };
  Reference state{from, 0.0L};
  for (int n = 0; n < steps; ++n) {
    const long double i = state.current;
    const long double k1 = slope(i), k2 = slope(i + 0.5L * h * k1), k3 = slope(i + 0.5L * h * k2),
                      k4 = slope(i + h * k3);
    // Simpson's rule with the middle value of the same method.
    state.current = i + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    state.integral += h / 6 * (i + 4 * (i + h / 4 * (k1 + 0.5L * (k2 + k3))) + state.current);
  }
  return state;
}

TEST(BrushedDcMotor, OneStepIsWhatAThousandSubstepsGive) {
  for (const double inductance : {5e-6, 50e-6, 0.5e-3, 50e-3}) {
    const BrushedDcMotorConfig config{1.3, inductance, 0.03};
    BrushedDcMotor motor(config);
    motor.advance(between(5.0, 1.0), {0.0, 0.0}, 1e-4);
    const double from = motor.current();
    motor.advance(between(20.0, 3.0, 0.01), {0.0, 150.0}, 25e-6);
    const Reference expected = reference(config, 17.0, 150.0, 0.01, from, 25e-6, 1000);
    EXPECT_NEAR(motor.current(), static_cast<double>(expected.current), 1e-9) << inductance;
    EXPECT_NEAR(motor.mean_currents()[terminal_b], static_cast<double>(expected.integral / 25e-6L), 1e-7)
        << inductance;
  }
}

TEST(BrushedDcMotor, SettlesAtVoltageLessBackEmfOverResistance) {
  BrushedDcMotor motor({2.0, 1e-3, 0.05});
  motor.advance(between(12.0, 2.0, 0.25), {0.0, 40.0}, 0.1);
  EXPECT_NEAR(motor.current(), (10.0 - 0.05 * 40.0) / 2.5, 1e-12);
  EXPECT_NEAR(motor.torque(), 0.05 * motor.current(), 1e-15);
  // Driven faster than the voltage allows it brakes.
  motor.advance(between(2.0, 0.0), {0.0, 100.0}, 0.1);
  EXPECT_NEAR(motor.current(), (2.0 - 5.0) / 2.0, 1e-12);
  EXPECT_EQ(motor.currents()[terminal_b], -motor.currents()[terminal_c]);
  EXPECT_EQ(motor.currents()[terminal_a], 0.0);
}

TEST(BrushedDcMotor, EnergyInIsHeatAndStoredAndMechanical) {
  const BrushedDcMotorConfig config{1.0, 0.5e-3, 0.03};
  BrushedDcMotor motor(config);
  double in = 0.0, heat = 0.0, mechanical = 0.0;
  constexpr double h = 1e-7;
  for (int n = 0; n < 20000; ++n) {
    const double voltage = n < 10000 ? 12.0 : -6.0, speed = 100.0;
    const double begin = motor.current();
    motor.advance(between(voltage, 0.0), {0.0, speed}, h);
    const double mean = motor.mean_currents()[terminal_b];
    in += voltage * mean * h;
    heat += config.resistance * h / 6 * (begin * begin + 4 * mean * mean + motor.current() * motor.current());
    mechanical += motor.mean_torque() * speed * h;
  }
  EXPECT_NEAR(in, heat + mechanical + motor.energy(), 1e-10);
  EXPECT_GT(heat, 1e-3);
}

TEST(BrushedDcMotor, AnOpenTerminalHasNoCurrentAtOnceAndStaysSo) {
  for (const std::size_t terminal : {terminal_b, terminal_c}) {
    BrushedDcMotor motor;
    motor.advance(between(10.0, 0.0), {}, 1e-3);
    ASSERT_GT(motor.current(), 1.0);
    motor.set_open(terminal, true);
    EXPECT_EQ(motor.current(), 0.0);
    motor.advance(between(10.0, 0.0), {}, 1e-3);
    EXPECT_EQ(motor.current(), 0.0);
    EXPECT_EQ(motor.mean_torque(), 0.0);
    motor.set_open(terminal, false);
    motor.advance(between(10.0, 0.0), {}, 1e-3);
    EXPECT_GT(motor.current(), 1.0);
  }
  BrushedDcMotor motor;
  motor.advance(between(10.0, 0.0), {}, 1e-3);
  motor.set_open(terminal_a, true);
  EXPECT_GT(motor.current(), 1.0) << "nothing is connected to A";
}

TEST(BrushedDcMotor, RefusesWhatIsNoMotor) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const BrushedDcMotorConfig& config :
       {BrushedDcMotorConfig{0.0, 1e-3, 0.1}, BrushedDcMotorConfig{1.0, 0.0, 0.1},
        BrushedDcMotorConfig{1.0, 1e-3, -0.1}, BrushedDcMotorConfig{nan, 1e-3, 0.1}}) {
    EXPECT_THROW(BrushedDcMotor{config}, std::invalid_argument);
  }
}

}  // namespace kmax::simulation::brushed_dc_motor_test
