#include "host_tools/experiment/simulated_touch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_tools/simulated_board/scene_run.hpp"

namespace kmax::experiment::simulated_touch_test {

using simulation::ContactVerdict;

TouchSetup plain(double stiffness) {
  TouchSetup setup;
  setup.wall.wall.kind = control::WallKind::plain;
  setup.wall.wall.stiffness = static_cast<float>(stiffness);
  return setup;
}

TEST(SimulatedTouch, ASoftWallHoldsStillAndAStiffOneDoesNot) {
  EXPECT_EQ(simulate_touch(plain(500)).verdict, ContactVerdict::stable);
  const TouchOutcome stiff = simulate_touch(plain(8000));
  EXPECT_EQ(stiff.verdict, ContactVerdict::unstable);
  EXPECT_GT(stiff.peak_to_peak, 0.165e-3);
}

// The whole firmware and the bare loop on the same handle: the touch leaves out what does not matter. The
// board samples at multiples of 2 ms from arming with the soft start wound up, so both run without one.
TEST(SimulatedTouch, IsWhatTheWholeFirmwareMakesOfTheSameScene) {
  const char* text = R"(
    duration = 4.0
    [device]
    friction = 0.093
    [operator]
    [motion]
    [encoder]
    [parameters]
    haptic.rate = 500
    wall.law = "magnetic"
    wall.stiffness = 5500
    wall.magnetic_coefficient = 1.0
    force.ramp_time = 0.0
    velocity.limit = 0.0
  )";
  const simulation::Scene scene = simulation::parse_scene(text, "scene", simulated_board::check_parameter);
  const simulated_board::RunResult whole = simulated_board::run_scene(scene);
  ASSERT_FALSE(whole.samples[0].empty());

  TouchSetup setup = plain(5500);
  setup.device = scene.axes[0].device;
  setup.person = *scene.axes[0].person;
  setup.motion = *scene.axes[0].motion;
  setup.wall = touched_wall(500, scene.axes[0].encoder.count_length(), 3.3);
  setup.wall.wall.kind = control::WallKind::magnetic;
  setup.wall.wall.stiffness = 5500;
  setup.wall.wall.magnetic_coefficient = 1;
  std::vector<TouchSample> bare;
  simulate_touch(setup, &bare);
  // The board's plant advances in 50 us, the touch's in 2 ms, and its count length is a float's: the same
  // motion until the oscillation has made the difference of the last bits grow.
  const std::size_t compared = std::min<std::size_t>({whole.samples[0].size(), bare.size(), 200});
  ASSERT_EQ(compared, 200U);
  double worst = 0.0;
  // The firmware's first haptic sample may come up to one period after the person was told to begin.
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t shift = 0; shift < 2; ++shift) {
    worst = 0.0;
    for (std::size_t n = 0; n + shift < compared; ++n)
      worst = std::max(worst, std::abs(whole.samples[0][n + shift].true_position - bare[n].position));
    best = std::min(best, worst);
  }
  EXPECT_LT(best, 0.6e-3);  // 0.2 m/s x 2 ms is 0.4 mm
  const TouchOutcome outcome = simulate_touch(setup);
  ASSERT_TRUE(whole.contact.has_value());
  EXPECT_EQ(outcome.verdict, whole.contact->verdict);
}

TEST(SimulatedTouch, DecidesEarlyAsItWouldAtTheEnd) {
  for (const double stiffness : {800.0, 2000.0, 3000.0, 3600.0, 4200.0, 5500.0}) {
    for (const double push : {0.3, 1.0}) {
      TouchSetup setup = plain(stiffness);
      setup.motion.push_force = push;
      std::vector<TouchSample> all;
      const TouchOutcome whole = simulate_touch(setup, &all);
      const TouchOutcome early = simulate_touch(setup);
      EXPECT_EQ(early.verdict, whole.verdict) << stiffness << ' ' << push;
      EXPECT_LE(early.samples, whole.samples);
    }
  }
}

