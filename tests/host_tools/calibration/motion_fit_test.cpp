#include "host_tools/calibration/motion_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "tests/host_tools/calibration/torque_loop.hpp"

namespace kmax::calibration::motion_fit_test {

using test::BenchMotor;
using test::MotorBench;

// For 10 % of friction (3 standard errors), when one sample's force has the noise `noise_force` (N); as
// measured.
std::size_t samples_for(double noise_force, double friction) {
  const double ratio = 2.9 * noise_force / (friction * 0.03);
  return static_cast<std::size_t>(std::clamp(ratio * ratio, 24000.0, 500000.0));
}

class MotionOfMotors : public testing::TestWithParam<std::size_t> {};

TEST_P(MotionOfMotors, MassAndFrictionWithinTenPercent) {
  const BenchMotor motor = test::bench_motors()[GetParam()];
  double worst_mass = 0.0, worst_friction = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    MotorBench bench(motor, seed, 1e-3 * static_cast<double>(seed));
    const double force = motion_force_ratio * motor.device.friction;
    const double current = force * motor.transmission / motor.torque_constant();
    const int half = static_cast<int>(test::swing_half_period(6e-3, force, motor.device.mass) / test::tick);
    // Two speeds tell damping from friction; several records of each against the current's noise.
    const double noise = motor.noise / 0.5e-3 * (motor.brushed() ? std::sqrt(0.5) : std::sqrt(2.0 / 3.0));
    const double noise_force = noise * motor.torque_constant() / motor.transmission;
    const std::size_t records = (samples_for(noise_force, motor.device.friction) + 5999) / 6000;
    std::vector<std::vector<double>> forces(records), positions(records);
    std::vector<MotionRecord> views;
    for (std::size_t n = 0; n < records; ++n) {
      const auto record = test::oscillate(bench, current, n % 2 == 0 ? half : half / 3, 400, 6000);
      forces[n] = record.force(motor.torque_constant());
      positions[n] = record.position();
      views.push_back({forces[n], positions[n]});
    }
    MotionFitConfig config;
    config.count_length = test::two_pi * motor.transmission / motor.counts_per_turn;
    if (!motor.brushed()) {
      config.transmission = motor.transmission;
      config.cogging_periods = motor.pmsm().cogging_periods;
    }
    const MotionFit fit = fit_motion(views, config);
    ASSERT_EQ(to_string(fit.finding), "");
    const double mass = std::abs(fit.mass.value / motor.device.mass - 1.0);
    const double friction = std::abs(fit.friction.value / motor.device.friction - 1.0);
    worst_mass = std::max(worst_mass, mass);
    worst_friction = std::max(worst_friction, friction);
  }
  std::printf("%s, worst of 20: mass %.2f %%, friction %.2f %%\n", motor.name.c_str(), 100 * worst_mass,
              100 * worst_friction);
  EXPECT_LT(worst_mass, 0.1);
  EXPECT_LT(worst_friction, 0.1);
}

INSTANTIATE_TEST_SUITE_P(MotionFit, MotionOfMotors, testing::Range<std::size_t>(0, 5));

struct Track {
  std::vector<double> force, position;
  MotionRecord view() const { return {force, position}; }
};

// The handle of the simulation under a square wave of force, seen in counts. `gravity`: N.
Track ideal(const simulation::DeviceModel& device, double force, int half_period, std::size_t samples,
            double count_length, double gravity = 0.0, double noise = 0.0) {
  simulation::CoupledHandle handle(device);
  simulation::NoiseGenerator random(5);
  Track track;
  for (std::size_t k = 0; k < samples; ++k) {
    const bool up =
        ((k + static_cast<std::size_t>(half_period) / 2) / static_cast<std::size_t>(half_period)) % 2 == 0;
    const double now = up ? force : -force;
    track.force.push_back(now - gravity + noise * random.gaussian());
    track.position.push_back(std::floor(handle.position() / count_length) * count_length);
    handle.advance(now, 0.0, test::tick);
  }
  return track;
}

MotionFit fit_of(const Track& track, double count_length) {
  const MotionRecord view[] = {track.view()};
  MotionFitConfig config;
  config.count_length = count_length;
  return fit_motion(view, config);
}

