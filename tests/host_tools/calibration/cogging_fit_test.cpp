#include "host_tools/calibration/cogging_fit.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "tests/host_tools/calibration/torque_loop.hpp"

namespace kmax::calibration::cogging_fit_test {

using test::BenchMotor;
using test::MotorBench;

constexpr double stiffness = 4000.0;  // N/m

struct Sweep {
  std::vector<double> force, angle;
  CoggingSweep view() const { return {force, angle}; }
};

// A spring-damper to a point that moves.
Sweep sweep(MotorBench& bench, test::TorqueLoop& loop, double& point, double stroke, double speed) {
  const BenchMotor& motor = bench.motor();
  const auto ticks = static_cast<std::size_t>(std::abs(stroke) / speed / test::tick);
  for (std::size_t k = 0; k < ticks; ++k) {
    point += stroke / static_cast<double>(ticks);
    const double position = loop.count() * test::two_pi / motor.counts_per_turn * motor.transmission;
    const double velocity = bench.drive().handle().velocity();
    const double force = stiffness * (point - position) + 30.0 * (std::copysign(speed, stroke) - velocity);
    loop.step(std::clamp(force, -3.0, 3.0) * motor.transmission / motor.torque_constant());
  }
  const auto record = loop.take();
  Sweep out;
  const auto force = record.force(motor.torque_constant()), angle = record.shaft_angle();
  for (std::size_t k = 0; k < force.size(); k += 10) {
    out.force.push_back(force[k]);
    out.angle.push_back(angle[k]);
  }
  return out;
}

// m/s at which the handle's inertia makes the cogging 1 % too large: it adds m (N v / transmission)^2 to the
// stiffness.
double slow_speed(double transmission, double periods, double mass) {
  return transmission / periods * std::sqrt(0.01 * stiffness / mass);
}

class CoggingOfMotors : public testing::TestWithParam<std::size_t> {};

TEST_P(CoggingOfMotors, CoggingAndFriction) {
  const BenchMotor motor = test::bench_motors()[GetParam()];
  double worst_friction = 0.0, worst_cogging = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    double point = 1e-3 * static_cast<double>(seed);
    MotorBench bench(motor, seed, point);
    test::TorqueLoop loop(bench);
    const double speed =
        motor.brushed() ? 0.01
                        : slow_speed(motor.transmission, motor.pmsm().cogging_periods, motor.device.mass);
    const double stroke = 0.3 * test::two_pi * motor.transmission;
    const Sweep there = sweep(bench, loop, point, stroke, speed);
    const Sweep back = sweep(bench, loop, point, -stroke, speed);
    const CoggingSweep views[] = {there.view(), back.view()};
    CoggingFitConfig config;
    config.interval = 10 * test::tick;
    config.counts_per_turn = motor.counts_per_turn;
    const CoggingFit fit = fit_cogging(views, config);
    ASSERT_EQ(to_string(fit.finding), "");
    const double amplitude = motor.brushed() ? 0.0 : motor.pmsm().cogging_torque / motor.transmission;
    if (!motor.brushed()) {
      EXPECT_EQ(fit.cogging_periods, static_cast<int>(motor.pmsm().cogging_periods));
    } else {
      EXPECT_EQ(fit.cogging_periods, 0);
    }
    worst_friction = std::max(worst_friction, std::abs(fit.friction.value / motor.device.friction - 1.0));
    worst_cogging =
        std::max(worst_cogging, std::hypot(fit.cogging_sine_1.value + amplitude, fit.cogging_cosine_1.value));
  }
  std::printf("%s, worst of 5: friction %.2f %%, cogging off by %.4f N\n", motor.name.c_str(),
              100 * worst_friction, worst_cogging);
  // Where the noise of the current shakes the handle by more than its friction (the second gimbal motor: 0.5
  // N of noise, 0.2 N of friction, 1 mm/s), friction shows less.
  EXPECT_LT(worst_friction, 0.15);
  EXPECT_LT(worst_cogging, 0.01);
}

INSTANTIATE_TEST_SUITE_P(CoggingFit, CoggingOfMotors, testing::Range<std::size_t>(0, 5));

struct Truth {
  double friction = 0.1, constant = 0.05, cosine = 0.0, sine = 0.0;
  int periods = 42;
  double cosine_1 = 0.03, sine_1 = -0.06, cosine_2 = 0.01, sine_2 = 0.02;
  double device(double angle) const {
    return constant + cosine * std::cos(angle) + sine * std::sin(angle) +
           cosine_1 * std::cos(periods * angle) + sine_1 * std::sin(periods * angle) +
           cosine_2 * std::cos(2 * periods * angle) + sine_2 * std::sin(2 * periods * angle);
  }
};

Sweep ideal(const Truth& truth, double first, double turns, double direction, double noise,
            std::uint64_t seed) {
  simulation::NoiseGenerator random(seed);
  Sweep out;
  constexpr int samples = 6000;
  for (int n = 0; n < samples; ++n) {
    const double share = static_cast<double>(n) / samples;
    const double angle = test::two_pi * (first + turns * (direction > 0.0 ? share : 1.0 - share));
    out.angle.push_back(std::floor(angle / test::two_pi * 8192.0) / 8192.0 * test::two_pi);
    out.force.push_back(direction * truth.friction - truth.device(angle) + noise * random.gaussian());
  }
  return out;
}

