#include "host_tools/calibration/field_turn_fit.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "tests/host_tools/calibration/motor_bench.hpp"

namespace kmax::calibration::field_turn_fit_test {

using test::BenchMotor;
using test::MotorBench;

constexpr double degrees = 360.0 / test::two_pi;

struct Sweep {
  std::vector<double> angle, count;
  FieldTurn view() const { return {angle, count}; }
};

// `swapped`: the wires B and C.
Sweep turn_field(MotorBench& bench, double& angle, double volts, double rate, double span,
                 bool swapped = false) {
  Sweep sweep;
  const double step = rate * test::tick;
  const auto ticks = static_cast<std::size_t>(span / std::abs(step));
  for (std::size_t k = 0; k < ticks; ++k) {
    const test::BenchSample sample = bench.sample();
    if (k % 10 == 0) {
      sweep.angle.push_back(angle - test::two_pi * std::floor(angle / test::two_pi));
      sweep.count.push_back(sample.count);
    }
    bench.tick_with_vector(volts, 0.0, swapped ? -angle : angle, sample.supply);
    angle += step;
  }
  return sweep;
}

struct Pair {
  Sweep there, back;
};

// Aligned, then four and a bit electrical turns forwards and back.
Pair turn_both_ways(MotorBench& bench, double first_angle, double share = 1.0, bool swapped = false) {
  double angle = first_angle;
  const double volts = share * bench.motor().current * bench.motor().resistance();
  for (int k = 0; k < 4000; ++k) {
    const test::BenchSample sample = bench.sample();
    bench.tick_with_vector(std::min(1.0, k / 2000.0) * volts, 0.0, swapped ? -angle : angle, sample.supply);
  }
  const double rate = test::two_pi * 2.0, span = test::two_pi * 4.3;
  Pair pair;
  pair.there = turn_field(bench, angle, volts, rate, span, swapped);
  pair.back = turn_field(bench, angle, volts, -rate, span, swapped);
  return pair;
}

FieldTurnConfig config_of(const BenchMotor& motor) {
  FieldTurnConfig config;
  config.counts_per_turn = motor.counts_per_turn;
  config.claimed_pole_pairs = static_cast<int>(motor.pmsm().pole_pairs);
  return config;
}

FieldTurnFit fit_of(const Pair& pair, const FieldTurnConfig& config) {
  return fit_field_turn(pair.there.view(), pair.back.view(), config);
}

// A rotor that follows with this lag; `first`: count at the field's angle 0.
Pair ideal(double counts_per_electrical_turn, double lag, double turns, double first = 0.0) {
  Pair pair;
  const auto samples = static_cast<std::size_t>(turns * 500.0);
  for (std::size_t k = 0; k < samples; ++k) {
    const double up = turns * test::two_pi * static_cast<double>(k) / static_cast<double>(samples);
    const double down = turns * test::two_pi - up;
    pair.there.angle.push_back(up);
    pair.there.count.push_back(std::floor(first + (up - lag) / test::two_pi * counts_per_electrical_turn));
    pair.back.angle.push_back(down);
    pair.back.count.push_back(std::floor(first + (down + lag) / test::two_pi * counts_per_electrical_turn));
  }
  return pair;
}

class FieldTurnOfMotors : public testing::TestWithParam<std::size_t> {};

TEST_P(FieldTurnOfMotors, OffsetWithinHalfAnElectricalDegree) {
  const BenchMotor motor = test::bench_motors()[GetParam()];
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    MotorBench bench(motor, seed, 1e-3 * static_cast<double>(seed));
    const FieldTurnFit fit = fit_of(turn_both_ways(bench, 0.3 * static_cast<double>(seed)), config_of(motor));
    ASSERT_EQ(to_string(fit.finding), "") << fit.pole_pairs.value;
    EXPECT_EQ(fit.direction, 1);
    EXPECT_EQ(fit.whole_pole_pairs, static_cast<int>(motor.pmsm().pole_pairs));
    worst = std::max(
        worst, std::abs(std::remainder(fit.offset.value - motor.pmsm().electrical_offset, test::two_pi)));
  }
  std::printf("%s, worst of 20: %.2f electrical degrees\n", motor.name.c_str(), degrees * worst);
  EXPECT_LT(degrees * worst, 0.5);
}

