#include "host_tools/simulation/motor_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace kmax::simulation::motor_drive_test {

using Channel = CurrentSensor::Channel;
constexpr double interval = 25e-6;

DeviceModel frictionless(double damping = 0.5) {
  return {0.045, damping, 0.0, 0.0};
}

MotorDriveConfig config_of(const MotorConfig& motor) {
  return {.motor = motor,
          .inverter = {0.0, 0.8},
          .current_sensor = {},
          .encoder = {.counts_per_turn = 4096, .transmission = 0.01}};
}

MotorDrive brushed_drive(const DeviceModel& device = frictionless()) {
  return MotorDrive(config_of(BrushedDcMotorConfig{}), CoupledHandle(device));
}
MotorDrive synchronous_drive(const DeviceModel& device = frictionless(),
                             const SynchronousMotorConfig& motor = {}) {
  return MotorDrive(config_of(motor), CoupledHandle(device));
}

InverterCommand duties(double a, double b, double c) {
  return {{{{true, a}, {true, b}, {true, c}}}};
}

// Duties that put `volts` on the q axis of the rotor where it is.
InverterCommand along_q(const MotorDrive& drive, double volts, double supply) {
  const double e = drive.synchronous_motor()->electrical_angle(drive.shaft_angle());
  InverterCommand command;
  for (std::size_t k = 0; k < 3; ++k) {
    const double phase = e - static_cast<double>(k) * 2.0943951023931953;
    command.legs[k] = {true, 0.5 - volts / supply * std::sin(phase)};
  }
  return command;
}

// `volts` between the terminals of a brushed motor, from 24 V.
InverterCommand brushed(double volts) {
  return duties(0.0, 0.5 + volts / 48, 0.5 - volts / 48);
}
const InverterCommand forwards = duties(0.0, 0.6, 0.4);

struct Bench {
  MotorDrive drive;
  Supply supply{};

  void run(const InverterCommand& command, double duration, double step = interval) {
    for (int n = 0; n < std::lround(duration / step); ++n) {
      drive.advance(step, command, supply);
      supply.advance(step);
    }
  }
};

// With a brushed motor, unless a test has its own.
class MotorDriveTest : public testing::Test, public Bench {
 protected:
  MotorDriveTest() : Bench{brushed_drive()} {}
};

TEST_F(MotorDriveTest, ForceOnTheHandleIsTorqueOverTransmission) {
  drive.block(true);
  // 1.1 A make 3.3 N.
  run(brushed(1.1), 0.02);
  EXPECT_NEAR(drive.currents()[terminal_b], 1.1, 1e-3);
  EXPECT_NEAR(drive.force(), 3.3, 4e-3);
  EXPECT_EQ(drive.handle().applied_force(), drive.force());
  EXPECT_EQ(drive.handle().velocity(), 0.0);
}

TEST_F(MotorDriveTest, RunsUpToTheSpeedThatBackEmfAndDampingAllow) {
  for (const bool brushed : {true, false}) {
    drive = brushed ? brushed_drive() : synchronous_drive();
    supply = Supply({24.0, 1e-4, 1.0});  // stiff
    for (int n = 0; n < 40000; ++n)
      run(brushed ? motor_drive_test::brushed(2.0) : along_q(drive, 2.0, 24.0), interval);
    // Per radian of the shaft: k (V - E) / R = damping x transmission^2 x speed; the q axis sees E = 2/3 k
    // speed.
    const double k = brushed ? 0.03 : 0.05, resistance = brushed ? 1.0 : 0.6,
                 share = brushed ? 1.0 : 2.0 / 3.0;
    const double load = 0.5 * 1e-4;
    const double speed = 2.0 * k / (resistance * load + share * k * k);
    const double reached = drive.handle().velocity() / drive.encoder().config().transmission;
    EXPECT_NEAR(reached, speed, (brushed ? 1e-3 : 1e-2) * speed) << brushed;
  }
}

TEST_F(MotorDriveTest, EnergyFromTheSupplyIsHeatAndMotion) {
  for (const bool brushed : {true, false}) {
    const DeviceModel device = frictionless(2.0);
    drive = brushed ? brushed_drive(device) : synchronous_drive(device);
    supply = Supply({24.0, 1e-4, 1.0});
    double heat = 0.0, damped = 0.0, given = 0.0;
    for (int n = 0; n < 8000; ++n) {
      const double volts = n < 3000 ? 3.0 : n < 5000 ? -2.0 : 1.0;
      const TerminalValues begin = drive.currents();
      const double speed = drive.handle().velocity(), voltage = supply.voltage();
      const double source = supply.source_charge();
      run(brushed ? motor_drive_test::brushed(volts) : along_q(drive, volts, supply.voltage()), interval);
      const TerminalValues end = drive.currents();
      for (std::size_t k = 0; k < 3; ++k) {
        heat += (brushed ? 0.5 : 0.6) * interval / 3 *
                (begin[k] * begin[k] + begin[k] * end[k] + end[k] * end[k]);
      }
      const double after = drive.handle().velocity();
      damped += 2.0 * interval / 3 * (speed * speed + speed * after + after * after);
      // What leaves the bus: what the source gave less what the capacitor kept.
      given += 0.5 * (voltage + supply.voltage()) *
               (supply.source_charge() - source - 1.0 * (supply.voltage() - voltage));
    }
    const double stored = drive.magnetic_energy() + drive.handle().energy();
    EXPECT_GT(damped, 5e-3);
    EXPECT_NEAR(given, heat + damped + stored, 2e-4 * given) << brushed;
  }
}