CoggingFit fit_of(const Truth& truth, double turns, double noise = 0.1, std::uint64_t seed = 1) {
  const Sweep there = ideal(truth, 0.1, turns, 1.0, noise, seed),
              back = ideal(truth, 0.1, turns, -1.0, noise, seed + 1);
  const CoggingSweep views[] = {there.view(), back.view()};
  CoggingFitConfig config;
  config.counts_per_turn = 8192.0;
  return fit_cogging(views, config);
}

TEST(CoggingFit, AllTermsOfAWholeTurn) {
  Truth truth;
  truth.cosine = 0.08;
  truth.sine = -0.05;
  const CoggingFit fit = fit_of(truth, 1.1);
  ASSERT_EQ(to_string(fit.finding), "");
  EXPECT_EQ(fit.cogging_periods, 42);
  EXPECT_TRUE(fit.gravity_turns);
  EXPECT_NEAR(fit.friction.value, truth.friction, 0.006);
  EXPECT_NEAR(fit.gravity_constant.value, truth.constant, 0.006);
  EXPECT_NEAR(fit.gravity_cosine.value, truth.cosine, 0.006);
  EXPECT_NEAR(fit.gravity_sine.value, truth.sine, 0.006);
  EXPECT_NEAR(fit.cogging_cosine_1.value, truth.cosine_1, 0.006);
  EXPECT_NEAR(fit.cogging_sine_1.value, truth.sine_1, 0.006);
  EXPECT_NEAR(fit.cogging_cosine_2.value, truth.cosine_2, 0.006);
  EXPECT_NEAR(fit.cogging_sine_2.value, truth.sine_2, 0.006);
  EXPECT_NEAR(fit.device_force_at(1.0), truth.device(1.0), 0.02);
  EXPECT_NEAR(fit.residual, 0.1, 0.01);
  EXPECT_NEAR(fit.range, 1.1, 0.1);
  EXPECT_NEAR(fit.speed, 1.1 * test::two_pi / (6000 * 50e-6), 0.05 * fit.speed);
}

TEST(CoggingFit, PeriodsAreFoundOverAFifthOfATurn) {
  for (const int periods : {12, 24, 66, 84, 132, 264}) {
    Truth truth;
    truth.periods = periods;
    const CoggingFit fit = fit_of(truth, periods < 20 ? 0.4 : 0.2);
    if (fit.finding.cause == CoggingCause::periods_ambiguous) continue;
    ASSERT_EQ(to_string(fit.finding), "") << periods;
    EXPECT_EQ(fit.cogging_periods, periods);
  }
}

TEST(CoggingFit, NoCoggingIsNotInvented) {
  int invented = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Truth truth;
    truth.cosine_1 = truth.sine_1 = truth.cosine_2 = truth.sine_2 = 0.0;
    const CoggingFit fit = fit_of(truth, 0.3, 0.1, 10 * seed);
    EXPECT_FALSE(fit.gravity_turns);
    EXPECT_NEAR(fit.gravity_constant.value, 0.05, 0.01);
    invented += fit.cogging_periods != 0 ? 1 : 0;
  }
  EXPECT_EQ(invented, 0);
}

TEST(CoggingFit, AStrongSecondHarmonicIsNotTakenForTheFirst) {
  Truth truth;
  truth.cosine_1 = 0.04;
  truth.sine_1 = 0.0;
  truth.cosine_2 = 0.08;
  EXPECT_EQ(fit_of(truth, 0.3).cogging_periods, 42);
}

TEST(CoggingFit, WhatIsWrongIsNamed) {
  const Truth truth;
  EXPECT_EQ(fit_cogging({}, {}).finding.cause, CoggingCause::too_little_data);
  const Sweep there = ideal(truth, 0.1, 0.3, 1.0, 0.1, 1), back = ideal(truth, 0.1, 0.3, -1.0, 0.1, 2);
  CoggingFitConfig config;
  config.counts_per_turn = 8192.0;
  const auto cause = [&](const Sweep& a, const Sweep& b) {
    const CoggingSweep views[] = {a.view(), b.view()};
    return fit_cogging(views, config).finding.cause;
  };
  ASSERT_EQ(cause(there, back), CoggingCause::none);
  EXPECT_EQ(cause(there, there), CoggingCause::one_direction);
  Sweep bad = back;
  bad.force.pop_back();
  EXPECT_EQ(cause(there, bad), CoggingCause::too_little_data);
  bad = back;
  bad.angle[9] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(cause(there, bad), CoggingCause::not_finite);
  bad = back;
  for (double& angle : bad.angle) angle = 0.3;
  Sweep still = there;
  still.angle = bad.angle;
  EXPECT_EQ(cause(still, bad), CoggingCause::no_motion);
  // The sweeps were at different places.
  EXPECT_EQ(cause(there, ideal(truth, 0.6, 0.3, -1.0, 0.1, 2)), CoggingCause::too_little_data);
  Truth coarse;
  coarse.periods = 6;
  EXPECT_EQ(fit_of(coarse, 0.25).finding.cause, CoggingCause::range_too_short);
  // From detent to detent: most of the time it stands.
  Sweep jumping = there, jumping_back = back;
  for (Sweep* sweep : {&jumping, &jumping_back})
    for (double& angle : sweep->angle) angle = std::floor(angle * 42.0 / test::two_pi) / 42.0 * test::two_pi;
  EXPECT_NE(cause(jumping, jumping_back), CoggingCause::none);
  for (int n = 1; n <= static_cast<int>(CoggingCause::periods_ambiguous); ++n)
    EXPECT_GT(to_string(static_cast<CoggingCause>(n)).size(), 20u);
}

}  // namespace kmax::calibration::cogging_fit_test
