#include "host_tools/simulation/inverter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace kmax::simulation::inverter_test {

constexpr double supply = 24.0;

InverterCommand duties(double a, double b, double c) {
  return {{{{true, a}, {true, b}, {true, c}}}};
}

InverterCommand brushed(double b, double c) {
  return {{{{false, 0.0}, {true, b}, {true, c}}}};
}

template <typename Motor>
double run(const Inverter& inverter, Motor& motor, const InverterCommand& command, double speed,
           double duration, double interval = 25e-6) {
  double charge = 0.0, angle = 0.0;
  for (double time = 0.0; time < duration - 1e-9; time += interval) {
    charge += inverter.advance(motor, command, supply, {angle, speed}, interval).charge;
    angle += speed * interval;
  }
  return charge;
}

TEST(Inverter, ALegGivesItsDutyOfTheSupply) {
  const Inverter inverter({0.01, 0.8});
  BrushedDcMotor motor({1.0, 0.5e-3, 0.03});
  run(inverter, motor, brushed(0.6, 0.4), 20.0, 0.02);
  EXPECT_NEAR(motor.current(), (0.2 * supply - 0.03 * 20.0) / 1.02, 1e-9);
  // What leaves the supply is the power of the motor and the legs.
  const double charge = inverter.advance(motor, brushed(0.6, 0.4), supply, {0.0, 20.0}, 25e-6).charge;
  EXPECT_NEAR(charge, 0.2 * motor.current() * 25e-6, 1e-12);
}

TEST(Inverter, DrivesASynchronousMotorAsItsOwnVoltagesWould) {
  const Inverter inverter({0.003, 0.8});
  SynchronousMotor on_legs, alone;
  for (int n = 0; n < 100; ++n) {
    inverter.advance(on_legs, duties(0.5, 0.6, 0.45), supply, {n * 0.01, 400.0}, 25e-6);
    alone.advance({{12.0, 14.4, 10.8}, {true, true, true}, 0.003}, {n * 0.01, 400.0}, 25e-6);
  }
  EXPECT_EQ(on_legs.currents(), alone.currents());
}

TEST(Inverter, DeadTimeTakesAVoltageAgainstTheCurrent) {
  const Inverter inverter({0.0, 0.8});
  InverterCommand command = brushed(0.6, 0.4);
  command.dead_time = 500e-9;
  command.pwm_frequency = 20e3;
  BrushedDcMotor motor({1.0, 0.5e-3, 0.03});
  run(inverter, motor, command, 0.0, 0.02);
  EXPECT_NEAR(motor.current(), (0.2 - 2 * 0.01) * supply / 1.0, 1e-9);
  command.legs[1].duty = 0.4;
  command.legs[2].duty = 0.6;
  run(inverter, motor, command, 0.0, 0.02);
  EXPECT_NEAR(motor.current(), -(0.2 - 2 * 0.01) * supply / 1.0, 1e-9);
  // A leg that does not switch loses nothing.
  command.legs[1].duty = 1.0;
  command.legs[2].duty = 0.9;
  run(inverter, motor, command, 0.0, 0.02);
  EXPECT_NEAR(motor.current(), (0.1 - 0.01) * supply, 1e-9);
  // A pulse shorter than the dead time never comes.
  command.legs[1].duty = 0.003;
  command.legs[2].duty = 0.0;
  EXPECT_NEAR(std::clamp(0.003 - Inverter::dead_time_share(command, 0.003, 5.0, supply, 0.5e-3), 0.0, 1.0),
              0.0, 1e-15);
}