TEST_F(MotorDriveTest, SplittingIsOfSecondOrderInTheInterval) {
  const auto end = [](double step) {
    Bench bench{brushed_drive(), Supply({24.0, 1e-4, 10.0})};
    bench.run(forwards, 0.01, step);
    return bench.drive.handle().velocity();
  };
  const double fine = end(25e-6 / 64), coarse = end(25e-6), half = end(12.5e-6);
  EXPECT_NEAR(coarse, fine, 3e-6 * std::fabs(fine));
  EXPECT_LT(std::fabs(half - fine), 0.35 * std::fabs(coarse - fine) + 1e-12);
}

TEST_F(MotorDriveTest, LongIntervalsAreDivided) {
  MotorDrive one = brushed_drive(), many = brushed_drive();
  Supply first({24.0, 1e-4, 10.0}), other({24.0, 1e-4, 10.0});
  one.advance(1e-3, forwards, first);
  for (int n = 0; n < 40; ++n) many.advance(25e-6, forwards, other);
  EXPECT_NEAR(one.handle().velocity(), many.handle().velocity(), 1e-12);
}

TEST_F(MotorDriveTest, APersonPressesAgainstTheMotor) {
  const CoupledHandle handle(DeviceModel{.force_limit = 0.0}, OperatorModel{},
                             IntendedMotionConfig{.start_position = 0.0, .wall_position = -0.02});
  drive = MotorDrive(config_of(BrushedDcMotorConfig{}), handle);
  drive.handle().begin_motion();
  // A spring of 500 N/m by feedback from the encoder.
  for (int n = 0; n < 60000; ++n) {
    const double position =
        static_cast<double>(drive.encoder().edges()) * drive.encoder().config().count_length();
    const double force = std::fmax(0.0, -500.0 * (position + 0.02));
    run(brushed(force * 0.01 / 0.03), interval);
  }
  EXPECT_NEAR(drive.force(), 1.0, 0.3);
  EXPECT_NEAR(drive.handle().position(), -0.022, 0.001);
}

TEST_F(MotorDriveTest, AForceLimitIsRefusedWhenItClips) {
  DeviceModel device = frictionless();
  device.force_limit = 1.0;
  Bench limited{brushed_drive(device)};
  limited.drive.block(true);
  EXPECT_THROW(limited.run(forwards, 0.01), std::logic_error);
  drive.block(true);
  run(forwards, 0.01);
  EXPECT_GT(drive.force(), 10.0);
}

TEST_F(MotorDriveTest, BlockedItStandsAndLetGoItMoves) {
  run(forwards, 0.01);
  const double position = drive.handle().position();
  ASSERT_GT(drive.handle().velocity(), 0.0);
  drive.block(true);
  EXPECT_EQ(drive.handle().velocity(), 0.0);
  run(forwards, 0.01);
  EXPECT_EQ(drive.handle().position(), position);
  drive.block(false);
  run(forwards, 0.01);
  EXPECT_GT(drive.handle().position(), position);
}

TEST_F(MotorDriveTest, LettingGoAHandDoesNotMendABlockedMotor) {
  drive.hold(true);
  drive.block(true);
  drive.hold(false);
  run(forwards, 0.01);
  EXPECT_EQ(drive.handle().position(), 0.0);
  drive.hold(true);
  drive.block(false);
  run(forwards, 0.01);
  EXPECT_EQ(drive.handle().position(), 0.0);
  drive.hold(false);
  run(forwards, 0.01);
  EXPECT_GT(drive.handle().position(), 0.0);
}

TEST_F(MotorDriveTest, SwappedWiresExchangeWhatTheLegsSee) {
  drive = synchronous_drive();
  drive.block(true);
  drive.swap_terminals(terminal_a, terminal_c);
  run(duties(0.55, 0.48, 0.47), 0.02);
  EXPECT_EQ(drive.leg_currents()[terminal_a], drive.currents()[terminal_c]);
  EXPECT_EQ(drive.leg_currents()[terminal_b], drive.currents()[terminal_b]);
  EXPECT_EQ(drive.leg_currents()[terminal_c], drive.currents()[terminal_a]);
  EXPECT_GT(drive.leg_currents()[terminal_a], 1.0) << "the leg with the highest voltage feeds the motor";
  EXPECT_NEAR(drive.current_pin(Channel::c), 1.65 + 0.02 * drive.currents()[terminal_a], 1e-12);
  EXPECT_THROW(drive.swap_terminals(terminal_a, 3), std::out_of_range);
}

