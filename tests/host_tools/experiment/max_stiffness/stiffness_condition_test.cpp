#include "host_tools/experiment/max_stiffness/stiffness_condition.hpp"

#include <gtest/gtest.h>

namespace kmax::experiment::stiffness_condition_test {

TEST(StiffnessCondition, AreThoseOfThePaper) {
  const auto conditions = stiffness_conditions();
  ASSERT_EQ(conditions.size(), 8U);
  EXPECT_EQ(conditions[0].paper, 3580.0);
  EXPECT_EQ(conditions[4].paper, 8410.0);
  EXPECT_EQ(conditions[7].paper, 8020.0);
  EXPECT_FALSE(conditions[2].paper.has_value());
  for (const auto& condition : conditions) {
    // Whether it is calibrated is not the condition's to say.
    EXPECT_EQ(condition.origin, report::Origin::predicted);
    TouchSetup setup;
    condition.apply(setup);
    EXPECT_EQ(setup.wall.wall.kind == control::WallKind::adaptive, condition.adaptive());
    EXPECT_EQ(setup.wall.wall.kind == control::WallKind::plain,
              !condition.adaptive() && condition.magnetic_coefficient == 0.0);
  }
}

TEST(StiffnessCondition, RescaledCountsTheVelocityInHalfWidthsOfTheWorkspace) {
  const auto conditions = rescaled_conditions();
  ASSERT_EQ(conditions.size(), 3U);
  for (const auto& condition : conditions) {
    EXPECT_TRUE(condition.adaptive());
    EXPECT_EQ(condition.paper, 8020.0);
    TouchSetup setup;
    condition.apply(setup);
    EXPECT_FLOAT_EQ(setup.wall.wall.adaptive.velocity_max, 2.4F * 0.075F);
  }
  EXPECT_EQ(conditions[1].name, "adaptive, latched, V x 13.3");
}

}  // namespace kmax::experiment::stiffness_condition_test