// The judgement agrees with the one that recordings of real devices get.
TEST(SimulatedTouch, JudgesAsRecordingsAreJudged) {
  for (const double stiffness : {1000.0, 3000.0, 4000.0, 6000.0}) {
    const TouchSetup setup = plain(stiffness);
    std::vector<TouchSample> samples;
    const TouchOutcome outcome = simulate_touch(setup, &samples);
    std::vector<simulation::ContactSample> recording;
    for (const TouchSample& sample : samples) recording.push_back({sample.time, sample.position});
    simulation::ContactCriterion criterion;
    criterion.window_end = samples.back().time + 1e-9;
    criterion.window_begin = criterion.window_end - 1.0;
    const simulation::ContactMeasure measure = simulation::measure_contact(recording, criterion);
    EXPECT_EQ(outcome.verdict, measure.verdict) << stiffness;
    EXPECT_NEAR(outcome.peak_to_peak, measure.peak_to_peak, 2e-5) << stiffness;
  }
}

TEST(SimulatedTouch, AHandThatHoversInTheFieldHasTouchedNothing) {
  TouchSetup setup = plain(2000);
  setup.wall.wall.kind = control::WallKind::magnetic;
  setup.wall.wall.magnetic_coefficient = 2;
  setup.motion.push_force = 0.0;
  setup.person.push_lag = 100.0;  // does not push through the field
  EXPECT_EQ(simulate_touch(setup).verdict, ContactVerdict::no_contact);
}

TEST(SimulatedTouch, TheForceCanBeJudgedInstead) {
  // On a coarse encoder one count is 0.4 N here: the handle moves little, the force swings.
  TouchSetup setup = plain(5500);
  std::vector<TouchSample> samples;
  const TouchOutcome moved = simulate_touch(setup, &samples);
  ASSERT_EQ(moved.verdict, ContactVerdict::unstable);
  setup.force_threshold = 1e6;
  EXPECT_EQ(simulate_touch(setup).verdict, ContactVerdict::stable);
  setup.force_threshold = 0.5;
  EXPECT_EQ(simulate_touch(setup).verdict, ContactVerdict::unstable);
}

TEST(SimulatedTouch, CanBeJudgedByBothAtOnce) {
  const auto judged = [](double stiffness, double threshold, double force) {
    TouchSetup setup = plain(stiffness);
    setup.threshold = threshold;
    setup.force_threshold = force;
    setup.judges_both = true;
    return simulate_touch(setup);
  };
  EXPECT_EQ(judged(5500, 0.165e-3, 1e6).verdict, ContactVerdict::unstable) << "by the position";
  EXPECT_FALSE(judged(5500, 0.165e-3, 1e6).by_force);
  EXPECT_EQ(judged(5500, 1.0, 0.5).verdict, ContactVerdict::unstable) << "by the force";
  EXPECT_TRUE(judged(5500, 1.0, 0.5).by_force);
  EXPECT_EQ(judged(5500, 1.0, 1e6).verdict, ContactVerdict::stable);
  EXPECT_EQ(judged(5500, 0.165e-3, 0.0).verdict, ContactVerdict::unstable) << "without a force threshold";
}

TEST(SimulatedTouch, ReportsSaturationOnlyOfAForceThatIsClipped) {
  TouchSetup setup = plain(5500);
  EXPECT_GT(simulate_touch(setup).saturated_share, 0.01);
  setup.device.force_limit = 0.0;
  setup.wall = touched_wall(500, 0.055e-3, 0.0);
  setup.wall.wall.stiffness = 5500;
  EXPECT_EQ(simulate_touch(setup).saturated_share, 0.0);
}

TEST(SimulatedTouch, TellsSpeedAndCoefficientAtContact) {
  TouchSetup setup = plain(1000);
  setup.wall.wall.kind = control::WallKind::adaptive;
  setup.wall.wall.adaptive.mode = control::AdaptiveMode::latched;
  setup.motion.approach_speed = 0.5;
  const TouchOutcome outcome = simulate_touch(setup);
  EXPECT_GT(outcome.contact_speed, 0.2);
  EXPECT_LT(outcome.contact_speed, 0.7);
  // Eq. 7 is V + 0.8 N.
  EXPECT_NEAR(outcome.coefficient_at_contact, 0.8 + outcome.contact_speed, 0.15);
}