TEST_F(MotorDriveTest, AReversedEncoderCountsDownAndItsIndexGoesWithIt) {
  MotorDriveConfig config = config_of(BrushedDcMotorConfig{});
  config.encoder.reversed = true;
  config.encoder.index_position = 4000;
  drive = MotorDrive(config, CoupledHandle(frictionless()));
  bool seen = false;
  for (int n = 0; n < 3000; ++n) {
    run(duties(0.0, 0.52, 0.48), interval);
    ASSERT_EQ(drive.encoder().edges(),
              static_cast<std::int64_t>(std::floor(-drive.shaft_angle() / 6.283185307179586 * 4096)));
    seen = seen || (drive.encoder().lines().z && drive.encoder().edges() % 4096 == 4000 - 4096);
  }
  EXPECT_TRUE(seen);
}

TEST_F(MotorDriveTest, ABlockedHandleHoldsAgainstAPerson) {
  for (const double friction : {0.0, 0.1}) {
    IntendedMotionConfig motion;
    CoupledHandle handle({0.045, 0.05, friction, 0.0}, OperatorModel{}, motion);
    handle.begin_motion();
    handle.block(true);
    for (int n = 0; n < 1000; ++n) handle.advance(5.0, 0.0, 1e-3);
    EXPECT_EQ(handle.position(), motion.start_position);
    EXPECT_LT(handle.hand_position(), motion.start_position - 1e-4) << "the hand moves on";
    handle.block(false);
    handle.advance(0.0, 0.0, 1e-3);
    EXPECT_LT(handle.position(), motion.start_position);
  }
}

TEST_F(MotorDriveTest, OpenPhases) {
  drive.open_terminal(terminal_c, true);
  run(duties(0.0, 0.9, 0.1), 0.01);
  EXPECT_EQ(drive.force(), 0.0);
  EXPECT_EQ(drive.handle().position(), 0.0);

  drive = synchronous_drive();
  drive.block(true);
  drive.open_terminal(terminal_b, true);
  run(duties(0.6, 0.9, 0.4), 0.01);
  EXPECT_NEAR(drive.currents()[terminal_b], 0.0, 1e-14);
  EXPECT_NEAR(drive.currents()[terminal_a], 0.2 * supply.voltage() / 1.2, 1e-2);
}

TEST_F(MotorDriveTest, ThePinsShowTheCurrentWhileSomethingConductsBelow) {
  drive.block(true);
  run(forwards, 0.01);
  const double current = drive.currents()[terminal_b];
  ASSERT_GT(current, 4.0);
  EXPECT_NEAR(drive.current_pin(Channel::b), 1.65 + 0.02 * current, 1e-12);
  EXPECT_NEAR(drive.current_pin(Channel::c), 1.65 - 0.02 * current, 1e-12);
  EXPECT_EQ(drive.current_pin(Channel::b, CurrentSensor::Half::high_sides), 1.65);
  // Off: B's current comes up through the lower diode and its shunt, C's goes to the upper rail.
  drive.advance(5e-6, InverterCommand{}, supply);
  ASSERT_GT(drive.currents()[terminal_b], 1.0);
  EXPECT_GT(drive.current_pin(Channel::b, CurrentSensor::Half::high_sides), 1.66);
  EXPECT_EQ(drive.current_pin(Channel::c), 1.65);
}

// At the largest duty the lower FET has hardly conducted when the pin is read, and at the smallest the upper
// one; a middle duty is settled.
TEST_F(MotorDriveTest, ThePinsShowWhatTheAmplifierHasSettledTo) {
  MotorDriveConfig config = config_of(BrushedDcMotorConfig{});
  config.current_sensor.gain = 80.0;
  drive = MotorDrive(config, CoupledHandle(frictionless()));
  drive.block(true);
  const auto shown = [&](double duty, Channel channel, CurrentSensor::Half half) {
    InverterCommand command = duties(0.0, duty, duty - 0.05);
    if (channel == Channel::c) std::swap(command.legs[1], command.legs[2]);
    command.dead_time = 125e-9;
    drive.advance(10e-9, command, supply);
    const std::size_t leg = channel == Channel::b ? terminal_b : terminal_c;
    return (drive.current_pin(channel, half) - 1.65) / (0.04 * drive.leg_currents()[leg]);
  };
  run(duties(0.0, 0.55, 0.45), 0.01);
  using Half = CurrentSensor::Half;
  for (const Channel channel : {Channel::b, Channel::c}) {
    EXPECT_NEAR(shown(0.94, channel, Half::low_sides), 0.80, 0.01);
    EXPECT_NEAR(shown(0.90, channel, Half::low_sides), 0.97, 0.002);
    EXPECT_NEAR(shown(0.50, channel, Half::low_sides), 1.0, 1e-6);
    EXPECT_NEAR(shown(0.50, channel, Half::high_sides), 0.0, 1e-6);
    EXPECT_NEAR(shown(0.10, channel, Half::high_sides), 0.03, 0.002);
    EXPECT_NEAR(shown(1.0, channel, Half::low_sides), 0.0, 1e-6) << "never on";
  }
}