// Small voltages at the zero crossing: the current stays small, without a jump and without a dead stop.
TEST(Inverter, InTheBandTheDeadTimeActsAsAResistance) {
  const Inverter inverter({0.0, 0.8});
  const BrushedDcMotorConfig config{1.0, 0.5e-3, 0.03};
  const double band = supply * 500e-9 / config.inductance;  // 24 mA
  for (const double part : {-0.9, -0.3, 0.0, 0.5, 0.99}) {
    InverterCommand command = brushed(0.5, 0.5);
    command.dead_time = 500e-9;
    // Both legs lose f t_dead x part.
    const double share = part * (2 * 0.01 + band * config.resistance / supply);
    command.legs[1].duty = 0.5 + 0.5 * share;
    command.legs[2].duty = 0.5 - 0.5 * share;
    BrushedDcMotor motor(config);
    run(inverter, motor, command, 0.0, 0.02);
    EXPECT_NEAR(motor.current(), part * band, 1e-6 * band) << part;
  }
  InverterCommand command = brushed(0.5, 0.5);
  command.dead_time = 500e-9;
  double last = -1.0;
  for (double current = -0.05; current <= 0.05; current += 1e-4) {
    const double share = Inverter::dead_time_share(command, 0.5, current, supply, config.inductance);
    EXPECT_GE(share, last);
    EXPECT_LE(share - (last < -0.5 ? share : last), 0.01 * 1e-4 / band * 1.0001);
    last = share;
  }
  EXPECT_EQ(Inverter::dead_time_share(command, 0.5, 0.0, supply, config.inductance), 0.0);
}

TEST(Inverter, DeadTimeDistortsASineAtItsZeroCrossings) {
  // A slow sine of voltage: without dead time the current is a sine, with it the current flattens near zero.
  const Inverter inverter({0.0, 0.8});
  BrushedDcMotor clean, dead;
  double smallest_ratio = 1.0, at_peak = 0.0;
  for (int n = 0; n < 40000; ++n) {
    const double share = 0.05 * std::sin(2 * 3.141592653589793 * n / 20000.0);
    InverterCommand command = brushed(0.5 + share / 2, 0.5 - share / 2);
    inverter.advance(clean, command, supply, {}, 25e-6);
    command.dead_time = 500e-9;
    inverter.advance(dead, command, supply, {}, 25e-6);
    if (n % 10000 == 5000) at_peak = dead.current() / clean.current();
    if (n % 10000 == 500) smallest_ratio = std::fmin(smallest_ratio, dead.current() / clean.current());
  }
  EXPECT_NEAR(at_peak, (0.05 - 0.02) / 0.05, 1e-3);
  EXPECT_LT(smallest_ratio, 0.2);
  EXPECT_GT(smallest_ratio, 0.0);
}

TEST(Inverter, DeadTimeConvergesWithTheInterval) {
  const Inverter inverter;
  SynchronousMotor coarse, fine;
  InverterCommand command = duties(0.5, 0.502, 0.498);
  command.dead_time = 500e-9;
  run(inverter, coarse, command, 30.0, 2e-3, 25e-6);
  run(inverter, fine, command, 30.0, 2e-3, 1e-6);
  double largest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    largest = std::fmax(largest, std::fabs(fine.currents()[k]));
    EXPECT_NEAR(coarse.currents()[k], fine.currents()[k], 2e-4);
  }
  EXPECT_GT(largest, 0.01);
}

TEST(Inverter, SwitchedOffTheCurrentFlowsBackThroughTheDiodesAndEnds) {
  const Inverter inverter({0.0, 0.8});
  const BrushedDcMotorConfig config{1.0, 0.5e-3, 0.03};
  for (const double sign : {1.0, -1.0}) {
    BrushedDcMotor motor(config);
    run(inverter, motor, brushed(0.5 + 0.1 * sign, 0.5 - 0.1 * sign), 0.0, 0.02);
    const double start = std::fabs(motor.current());
    // i = -V/R + (i0 + V/R) e^(-R t/L) with V = supply + 2 drops against it, until it is zero.
    const double against = (supply + 1.6) / config.resistance;
    const double end = config.inductance / config.resistance * std::log1p(start / against);
    const double charge = start * config.inductance / config.resistance - against * end;
    double returned = 0.0, time = 0.0;
    while (motor.current() != 0.0 && time < 1e-3) {
      returned += inverter.advance(motor, InverterCommand{}, supply, {}, 25e-6).charge;
      time += 25e-6;
    }
    EXPECT_EQ(motor.current(), 0.0);
    EXPECT_NEAR(time, end, 25e-6);
    EXPECT_NEAR(returned, -(charge < 0 ? -charge : charge), 1e-10);
    EXPECT_EQ(inverter.advance(motor, InverterCommand{}, supply, {0.0, 100.0}, 25e-6).charge, 0.0);
    EXPECT_EQ(motor.current(), 0.0);
  }
}

