#include "firmware/drive/stability_case.hpp"

#include <gtest/gtest.h>

#include "tests/firmware/drive/guarded_parameters.hpp"

namespace kmax::firmware::stability_case_test {
namespace {

class StabilityCase : public Guard {};

TEST_F(StabilityCase, TakesEveryNumberFromTheParameterThatMeansIt) {
  set("wall.damping", 0.5);
  set("wall.law", 2);
  set("wall.magnetic_coefficient", 1.25);
  set("wall.magnetic_length", 0.002);
  set("guard.delay", 0.001);
  set("guard.operator_force", 3);
  set("guard.operator_speed", 0.75);
  set("position.resolution", 55e-6);
  set("device.mass", 0.0625);
  set("force.limit", 6.5);
  const auto judged = stability_case(values, 0);
  EXPECT_EQ(judged.stiffness, 1000.0f);
  EXPECT_EQ(judged.wall_damping, 0.5f);
  EXPECT_EQ(judged.magnetic_coefficient, 1.25f);
  EXPECT_EQ(judged.magnetic_length, 0.002f);
  EXPECT_EQ(judged.period, 0.0005f);
  EXPECT_FLOAT_EQ(judged.delay, 0.0012825f) << "guard.delay, 1 / current.bandwidth and 0.65 ticks";
  EXPECT_NEAR(judged.quantum, 60e-6f, 1e-11f) << "the step in use: six counts, not the 55 um asked for";
  EXPECT_EQ(judged.mass, 0.0625f);
  EXPECT_EQ(judged.damping, 5.325f);
  EXPECT_EQ(judged.friction, 1.0f);
  EXPECT_EQ(judged.operator_force, 3.0f);
  EXPECT_EQ(judged.operator_speed, 0.75f);
  EXPECT_EQ(judged.detection_share, 1.0f);
  EXPECT_EQ(judged.force_limit, 6.5f);
  EXPECT_EQ(judged.hand.hand_mass, 0.0f);
}

TEST_F(StabilityCase, TheFieldIsTheLargestThatEachLawCanCommand) {
  set("wall.magnetic_coefficient", 7);
  const auto of_law = [&](double law) {
    set("wall.law", law);
    return stability_case(values, 0).magnetic_coefficient;
  };
  EXPECT_EQ(of_law(0), 0.0f);
  EXPECT_EQ(of_law(1), 0.0f);
  EXPECT_EQ(of_law(2), 7.0f);
  EXPECT_EQ(of_law(3), 2.0f) << "the interval's upper end, below the 3.2 N of eq. 7";
  set("wall.adaptive_force_max", 100);
  EXPECT_FLOAT_EQ(of_law(3), 3.2f) << "eq. 7 at V_max";
  set("wall.adaptive_force_min", 5);
  EXPECT_EQ(of_law(3), 5.0f) << "the interval's lower end, above what eq. 7 gives";
}

TEST_F(StabilityCase, WithoutALawThereIsNoWall) {
  set("wall.damping", 1);
  set("wall.law", 0);
  EXPECT_EQ(stability_case(values, 0).stiffness, 0.0f);
  EXPECT_EQ(stability_case(values, 0).wall_damping, 0.0f);
}

TEST_F(StabilityCase, AnAxisIsItsOwn) {
  set("wall.law", 1, 1);
  set("wall.stiffness", 4000, 1);
  EXPECT_EQ(stability_case(values, 1).stiffness, 4000.0f);
  EXPECT_EQ(stability_case(values, 0).stiffness, 1000.0f);
}

}  // namespace
}  // namespace kmax::firmware::stability_case_test