INSTANTIATE_TEST_SUITE_P(FieldTurnFit, FieldTurnOfMotors, testing::Range<std::size_t>(2, 5));

TEST(FieldTurnFit, SwappedWiresAndAReversedEncoderTurnTheDirectionAround) {
  const BenchMotor motor = test::bench_motors()[2];
  MotorBench bench(motor, 2);
  const FieldTurnFit swapped = fit_of(turn_both_ways(bench, 0.3, 1.0, true), config_of(motor));
  EXPECT_EQ(to_string(swapped.finding), "");
  EXPECT_EQ(swapped.direction, -1);
  EXPECT_EQ(swapped.whole_pole_pairs, 7);

  MotorBench other(motor, 2);
  Pair reversed = turn_both_ways(other, 0.3);
  for (Sweep* sweep : {&reversed.there, &reversed.back})
    for (double& count : sweep->count) count = -count;
  const FieldTurnFit fit = fit_of(reversed, config_of(motor));
  EXPECT_EQ(to_string(fit.finding), "");
  EXPECT_EQ(fit.direction, -1);
  // With the direction applied, the angle is the motor's own again.
  EXPECT_LT(
      degrees * std::abs(std::remainder(fit.offset.value - motor.pmsm().electrical_offset, test::two_pi)),
      0.5);
}

TEST(FieldTurnFit, WhatDoesNotCountIsCalledStill) {
  const BenchMotor motor = test::bench_motors()[2];
  MotorBench blocked(motor, 2);
  blocked.drive().block(true);
  EXPECT_EQ(fit_of(turn_both_ways(blocked, 0.3), config_of(motor)).finding.cause,
            FieldTurnCause::motor_still);
  MotorBench unplugged(motor, 2);
  unplugged.drive().encoder().set_plugged(false);
  EXPECT_EQ(fit_of(turn_both_ways(unplugged, 0.3), config_of(motor)).finding.cause,
            FieldTurnCause::motor_still);
  MotorBench open(motor, 2);
  for (const std::size_t terminal : {0u, 1u}) open.drive().open_terminal(terminal, true);
  EXPECT_EQ(fit_of(turn_both_ways(open, 0.3), config_of(motor)).finding.cause, FieldTurnCause::motor_still);
}

TEST(FieldTurnFit, OneOpenPhaseIsNotTakenForAMotor) {
  const BenchMotor motor = test::bench_motors()[2];
  for (const std::size_t terminal : {0u, 1u, 2u}) {
    MotorBench bench(motor, 2);
    bench.drive().open_terminal(terminal, true);
    EXPECT_FALSE(fit_of(turn_both_ways(bench, 0.3), config_of(motor)).finding.is_none()) << terminal;
  }
}

TEST(FieldTurnFit, TooLittleCurrentForTheFrictionIsNotTakenForAResult) {
  BenchMotor motor = test::bench_motors()[2];
  motor.device.friction = 4.0;
  for (const double share : {0.05, 0.2, 0.34, 0.36, 0.5}) {  // 4 N need 0.33
    MotorBench bench(motor, 2);
    const FieldTurnFit fit = fit_of(turn_both_ways(bench, 0.3, share), config_of(motor));
    if (!fit.finding.is_none()) continue;
    EXPECT_LT(
        degrees * std::abs(std::remainder(fit.offset.value - motor.pmsm().electrical_offset, test::two_pi)),
        1.0)
        << share;
  }
  MotorBench bench(motor, 2);
  EXPECT_FALSE(fit_of(turn_both_ways(bench, 0.3, 0.2), config_of(motor)).finding.is_none());
}

TEST(FieldTurnFit, WrongNumbersAreTold) {
  FieldTurnConfig config;
  config.counts_per_turn = 4000.0;
  config.claimed_pole_pairs = 11;
  const FieldTurnFit fit = fit_of(ideal(4000.0 / 7.0, 0.1, 4.2), config);
  EXPECT_EQ(fit.finding.cause, FieldTurnCause::pole_pairs_differ);
  EXPECT_EQ(fit.finding.found, 7.0);
  EXPECT_EQ(fit.finding.allowed, 11.0);
  config.claimed_pole_pairs = 7;
  config.counts_per_turn = 4096.0;  // 7.168 pole pairs
  EXPECT_EQ(fit_of(ideal(4000.0 / 7.0, 0.1, 4.2), config).finding.cause, FieldTurnCause::not_whole);
}