TEST_F(MotorDriveTest, BrakingPumpsTheSupplyUp) {
  supply = Supply({24.0, 0.05, 100e-6});
  run(duties(0.0, 0.75, 0.25), 0.2);
  EXPECT_LT(supply.voltage(), 24.0);
  run(forwards, 0.02);
  EXPECT_GT(supply.voltage(), 24.1);
}

TEST_F(MotorDriveTest, WithoutSupplyThereIsSoonNoForce) {
  drive.block(true);
  run(forwards, 0.01);
  supply.disconnect();
  run(forwards, 0.3);
  EXPECT_LT(supply.voltage(), 0.1);
  EXPECT_NEAR(drive.force(), 0.0, 0.1);
}

TEST_F(MotorDriveTest, TheEncoderFollowsTheHandle) {
  run(forwards, 0.1);
  const double turns = drive.handle().position() / 0.01 / 6.283185307179586;
  EXPECT_EQ(drive.encoder().edges(), static_cast<std::int64_t>(std::floor(turns * 4096)));
  drive.encoder().set_plugged(false);
  const std::int64_t before = drive.encoder().edges();
  run(forwards, 0.1);
  EXPECT_EQ(drive.encoder().edges(), before);
}

TEST_F(MotorDriveTest, TheBackgroundForceIsASetting) {
  for (const double force : {0.0, 2.0}) {
    drive = MotorDrive(config_of(BrushedDcMotorConfig{}),
                       CoupledHandle({.force_limit = 0.0}, OperatorModel{}, IntendedMotionConfig{}));
    drive.set_background_force(force);
    run(brushed(0.48), 0.2);
    EXPECT_NEAR(drive.handle().activation(), force * (1.0 - std::exp(-0.5)), 1e-9);
  }
}

TEST_F(MotorDriveTest, CoggingMovesAFreeHandleIntoItsPosition) {
  SynchronousMotorConfig motor{.cogging_torque = 2e-3, .cogging_periods = 36};
  CoupledHandle start(frictionless(5.0), {0.0004, 0.0});  // 0.04 rad, a positions' distance is 0.175 rad
  drive = MotorDrive(config_of(motor), start);
  run(InverterCommand{}, 1.0);
  EXPECT_NEAR(drive.shaft_angle(), 0.0, 1e-6);
}

TEST_F(MotorDriveTest, TheSameSeedGivesTheSameRun) {
  MotorDriveConfig config = config_of(BrushedDcMotorConfig{});
  config.current_sensor.noise = 1e-5;
  config.encoder.dropout_probability = 0.1;
  config.encoder.counts_per_turn = 40000;
  config.seed = 17;
  const auto record = [&] {
    Bench bench{MotorDrive(config, CoupledHandle(frictionless()))};
    double sum = 0.0;
    for (int n = 0; n < 2000; ++n) {
      const double pin = bench.drive.current_pin(Channel::b);
      sum += pin * (n + 1) + static_cast<double>(bench.drive.encoder().edges());
      bench.run(duties(0.0, pin > 1.65 ? 0.55 : 0.6, 0.4), interval);
    }
    return sum;
  };
  const double first = record();
  EXPECT_EQ(first, record());
  config.seed = 18;
  EXPECT_NE(first, record());
}

TEST_F(MotorDriveTest, RefusesWhatIsNotANumber) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double duration : {nan, -1e-6})
    EXPECT_THROW(drive.advance(duration, duties(0, 0.5, 0.5), supply), std::invalid_argument);
  EXPECT_THROW(drive.advance(25e-6, duties(0, nan, 0.5), supply), std::invalid_argument);
  EXPECT_THROW(drive.set_background_force(nan), std::invalid_argument);
  EXPECT_EQ(drive.handle().samples(), 0u);
  EXPECT_THROW(drive.open_terminal(3, true), std::out_of_range);
  MotorDriveConfig config = config_of(BrushedDcMotorConfig{});
  config.encoder.transmission = 0.0;
  EXPECT_THROW(MotorDrive(config, CoupledHandle(frictionless())), std::invalid_argument);
}

}  // namespace kmax::simulation::motor_drive_test