TEST(MotionFit, MassDampingFrictionAndGravityOfAnExactHandle) {
  const simulation::DeviceModel device{0.05, 0.8, 0.3, 0.0};
  const Track fast = ideal(device, 1.5, 300, 6000, 5e-6, 0.4, 0.02),
              slow = ideal(device, 1.5, 900, 6000, 5e-6, 0.4, 0.02);
  const MotionRecord views[] = {fast.view(), slow.view()};
  MotionFitConfig config;
  config.count_length = 5e-6;
  const MotionFit fit = fit_motion(views, config);
  ASSERT_EQ(to_string(fit.finding), "");
  EXPECT_NEAR(fit.mass.value, 0.05, 0.0015);
  EXPECT_NEAR(fit.damping.value, 0.8, 0.12);
  EXPECT_NEAR(fit.friction.value, 0.3, 0.03);
  EXPECT_NEAR(fit.bias.value, 0.4, 0.01);
}

TEST(MotionFit, PhasesOfStickingAreLeftOut) {
  // The force alternates between sliding and, for most of the time, less than the friction.
  const simulation::DeviceModel device{0.05, 0.1, 0.5, 0.0};
  simulation::CoupledHandle handle(device);
  Track track;
  for (std::size_t k = 0; k < 40000; ++k) {
    const std::size_t phase = (k + 300) % 4800;
    const double force = phase < 600 ? 2.0 : phase < 2400 ? -0.1 : phase < 3000 ? -2.0 : 0.1;
    track.force.push_back(force);
    track.position.push_back(std::floor(handle.position() / 5e-6) * 5e-6);
    handle.advance(force, 0.0, test::tick);
  }
  const MotionFit fit = fit_of(track, 5e-6);
  ASSERT_EQ(to_string(fit.finding), "");
  EXPECT_GT(fit.sticking_share, 0.1);
  EXPECT_NEAR(fit.mass.value, 0.05, 0.005);
  EXPECT_NEAR(fit.friction.value, 0.5, 0.05);
}

TEST(MotionFit, WhatIsWrongIsNamed) {
  const simulation::DeviceModel device{0.05, 0.1, 0.1, 0.0};
  const Track good = ideal(device, 1.0, 400, 6000, 16e-6);
  ASSERT_EQ(to_string(fit_of(good, 16e-6).finding), "");
  EXPECT_EQ(fit_motion({}, {}).finding.cause, MotionCause::too_little_data);
  Track bad = good;
  bad.force.pop_back();
  EXPECT_EQ(fit_of(bad, 16e-6).finding.cause, MotionCause::too_little_data);
  EXPECT_EQ(fit_of(ideal(device, 1.0, 400, 20, 16e-6), 16e-6).finding.cause, MotionCause::too_little_data);
  bad = good;
  bad.position[77] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(fit_of(bad, 16e-6).finding.cause, MotionCause::not_finite);
  bad = good;
  for (double& force : bad.force) force = 0.0;
  EXPECT_EQ(fit_of(bad, 16e-6).finding.cause, MotionCause::no_force);
  EXPECT_EQ(fit_of(ideal(device, 0.05, 400, 6000, 16e-6), 16e-6).finding.cause, MotionCause::no_motion);
  bad = good;
  for (double& x : bad.position) x = -x;
  EXPECT_EQ(fit_of(bad, 16e-6).finding.cause, MotionCause::reversed);
  // Pushed by a hand, always along the motion.
  bad = good;
  for (std::size_t k = 30; k + 30 < bad.force.size(); ++k)
    bad.force[k] -= std::copysign(0.6, good.position[k + 30] - good.position[k - 30]);
  EXPECT_EQ(fit_of(bad, 16e-6).finding.cause, MotionCause::negative_friction);
  for (int n = 1; n <= static_cast<int>(MotionCause::not_resolved); ++n)
    EXPECT_GT(to_string(static_cast<MotionCause>(n)).size(), 20u);
}

TEST(MotionFit, HalfAWaveOnlyIsNotAResult) {
  const simulation::DeviceModel device{0.05, 0.1, 0.1, 0.0};
  const MotionFit fit = fit_of(ideal(device, 1.0, 400, 300, 16e-6), 16e-6);
  if (fit.finding.is_none()) {
    EXPECT_NEAR(fit.mass.value, 0.05, 4.0 * fit.mass.standard_error);
  }
}

}  // namespace kmax::calibration::motion_fit_test
