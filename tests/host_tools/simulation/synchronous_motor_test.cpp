#include "host_tools/simulation/synchronous_motor.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/host_tools/simulation/reference_synchronous_motor.hpp"

namespace kmax::simulation::synchronous_motor_test {

constexpr double pi = 3.141592653589793;

SynchronousMotorConfig salient() {
  return SynchronousMotorConfig{.inductance_d = 0.2e-3, .inductance_q = 0.45e-3, .electrical_offset = 0.7};
}

TerminalDrive driven(const double (&u)[3], double leg_resistance = 0.0) {
  return {{u[0], u[1], u[2]}, {true, true, true}, leg_resistance};
}

// Voltages that hold this dq current at standstill.
TerminalDrive holding(const SynchronousMotorConfig& config, double angle, double d, double q) {
  const double e = config.pole_pairs * angle + config.electrical_offset;
  TerminalDrive drive{{}, {true, true, true}, 0.0};
  for (std::size_t k = 0; k < 3; ++k) {
    const double phase = e - static_cast<double>(k) * 2.0 * pi / 3.0;
    drive.voltage[k] = 12.0 + config.resistance * (d * std::cos(phase) - q * std::sin(phase));
  }
  return drive;
}

void expect_like_reference(const SynchronousMotorConfig& config, std::size_t open, double speed,
                           double duration, double tolerance, double torque_tolerance = 5e-8) {
  SynchronousMotor motor(config);
  ReferenceSynchronousMotor reference(config);
  if (open < 3) motor.set_open(open, true);
  const double voltages[2][3] = {{20.0, 3.0, 11.0}, {4.0, 9.0, 15.0}};
  double angle = 0.3;
  for (int round = 0; round < 4; ++round) {
    const auto& u = voltages[round % 2];
    const TerminalValues before_charge{static_cast<double>(reference.charge[0]),
                                       static_cast<double>(reference.charge[1]),
                                       static_cast<double>(reference.charge[2])};
    const long double before_torque = reference.torque_integral;
    motor.advance(driven(u), {angle, speed}, duration);
    reference.advance(u, open, angle, speed, duration, 1000);
    angle += speed * duration;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(motor.currents()[k], static_cast<double>(reference.currents[k]), tolerance) << k << round;
      EXPECT_NEAR(motor.mean_currents()[k],
                  (static_cast<double>(reference.charge[k]) - before_charge[k]) / duration, 10 * tolerance);
    }
    EXPECT_NEAR(motor.torque_at(angle), static_cast<double>(reference.torque(angle)), tolerance);
    EXPECT_NEAR(motor.mean_torque(),
                static_cast<double>((reference.torque_integral - before_torque) / duration),
                torque_tolerance);
  }
}

TEST(SynchronousMotor, OneStepIsWhatAThousandSubstepsGive) {
  expect_like_reference(SynchronousMotorConfig{}, 3, 30.0, 25e-6, 1e-11);
  expect_like_reference(salient(), 3, -80.0, 25e-6, 1e-11);
  expect_like_reference(salient(), 3, 0.0, 12.5e-6, 1e-11);
}

TEST(SynchronousMotor, StepsOfMoreThanAQuarterTurnAndBeyondTheTimeConstant) {
  // 7 pole pairs x 12000 rad/s x 25 us: 2.1 rad.
  expect_like_reference(salient(), 3, 12000.0, 25e-6, 1e-9, 1e-5);
  SynchronousMotorConfig quick = salient();
  quick.inductance_d = 2e-6;  // L/R = 3.3 us
  quick.inductance_q = 5e-6;
  expect_like_reference(quick, 3, 500.0, 25e-6, 1e-8, 1e-5);
}

TEST(SynchronousMotor, WithOnePhaseOpenTheOtherTwoCarryOneCurrent) {
  for (std::size_t open = 0; open < 3; ++open) {
    expect_like_reference(salient(), open, 60.0, 25e-6, 1e-8, 1e-7);
    expect_like_reference(SynchronousMotorConfig{}, open, 3000.0, 25e-6, 1e-7, 1e-7);
  }
}

TEST(SynchronousMotor, TorqueIsTheConstantTimesTheQCurrent) {
  SynchronousMotorConfig config{.electrical_offset = -2.0};
  for (const double angle : {0.0, 0.4, -3.0, 100.0}) {
    SynchronousMotor motor(config);
    motor.advance(holding(config, angle, 0.0, 2.0), {angle, 0.0}, 0.1);
    EXPECT_NEAR(motor.currents_at(angle).q, 2.0, 1e-8);
    EXPECT_NEAR(motor.currents_at(angle).d, 0.0, 1e-8);
    EXPECT_NEAR(motor.torque_at(angle), 0.05 * 2.0, 1e-9);
  }
  // With saliency the d current adds 3/2 p (L_d - L_q) i_d i_q.
  const SynchronousMotorConfig rotor = salient();
  SynchronousMotor motor(rotor);
  motor.advance(holding(rotor, 0.1, -3.0, 2.0), {0.1, 0.0}, 0.1);
  EXPECT_NEAR(motor.torque_at(0.1), 0.1 + 1.5 * 7 * (0.2e-3 - 0.45e-3) * -6.0, 1e-8);
}

// A positive q current at the electrical angle 0 flows into B and out of C, as the header says.
TEST(SynchronousMotor, TheQAxisIsAQuarterTurnAheadOfPhaseA) {
  const SynchronousMotorConfig config;
  SynchronousMotor motor(config);
  motor.advance({{12.0, 13.0, 11.0}, {true, true, true}, 0.0}, {0.0, 0.0}, 0.1);
  EXPECT_NEAR(motor.currents()[0], 0.0, 1e-9);
  EXPECT_NEAR(motor.currents()[1], 1.0 / 0.6, 1e-8);
  EXPECT_GT(motor.torque_at(0.0), 0.0);
}

