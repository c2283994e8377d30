#include "host_tools/calibration/current_offset.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/host_tools/calibration/motor_bench.hpp"

namespace kmax::calibration::current_offset_test {

TEST(CurrentOffset, ASensorOfTheSimulationIsGood) {
  for (const test::BenchMotor& motor : test::bench_motors()) {
    test::MotorBench bench(motor, 3);
    std::vector<double> current;
    for (int k = 0; k < 2000; ++k) current.push_back(bench.sample().current_b);
    const CurrentOffset offset = check_current_offset(current);
    EXPECT_EQ(to_string(offset.finding), "") << motor.name;
    EXPECT_NEAR(offset.mean.value, 0.0, 0.01);
    EXPECT_NEAR(offset.noise, 0.03, 0.015);
  }
}

TEST(CurrentOffset, WhatIsWrongIsNamed) {
  simulation::NoiseGenerator random(1);
  std::vector<double> current(500);
  for (double& i : current) i = 0.03 * random.gaussian();
  ASSERT_EQ(to_string(check_current_offset(current).finding), "");
  EXPECT_NEAR(check_current_offset(current).noise, 0.03, 0.005);
  EXPECT_EQ(check_current_offset({}).finding.cause, CurrentOffsetCause::too_little_data);
  EXPECT_EQ(check_current_offset(std::span(current).first(99)).finding.cause,
            CurrentOffsetCause::too_little_data);
  auto bad = current;
  bad[7] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(check_current_offset(bad).finding.cause, CurrentOffsetCause::not_finite);
  EXPECT_EQ(check_current_offset(bad).finding.found, 7.0);
  bad = current;
  for (double& i : bad) i -= 0.3;
  EXPECT_EQ(check_current_offset(bad).finding.cause, CurrentOffsetCause::offset_large);
  for (double& i : bad) i = 40.0;
  EXPECT_EQ(check_current_offset(bad).finding.cause, CurrentOffsetCause::railed);
  bad = current;
  for (double& i : bad) i *= 10.0;
  EXPECT_EQ(check_current_offset(bad).finding.cause, CurrentOffsetCause::noise_large);
  for (double& i : bad) i = 0.0;
  EXPECT_EQ(to_string(check_current_offset(bad).finding), "") << "a quiet sensor within one step";
  EXPECT_GT(check_current_offset(bad).mean.standard_error, 0.0);
  for (int n = 1; n <= static_cast<int>(CurrentOffsetCause::railed); ++n)
    EXPECT_GT(to_string(static_cast<CurrentOffsetCause>(n)).size(), 20u);
}

}  // namespace kmax::calibration::current_offset_test