TEST(Inverter, AllThreeCurrentsOfASynchronousMotorEndAndTheEnergyIsAccountedFor) {
  const Inverter inverter({0.0, 0.7});
  const SynchronousMotorConfig config;
  for (double angle = 0.0; angle < 0.9; angle += 0.05) {
    SynchronousMotor motor(config);
    for (int n = 0; n < 400; ++n)
      inverter.advance(motor, duties(0.5, 0.6, 0.45), supply, {angle, 0.0}, 25e-6);
    const double stored = motor.energy(angle);
    ASSERT_GT(stored, 1e-4);
    double returned = 0.0, heat = 0.0, drop = 0.0;
    for (int n = 0; n < 2000; ++n) {
      const TerminalValues begin = motor.currents();
      returned -= inverter.advance(motor, InverterCommand{}, supply, {angle, 0.0}, 5e-7).charge;
      const TerminalValues end = motor.currents();
      for (std::size_t k = 0; k < 3; ++k) {
        heat += config.resistance * 0.5 * (begin[k] * begin[k] + end[k] * end[k]) * 5e-7;
        drop += 0.7 * 0.5 * (std::fabs(begin[k]) + std::fabs(end[k])) * 5e-7;
      }
    }
    for (const double current : motor.currents()) EXPECT_EQ(current, 0.0) << angle;
    EXPECT_NEAR(stored, returned * supply + heat + drop, 1e-3 * stored) << angle;
  }
}

TEST(Inverter, AMotorTurnedTooFastChargesTheSupply) {
  const Inverter inverter({0.0, 0.8});
  SynchronousMotor motor;
  // Largest induced voltage between two terminals = supply + both drops at this speed.
  const double limit = (supply + 1.6) / motor.largest_induced(1.0);
  EXPECT_EQ(run(inverter, motor, InverterCommand{}, 0.98 * limit, 5e-3), 0.0);
  const double charge = run(inverter, motor, InverterCommand{}, 1.3 * limit, 5e-3);
  EXPECT_LT(charge, -1e-3);
  BrushedDcMotor brush;
  const double speed = 1.2 * (supply + 1.6) / 0.03;
  run(inverter, brush, InverterCommand{}, speed, 20e-3);
  EXPECT_NEAR(brush.current(), -(0.03 * speed - supply - 1.6), 1e-6);
  EXPECT_LT(inverter.advance(brush, InverterCommand{}, supply, {0.0, -0.99 * speed}, 25e-6).charge, 0.0);
}

TEST(Inverter, OneLegAloneDrivesNoCurrent) {
  const Inverter inverter;
  BrushedDcMotor motor;
  InverterCommand command;
  command.legs[1] = {true, 0.9};
  run(inverter, motor, command, 0.0, 1e-3);
  EXPECT_EQ(motor.current(), 0.0);
  SynchronousMotor three;
  run(inverter, three, command, 0.0, 1e-3);
  for (const double current : three.currents()) EXPECT_EQ(current, 0.0);
  // Two legs: the third is blocked and the two carry one current.
  command.legs[2] = {true, 0.1};
  run(inverter, three, command, 0.0, 20e-3);
  EXPECT_NEAR(three.currents()[0], 0.0, 1e-12);
  EXPECT_NEAR(three.currents()[1], 0.8 * supply / (2 * (0.6 + 2e-3)), 1e-6);
  EXPECT_NEAR(three.currents()[2], -three.currents()[1], 1e-12);
}