TEST(FieldTurnFit, SlippingIsTold) {
  FieldTurnConfig config;
  // One count in fifty is lost one way: the sweeps differ.
  Pair lost = ideal(4000.0 / 7.0, 0.1, 4.2);
  for (double& count : lost.back.count) count *= 0.97;
  EXPECT_EQ(fit_of(lost, config).finding.cause, FieldTurnCause::slipping);
  // The coupling slips once by a fifth of a turn.
  Pair slipped = ideal(4000.0 / 7.0, 0.1, 4.2);
  for (std::size_t k = 1200; k < slipped.there.count.size(); ++k) slipped.there.count[k] += 100.0;
  EXPECT_EQ(fit_of(slipped, config).finding.cause, FieldTurnCause::slipping);
  // Between the sweeps by a quarter of an electrical turn.
  Pair between = ideal(4000.0 / 7.0, 0.1, 4.2);
  for (double& count : between.back.count) count -= 143.0;
  EXPECT_EQ(fit_of(between, config).finding.cause, FieldTurnCause::not_meeting);
  for (double& count : between.back.count) count += 2.0 * 286.0;
  EXPECT_EQ(fit_of(between, config).finding.cause, FieldTurnCause::not_meeting);
  // It follows forwards and goes on when the field turns back.
  Pair same = ideal(4000.0 / 7.0, 0.1, 4.2);
  same.back.count = same.there.count;
  EXPECT_EQ(fit_of(same, config).finding.cause, FieldTurnCause::direction_differs);
}

TEST(FieldTurnFit, FrictionCancelsAndTheLagIsReported) {
  FieldTurnConfig config;
  for (const double first : {0.0, 123.0, -777.0}) {
    const FieldTurnFit fit = fit_of(ideal(4000.0 / 7.0, 0.4, 4.2, first), config);
    ASSERT_EQ(to_string(fit.finding), "");
    const double offset = -(first - 0.5) / 4000.0 * 7.0 * test::two_pi;  // half a count: the counter's floor
    EXPECT_LT(degrees * std::abs(std::remainder(fit.offset.value - offset, test::two_pi)), 0.1) << first;
    EXPECT_GE(fit.offset.value, 0.0);
    EXPECT_LT(fit.offset.value, test::two_pi);
    EXPECT_NEAR(fit.lag.value, 0.4, 0.005);
  }
}

TEST(FieldTurnFit, RecordsThatHoldNothingAreNamed) {
  FieldTurnConfig config;
  const Pair good = ideal(4000.0 / 7.0, 0.1, 4.2);
  EXPECT_EQ(fit_field_turn({}, {}, config).finding.cause, FieldTurnCause::too_little_data);
  Pair bad = good;
  bad.back.count.pop_back();
  EXPECT_EQ(fit_of(bad, config).finding.cause, FieldTurnCause::too_little_data);
  bad = good;
  bad.there.count[5] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fit_of(bad, config).finding.cause, FieldTurnCause::not_finite);
  bad = good;
  for (double& angle : bad.back.angle) angle = 1.0;
  EXPECT_EQ(fit_of(bad, config).finding.cause, FieldTurnCause::field_still);
  bad = good;
  bad.back = bad.there;
  EXPECT_EQ(fit_of(bad, config).finding.cause, FieldTurnCause::field_still);
  EXPECT_EQ(fit_of(ideal(4000.0 / 7.0, 0.1, 0.9), config).finding.cause, FieldTurnCause::too_little_data);
  // One whole turn after settling: a value, but nobody knows how good.
  const FieldTurnFit one = fit_of(ideal(4000.0 / 7.0, 0.1, 1.3), config);
  EXPECT_TRUE(one.finding.is_none()) << to_string(one.finding);
  EXPECT_FALSE(one.offset.known());
  for (int n = 1; n <= static_cast<int>(FieldTurnCause::pole_pairs_differ); ++n)
    EXPECT_GT(to_string(static_cast<FieldTurnCause>(n)).size(), 20u);
}

}  // namespace kmax::calibration::field_turn_fit_test