TEST(SynchronousMotor, InducedVoltageIsWhatMakesNoCurrent) {
  const SynchronousMotorConfig config = salient();
  SynchronousMotor motor(config);
  // In steps so short that the rotating voltage is followed, nothing flows.
  const double speed = 50.0, h = 1e-7;
  double angle = 1.0, most = 0.0;
  for (int n = 0; n < 2000; ++n) {
    const TerminalValues e = motor.induced({angle + 0.5 * speed * h, speed});
    motor.advance({{12 + e[0], 12 + e[1], 12 + e[2]}, {true, true, true}, 0.0}, {angle, speed}, h);
    angle += speed * h;
    most = std::fmax(most, std::fabs(motor.currents()[0]));
  }
  EXPECT_LT(most, 1e-7);
  const TerminalValues e = motor.induced({angle, speed});
  EXPECT_NEAR(e[0] + e[1] + e[2], 0.0, 1e-15);
  EXPECT_GE(motor.largest_induced(-speed), std::fabs(e[0] - e[1]));
  // Amplitude: power e i = torque x speed, so 3/2 E i_q = k i_q speed.
  double amplitude = 0.0;
  for (int n = 0; n < 1000; ++n)
    amplitude = std::fmax(amplitude, motor.induced({angle + n * 1e-3, speed})[2]);
  EXPECT_NEAR(amplitude, 2.0 / 3.0 * 0.05 * speed, 1e-5);
}

TEST(SynchronousMotor, EnergyInIsHeatAndStoredAndMechanical) {
  for (const std::size_t open : {3u, 1u}) {
    const SynchronousMotorConfig config = salient();
    SynchronousMotor motor(config);
    if (open < 3) motor.set_open(open, true);
    const double speed = 120.0, h = 2e-6;
    double angle = 0.0, in = 0.0, heat = 0.0, mechanical = 0.0;
    for (int n = 0; n < 2000; ++n) {
      const double u[3] = {n < 900 ? 14.0 : 3.0, 9.0, n < 1300 ? 5.0 : 12.0};
      const TerminalValues begin = motor.currents();
      motor.advance(driven(u), {angle, speed}, h);
      angle += speed * h;
      const TerminalValues mean = motor.mean_currents(), end = motor.currents();
      for (std::size_t k = 0; k < 3; ++k) {
        in += u[k] * mean[k] * h;
        // i^2 of a nearly straight line through the ends whose middle the mean gives.
        const double middle = 1.5 * mean[k] - 0.25 * (begin[k] + end[k]);
        heat += config.resistance * h / 6 * (begin[k] * begin[k] + 4 * middle * middle + end[k] * end[k]);
      }
      mechanical += motor.mean_torque() * speed * h;
    }
    EXPECT_NEAR(in, heat + mechanical + motor.energy(angle), 1e-8 * (std::fabs(in) + heat)) << open;
    EXPECT_GT(heat, 1e-3);
    EXPECT_GT(std::fabs(mechanical), 1e-3);
  }
}

TEST(SynchronousMotor, AnOpenedPhaseIsCurrentlessAtOnce) {
  const SynchronousMotorConfig config;
  SynchronousMotor motor(config);
  motor.advance(driven({20.0, 3.0, 11.0}), {0.3, 0.0}, 1e-3);
  const TerminalValues before = motor.currents();
  motor.set_open(1, true);
  EXPECT_NEAR(motor.currents()[1], 0.0, 1e-14);
  EXPECT_NEAR(motor.currents()[0], 0.5 * (before[0] - before[2]), 1e-12);
  motor.set_open(2, true);
  EXPECT_NEAR(motor.currents()[0], 0.0, 1e-14);
  motor.advance(driven({20.0, 3.0, 11.0}), {0.3, 10.0}, 1e-3);
  for (const double i : motor.currents()) EXPECT_EQ(i, 0.0);
  EXPECT_EQ(motor.mean_torque(), 0.0);
}

TEST(SynchronousMotor, CoggingPullsIntoItsPositions) {
  SynchronousMotorConfig config{.cogging_torque = 1e-3, .cogging_periods = 42};
  const SynchronousMotor motor(config);
  EXPECT_EQ(motor.cogging_torque(0.0), 0.0);
  EXPECT_NEAR(motor.cogging_torque(pi / 84), -1e-3, 1e-15);
  EXPECT_NEAR(motor.cogging_torque(-pi / 84), 1e-3, 1e-15);
  EXPECT_NEAR(motor.cogging_torque(0.123), motor.cogging_torque(0.123 + 2 * pi / 42), 1e-14);
  EXPECT_EQ(SynchronousMotor().cogging_torque(0.1), 0.0);
}

TEST(SynchronousMotor, RefusesWhatIsNoMotor) {
  const auto refused = [](double SynchronousMotorConfig::*field, double value) {
    SynchronousMotorConfig config;
    config.*field = value;
    EXPECT_THROW(SynchronousMotor{config}, std::invalid_argument) << value;
  };
  refused(&SynchronousMotorConfig::resistance, std::numeric_limits<double>::quiet_NaN());
  refused(&SynchronousMotorConfig::pole_pairs, 6.5);
  refused(&SynchronousMotorConfig::pole_pairs, 0.0);
  refused(&SynchronousMotorConfig::cogging_periods, 1.5);
  refused(&SynchronousMotorConfig::inductance_q, 0.5e-6);  // 0.8 us with 0.6 ohm
  refused(&SynchronousMotorConfig::electrical_offset, std::numeric_limits<double>::infinity());
}

}  // namespace kmax::simulation::synchronous_motor_test