TEST(SimulatedTouch, TheOtherSideIsTheMirrorImage) {
  TouchSetup right = plain(3000);
  TouchSetup left = right;
  left.motion.wall_side = -1.0;
  left.motion.start_position = -left.motion.start_position;
  left.wall.wall_side = -1;
  // floor() is not symmetric about 0: half a count apart, both see the same distances to within one count.
  const TouchOutcome a = simulate_touch(right), b = simulate_touch(left);
  EXPECT_EQ(a.verdict, b.verdict);
}

// A field of 10 um is a spring of 400 N/mm in front of the wall: met at a count of 1 nm, so that no flipped
// count can part two integrators that share nothing.
TEST(SimulatedTouch, AFieldOfTenMicrometresAgreesWithTheAdaptiveReference) {
  TouchSetup setup = plain(8410);
  setup.wall = touched_wall(20000, 1e-9, 0.0);
  setup.wall.wall.kind = control::WallKind::magnetic;
  setup.wall.wall.stiffness = 8410;
  setup.wall.wall.magnetic_coefficient = 2;
  setup.wall.wall.magnetic_length = 10e-6F;
  setup.device.force_limit = 0.0;
  setup.motion.start_position = 1e-3;
  setup.motion.hold_time = 0.2;
  setup.window = 0.1;
  std::vector<TouchSample> exact, reference;
  simulate_touch(setup, &exact);
  setup.integrator.kind = simulation::IntegratorKind::adaptive;
  setup.integrator.tolerance = 1e-13;
  simulate_touch(setup, &reference);
  const auto touched = std::find_if(exact.begin(), exact.end(),
                                    [](const TouchSample& sample) { return sample.position <= 0.0; });
  ASSERT_NE(touched, exact.end());
  // A float force at 1 nm rounds at some 1e-8 N, which the unstable field multiplies: 5 ms from the first
  // touch on.
  const auto compared = static_cast<std::size_t>(touched - exact.begin()) + 100;
  ASSERT_LE(compared, std::min(exact.size(), reference.size()));
  double swing = 0.0;
  for (std::size_t n = 0; n < compared; ++n) {
    EXPECT_NEAR(exact[n].position, reference[n].position, 1e-9) << n;
    swing = std::max(swing, std::abs(exact[n].force));
  }
  EXPECT_GT(swing, 2.0);
}

TEST(SimulatedTouch, RefusesSettingsThatMakeNoSense) {
  const auto refused = [](const auto& change) {
    TouchSetup setup = plain(1000);
    change(setup);
    EXPECT_THROW(simulate_touch(setup), std::invalid_argument);
  };
  refused([](TouchSetup& s) { s.wall.tick_rate = 0.0; });
  refused([](TouchSetup& s) { s.wall.tick_rate = std::numeric_limits<double>::quiet_NaN(); });
  refused([](TouchSetup& s) { s.wall.divider = 2; });
  refused([](TouchSetup& s) { s.window = 0.0; });
  refused([](TouchSetup& s) { s.window = 10.0; });
  refused([](TouchSetup& s) { s.window = 0.001; });
  refused([](TouchSetup& s) { s.threshold = 0.0; });
  refused([](TouchSetup& s) { s.threshold = std::numeric_limits<double>::quiet_NaN(); });
  refused([](TouchSetup& s) { s.force_threshold = -1.0; });
  refused([](TouchSetup& s) { s.least_rendered_share = 1.1; });
  refused([](TouchSetup& s) { s.least_rendered_share = std::numeric_limits<double>::quiet_NaN(); });
  refused([](TouchSetup& s) { s.wall.count_length = 0.0; });
  refused([](TouchSetup& s) { s.device.mass = -1.0; });
  refused([](TouchSetup& s) { s.person.grip_stiffness = std::numeric_limits<double>::infinity(); });
}

TouchSetup growing(double stiffness, control::VelocityEstimatorKind calm_by) {
  TouchSetup setup = plain(stiffness);
  setup.wall.wall.growing.touch_stiffness = 2000.0F;
  setup.wall.velocity = {.kind = calm_by};
  return setup;
}

TEST(SimulatedTouch, AWallThatGrowsIsHeldOnceItHasComeToItsStiffness) {
  const TouchOutcome outcome = simulate_touch(growing(8000.0, control::VelocityEstimatorKind::foaw));
  EXPECT_FALSE(outcome.unstable());
  EXPECT_GT(outcome.rendered_share, 0.99);
  EXPECT_TRUE(outcome.held());
  EXPECT_EQ(simulate_touch(plain(2000)).rendered_share, 1.0);
}