TEST(Inverter, SwitchingOffOneLegOfThree) {
  const Inverter inverter;
  SynchronousMotor motor;
  run(inverter, motor, duties(0.7, 0.4, 0.4), 0.0, 20e-3);
  ASSERT_GT(motor.currents()[0], 1.0);
  InverterCommand command = duties(0.7, 0.4, 0.4);
  command.legs[0].enabled = false;
  run(inverter, motor, command, 0.0, 5e-3);
  EXPECT_NEAR(motor.currents()[0], 0.0, 1e-12);
  EXPECT_NEAR(motor.currents()[1], 0.0, 1e-6);
}

TEST(Inverter, EveryStateOfEveryLegStaysFiniteAndNeverFeedsBackThroughAWrongDiode) {
  const Inverter inverter;
  SynchronousMotorConfig salient{.inductance_q = 0.5e-3};
  SynchronousMotor motor(salient);
  std::uint64_t state = 1;
  double angle = 0.0;
  for (int n = 0; n < 20000; ++n) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    InverterCommand command{.dead_time = (state >> 60 & 1) != 0 ? 400e-9 : 0.0};
    for (std::size_t k = 0; k < 3; ++k) {
      command.legs[k].enabled = (state >> (20 + k) & 1) != 0;
      command.legs[k].duty = static_cast<double>(state >> (30 + 8 * k) & 0xFF) / 255.0;
    }
    if (n % 50 == 0) motor.set_open(state >> 40 & 1 ? 0 : 2, (state >> 41 & 1) != 0);
    const double speed = 600.0 * std::sin(1e-3 * n);
    const Inverter::Flow flow = inverter.advance(motor, command, supply, {angle, speed}, 25e-6);
    angle += speed * 25e-6;
    const TerminalValues i = motor.currents();
    ASSERT_TRUE(std::isfinite(flow.charge) && std::isfinite(flow.mean_torque));
    ASSERT_LT(std::fabs(i[0]) + std::fabs(i[1]), 200.0);
    ASSERT_NEAR(i[0] + i[1] + i[2], 0.0, 1e-12);
  }
}

TEST(Inverter, RefusesWhatIsNotAllowedAndLeavesTheMotorAlone) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Inverter inverter;
  BrushedDcMotor motor;
  run(inverter, motor, brushed(0.6, 0.4), 0.0, 1e-3);
  const double current = motor.current();
  InverterCommand late = brushed(0.5, 0.5), slow = late;
  late.dead_time = 1.0;
  slow.pwm_frequency = nan;
  EXPECT_THROW(inverter.advance(motor, brushed(nan, 0.5), supply, {}, 25e-6), std::invalid_argument);
  EXPECT_THROW(inverter.advance(motor, brushed(0.5, 1.01), supply, {}, 25e-6), std::invalid_argument);
  EXPECT_THROW(inverter.advance(motor, late, supply, {}, 25e-6), std::invalid_argument);
  EXPECT_THROW(inverter.advance(motor, slow, supply, {}, 25e-6), std::invalid_argument);
  EXPECT_THROW(inverter.advance(motor, brushed(0.5, 0.5), nan, {}, 25e-6), std::invalid_argument);
  EXPECT_THROW(inverter.advance(motor, brushed(0.5, 0.5), supply, {nan, 0.0}, 25e-6), std::invalid_argument);
  EXPECT_THROW(inverter.advance(motor, brushed(0.5, 0.5), supply, {}, 0.0), std::invalid_argument);
  EXPECT_EQ(motor.current(), current);
  EXPECT_THROW(Inverter({-1.0, 0.8}), std::invalid_argument);
}

}  // namespace kmax::simulation::inverter_test
