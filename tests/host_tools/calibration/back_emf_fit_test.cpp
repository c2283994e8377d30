#include "host_tools/calibration/back_emf_fit.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "tests/host_tools/calibration/torque_loop.hpp"

namespace kmax::calibration::back_emf_fit_test {

using test::BenchMotor;
using test::MotorBench;

BackEmfConfig config_of(const BenchMotor& motor) {
  BackEmfConfig config;
  config.synchronous = !motor.brushed();
  config.resistance = 1.01 * motor.resistance();
  config.resistance_error = 0.02 * motor.resistance();
  config.inductance = motor.brushed() ? motor.inductance() : motor.pmsm().inductance_q;
  config.inductance_d = motor.inductance();
  config.pole_pairs = motor.brushed() ? 1 : static_cast<int>(motor.pmsm().pole_pairs);
  config.counts_per_turn = motor.counts_per_turn;
  return config;
}

BackEmfFit fit_of(const test::TorqueRecord& record, const BackEmfConfig& config) {
  const auto angle = record.shaft_angle();
  const BackEmfRecord view{record.voltage, record.current, angle, record.current_d, record.electrical_angle};
  return fit_back_emf(std::span(&view, 1), config);
}

test::TorqueRecord swing(MotorBench& bench, double current, double way, std::size_t samples) {
  const BenchMotor& motor = bench.motor();
  const double force = current * motor.torque_constant() / motor.transmission;
  const int half = static_cast<int>(test::swing_half_period(way, force, motor.device.mass) / test::tick);
  return test::oscillate(bench, current, half, 400, samples);
}

class BackEmfOfMotors : public testing::TestWithParam<std::size_t> {};

TEST_P(BackEmfOfMotors, TorqueConstantWithinThreePercent) {
  const BenchMotor motor = test::bench_motors()[GetParam()];
  double worst = 0.0, least = 1e9;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    MotorBench bench(motor, seed, 1e-3 * static_cast<double>(seed));
    const BackEmfFit fit = fit_of(swing(bench, motor.current, 6e-3, 6000), config_of(motor));
    ASSERT_EQ(to_string(fit.finding), "");
    worst = std::max(worst, std::abs(fit.torque_constant.value / motor.torque_constant() - 1.0));
    EXPECT_LT(std::abs(fit.torque_constant.value - motor.torque_constant()),
              4.0 * fit.torque_constant.standard_error + 0.002 * motor.torque_constant());
    least = std::min(least, fit.induced_voltage);
  }
  std::printf("%s, worst of 20: k %.2f %%, with %.2f V rms induced\n", motor.name.c_str(), 100 * worst,
              least);
  EXPECT_LT(worst, 0.03);
}

// Half the current and a millimetre of way.
TEST_P(BackEmfOfMotors, TorqueConstantWithinThreePercentFromASmallMotion) {
  const BenchMotor motor = test::bench_motors()[GetParam()];
  double worst = 0.0, most = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    MotorBench bench(motor, seed, 1e-3 * static_cast<double>(seed));
    const BackEmfFit fit = fit_of(swing(bench, 0.5 * motor.current, 1e-3, 6000), config_of(motor));
    ASSERT_EQ(to_string(fit.finding), "");
    worst = std::max(worst, std::abs(fit.torque_constant.value / motor.torque_constant() - 1.0));
    most = std::max(most, fit.induced_voltage);
  }
  std::printf("%s, worst of 20: k %.2f %%, with %.2f V rms induced\n", motor.name.c_str(), 100 * worst, most);
  EXPECT_LT(worst, 0.03);
}

INSTANTIATE_TEST_SUITE_P(BackEmfFit, BackEmfOfMotors, testing::Range<std::size_t>(0, 5));

// 1 V sine of current against 0.3 rad/s steps of an exact shaft, without any simulation.
test::TorqueRecord ideal(double resistance, double k, std::size_t samples) {
  test::TorqueRecord record;
  record.counts_per_turn = 4000.0;
  double angle = 0.0, speed_before = 0.0;
  for (std::size_t n = 0; n < samples; ++n) {
    const double time = static_cast<double>(n) * test::tick;
    const double current = std::sin(300.0 * time), speed = -30.0 * std::cos(300.0 * time);
    angle += 0.5 * test::tick * (speed + speed_before);
    speed_before = speed;
    record.voltage.push_back(resistance * std::sin(300.0 * (time + test::tick)) -
                             k * 30.0 * std::cos(300.0 * (time + test::tick)));
    record.current.push_back(current);
    record.count.push_back(std::floor(angle / test::two_pi * 4000.0));
    record.current_d.push_back(0.0);
  }
  return record;
}

TEST(BackEmfFit, AnExactMotorIsFound) {
  BackEmfConfig config;
  const BackEmfFit fit = fit_of(ideal(2.0, 0.03, 6000), config);
  ASSERT_EQ(to_string(fit.finding), "");
  EXPECT_NEAR(fit.torque_constant.value, 0.03, 0.0003);
  EXPECT_NEAR(fit.resistance.value, 2.0, 0.05);
  EXPECT_NEAR(fit.speed_current_correlation, 0.0, 0.05);
}

TEST(BackEmfFit, WhatIsWrongIsNamed) {
  BackEmfConfig config;
  EXPECT_EQ(fit_back_emf({}, config).finding.cause, BackEmfCause::too_little_data);
  EXPECT_EQ(fit_of(ideal(2.0, 0.03, 20), config).finding.cause, BackEmfCause::too_little_data);
  test::TorqueRecord bad = ideal(2.0, 0.03, 6000);
  bad.voltage.pop_back();
  EXPECT_EQ(fit_of(bad, config).finding.cause, BackEmfCause::too_little_data);
  bad = ideal(2.0, 0.03, 6000);
  bad.current[100] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fit_of(bad, config).finding.cause, BackEmfCause::not_finite);
  bad = ideal(2.0, 0.03, 6000);
  for (double& count : bad.count) count = 12.0;
  EXPECT_EQ(fit_of(bad, config).finding.cause, BackEmfCause::no_motion);
  bad = ideal(2.0, 0.03, 6000);
  for (double& count : bad.count) count = -count;
  EXPECT_EQ(fit_of(bad, config).finding.cause, BackEmfCause::reversed);
  // An encoder that counts something else.
  bad = ideal(2.0, 0.0, 6000);
  simulation::NoiseGenerator random(3);
  for (double& volts : bad.voltage) volts += 0.05 * random.gaussian();
  EXPECT_EQ(fit_of(bad, config).finding.cause, BackEmfCause::no_voltage);
  for (int n = 1; n <= static_cast<int>(BackEmfCause::not_resolved); ++n)
    EXPECT_GT(to_string(static_cast<BackEmfCause>(n)).size(), 20u);
}

TEST(BackEmfFit, BlockedMotorDoesNotMove) {
  const BenchMotor motor = test::bench_motors()[0];
  MotorBench bench(motor, 1);
  bench.drive().block(true);
  EXPECT_EQ(fit_of(swing(bench, motor.current, 6e-3, 3000), config_of(motor)).finding.cause,
            BackEmfCause::no_motion);
}

}  // namespace kmax::calibration::back_emf_fit_test