// Noticing each count, it takes back what it has grown and never gets there.
TEST(SimulatedTouch, AWallThatStaysFarSofterThanItWasSetIsNotHeldHoweverStill) {
  TouchSetup setup = growing(15000.0, control::VelocityEstimatorKind::difference);
  setup.motion.push_force = 1.0;
  for (const bool by_force : {false, true}) {
    setup.force_threshold = by_force ? 1.0 : 0.0;
    const TouchOutcome outcome = simulate_touch(setup);
    EXPECT_FALSE(outcome.unstable());
    EXPECT_LT(outcome.rendered_share, 0.7);
    EXPECT_GT(outcome.rendered_share, 2.0 / 15.0);
    EXPECT_FALSE(outcome.held());
  }
  const TouchJudgement each[]{{false, 0.165e-3}, {true, 1.0}};
  for (const TouchOutcome& outcome : judge_touch(setup, each)) EXPECT_FALSE(outcome.held());
  setup.least_rendered_share = 0.0;
  EXPECT_TRUE(simulate_touch(setup).held());
}

// Which is said to have ended it when it also stays softer.
TEST(SimulatedTouch, WhatSwingsByForceIsUnstableHoweverSoftItStays) {
  TouchSetup setup = growing(15000.0, control::VelocityEstimatorKind::difference);
  setup.force_threshold = 1e-3;
  setup.judges_both = true;
  const TouchOutcome outcome = simulate_touch(setup);
  EXPECT_TRUE(outcome.unstable());
  EXPECT_TRUE(outcome.by_force);
  EXPECT_FALSE(outcome.rendered);
}

TEST(SimulatedTouch, AWallThatGrowsAndThatNobodyGetsToIsNotCalledSoft) {
  TouchSetup setup = growing(15000.0, control::VelocityEstimatorKind::foaw);
  setup.wall.wall.kind = control::WallKind::magnetic;
  setup.wall.wall.magnetic_coefficient = 3.0F;
  setup.wall.wall.magnetic_length = 0.05F;
  setup.motion.push_force = 0.01;
  setup.person.activation_gain = 0.0;
  const TouchOutcome outcome = simulate_touch(setup);
  ASSERT_EQ(outcome.verdict, simulation::ContactVerdict::no_contact);
  EXPECT_TRUE(outcome.held());
}

// One rule for what a person answers to, whatever the experiment.
TEST(ResistedForce, IsAllThatIsCommandedButTheWall) {
  using Loop = control::HapticLoop<float>;
  const auto at = [](control::InterferenceMode mode, std::int64_t count, double share) {
    control::HapticLoopConfig<float> wall = touched_wall(500.0, 0.055e-3, 0.0);
    wall.wall.kind = control::WallKind::magnetic;
    wall.wall.magnetic_coefficient = 2.0F;
    wall.interference = {mode, 5.0F, 3.0F, 0.0F};
    const Loop::Coefficients coefficients = Loop::prepare(wall, 0);
    Loop loop;
    loop.tick(coefficients, count, true);
    const Resisted resisted = resisted_force(loop, coefficients, share);
    return std::pair(resisted.along, resisted.across);
  };
  using control::InterferenceMode;
  constexpr std::int64_t inside = -20, outside = 100'000;
  EXPECT_EQ(at(InterferenceMode::none, inside, 1.0), std::pair(2.0, 0.0));
  EXPECT_EQ(at(InterferenceMode::perpendicular, inside, 1.0), std::pair(10.0, 0.0));
  EXPECT_EQ(at(InterferenceMode::perpendicular, inside, 0.5), std::pair(7.5, 0.0));
  EXPECT_EQ(at(InterferenceMode::parallel, inside, 0.5), std::pair(5.0, 5.0));
  EXPECT_NEAR(at(InterferenceMode::perpendicular, outside, 1.0).first, 3.0, 1e-3);
  EXPECT_NEAR(at(InterferenceMode::parallel, outside, 1.0).first, 0.0, 1e-3);
  EXPECT_EQ(at(InterferenceMode::parallel, outside, 1.0).second, 0.0);
}

}  // namespace kmax::experiment::simulated_touch_test
