#include "host_tools/experiment/max_stiffness/operator_calibration.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"

namespace kmax::experiment::operator_calibration_test {

namespace {

std::vector<StiffnessCondition> both_walls() {
  const auto conditions = stiffness_conditions();
  return {conditions[0], conditions[4]};
}

/// The means of people whose friction is 0.14 N and whose gamma is 0.7 1/N.
CalibrationSettings known_targets(std::size_t people) {
  SubjectSet truth = few_people(people);
  truth.device.friction = 0.14;
  for (Subject& subject : truth.subjects) subject.person.activation_gain = 0.7;
  const auto made = run_max_stiffness_study(truth, both_walls(), quick_run());
  CalibrationSettings settings{};
  settings.plain_target = made.conditions[0].mean();
  settings.magnetic_target = made.conditions[1].mean();
  return settings;
}

}  // namespace

// A target made by known numbers is met by the numbers that are found for it.
TEST(OperatorCalibration, FindsNumbersThatMeetItsTargets) {
  const CalibrationSettings settings = known_targets(4);
  const OperatorCalibration fit = calibrate_operator(few_people(4), settings, quick_run());
  EXPECT_NEAR(fit.plain, settings.plain_target, 50.0);
  EXPECT_NEAR(fit.magnetic, settings.magnetic_target, 75.0);
  EXPECT_TRUE(fit.plain_met && fit.magnetic_met);
  EXPECT_NEAR(fit.friction, 0.14, 0.02);
  EXPECT_NEAR(fit.activation_gain, 0.7, 0.15);
  EXPECT_EQ(fit.set.device.friction, fit.friction);
  EXPECT_EQ(fit.set.subjects[3].person.activation_gain, fit.activation_gain);
  ASSERT_TRUE(fit.set.fitted);
  EXPECT_EQ(fit.set.fitted->plain_target, settings.plain_target);
  EXPECT_EQ(fit.set.fitted->magnetic_target, settings.magnetic_target);
  EXPECT_EQ(fit.set.fitted->force_limit, fit.set.device.force_limit);
  // What it says of itself is what its set gives.
  const auto again = run_max_stiffness_study(fit.set, both_walls(), quick_run());
  EXPECT_EQ(again.conditions[0].mean(), fit.plain);
  EXPECT_EQ(again.conditions[1].mean(), fit.magnetic);
}

// From values that are right, too small and too large the same targets are met in less time. Values beyond
// what is allowed are not used.
TEST(OperatorCalibration, LikelyValuesSaveTimeAndMeetTheSame) {
  CalibrationSettings settings = known_targets(3);
  settings.tolerance = 50.0;
  const OperatorCalibration by_halving = calibrate_operator(few_people(3), settings, quick_run());
  for (const auto& [friction, gain] : {std::pair{0.14, 0.7}, {0.1, 1.1}, {0.25, 0.4}, {2.0, 9.0}}) {
    settings.likely_friction = friction;
    settings.likely_gain = gain;
    const OperatorCalibration fit = calibrate_operator(few_people(3), settings, quick_run());
    EXPECT_NEAR(fit.plain, settings.plain_target, 50.0) << friction;
    EXPECT_NEAR(fit.magnetic, settings.magnetic_target, 50.0) << gain;
    if (friction < 1.0) {
      EXPECT_LT(fit.simulated_time, 0.5 * by_halving.simulated_time) << friction;
    } else {
      EXPECT_EQ(fit.friction, by_halving.friction);
    }
    // What it says of itself is what its set gives, each person looked for from the first stiffness.
    const auto again = run_max_stiffness_study(fit.set, both_walls(), quick_run());
    EXPECT_EQ(again.conditions[0].mean(), fit.plain);
    EXPECT_EQ(again.conditions[1].mean(), fit.magnetic);
  }
  settings.magnetic_target = 100.0;
  settings.likely_friction = 0.14;
  settings.likely_gain = 0.7;
  const OperatorCalibration too_stiff = calibrate_operator(few_people(3), settings, quick_run());
  EXPECT_TRUE(too_stiff.plain_met && !too_stiff.magnetic_met);
  EXPECT_EQ(too_stiff.activation_gain, 0.0);
  EXPECT_LT(too_stiff.steps.size(), 8U);
  // Nor is the other end walked along.
  settings.magnetic_target = known_targets(3).magnetic_target;
  settings.gain_most = 0.2;
  settings.likely_gain = 0.1;
  const OperatorCalibration too_soft = calibrate_operator(few_people(3), settings, quick_run());
  EXPECT_TRUE(too_soft.plain_met && !too_soft.magnetic_met);
  EXPECT_NEAR(too_soft.activation_gain, 0.2, 0.01);
  EXPECT_LT(too_soft.steps.size(), 10U);
}

TEST(OperatorCalibration, SaysWhenATargetIsOutOfReach) {
  CalibrationSettings settings = paper_targets();
  EXPECT_EQ(settings.plain_target, 3580.0);
  EXPECT_EQ(settings.magnetic_target, 8410.0);
  settings.friction_most = 0.01;
  settings.gain_most = 0.01;
  settings.most_steps = 4;
  const OperatorCalibration fit = calibrate_operator(few_people(2), settings, quick_run());
  EXPECT_FALSE(fit.plain_met);
  EXPECT_FALSE(fit.magnetic_met);
  EXPECT_THROW(calibrate_operator(SubjectSet{}, settings, quick_run()), std::invalid_argument);
}

TEST(OperatorCalibration, LeavesTheFrictionWhereItIsToldTo) {
  CalibrationSettings settings = paper_targets();
  settings.fit_friction = false;
  settings.most_steps = 3;
  SubjectSet set = few_people(2);
  set.device.friction = 0.111;
  const OperatorCalibration fit = calibrate_operator(set, settings, quick_run());
  EXPECT_EQ(fit.friction, 0.111);
}

}  // namespace kmax::experiment::operator_calibration_test
