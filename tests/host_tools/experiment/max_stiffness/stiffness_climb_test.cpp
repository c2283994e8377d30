#include "host_tools/experiment/max_stiffness/stiffness_climb.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <vector>

namespace kmax::experiment::stiffness_climb_test {
namespace {

/// The stiffnesses it asks for while everything up to `limit` is stable.
std::vector<double> climb_to(StiffnessClimb& climb, double limit) {
  std::vector<double> asked;
  while (const auto stiffness = climb.next()) {
    asked.push_back(*stiffness);
    climb.tell(*stiffness <= limit);
  }
  return asked;
}

TEST(StiffnessClimb, GoesUpToTheFirstUnstableOne) {
  StiffnessClimb climb(3000, 100, 20e3);
  EXPECT_EQ(climb_to(climb, 3250), (std::vector<double>{3000, 3100, 3200, 3300}));
  EXPECT_EQ(climb.result(), 3200);
  EXPECT_FALSE(climb.beyond_last());
}

TEST(StiffnessClimb, GoesDownFromAnUnstableStart) {
  StiffnessClimb climb(5000, 1000, 20e3);
  EXPECT_EQ(climb_to(climb, 3580), (std::vector<double>{5000, 4000, 3000}));
  EXPECT_EQ(climb.result(), 3000);
}

TEST(StiffnessClimb, EndsAtBothEnds) {
  StiffnessClimb nothing(300, 100, 1000);
  EXPECT_EQ(climb_to(nothing, 0), (std::vector<double>{300, 200, 100}));
  EXPECT_EQ(nothing.result(), 0);
  EXPECT_FALSE(nothing.beyond_last());
  StiffnessClimb everything(800, 100, 1000);
  EXPECT_EQ(climb_to(everything, 1e9), (std::vector<double>{800, 900, 1000}));
  EXPECT_EQ(everything.result(), 1000);
  EXPECT_TRUE(everything.beyond_last());
}

TEST(StiffnessClimb, GivenUpItKeepsWhatItHas) {
  StiffnessClimb climb(3000, 100, 20e3);
  climb.tell(true);
  climb.give_up();
  EXPECT_FALSE(climb.next());
  EXPECT_EQ(climb.result(), 3000);
  EXPECT_FALSE(climb.beyond_last());
}

RC_GTEST_PROP(StiffnessClimbProperty, FindsTheLimitWithinAStepFromAnyStart, ()) {
  const double first = *rc::gen::inRange(1, 100) * 100.0, limit = *rc::gen::inRange(1, 200) * 50.0;
  StiffnessClimb climb(first, 100, 20e3);
  climb_to(climb, limit);
  RC_ASSERT(climb.result() <= limit);
  RC_ASSERT(limit < climb.result() + 100);
}

TEST(StiffnessClimb, AStartBelowHalfAStepIsTouched) {
  StiffnessClimb up(40, 100, 1000);
  EXPECT_EQ(climb_to(up, 250), (std::vector<double>{40, 140, 240, 340}));
  EXPECT_EQ(up.result(), 240);
  StiffnessClimb down(40, 100, 1000);
  EXPECT_EQ(climb_to(down, 0), (std::vector<double>{40}));
  StiffnessClimb remainder(230, 100, 1000);
  EXPECT_EQ(climb_to(remainder, 110), (std::vector<double>{230, 130, 30}));
  EXPECT_EQ(remainder.result(), 30);
}

RC_GTEST_PROP(StiffnessClimbProperty, FindsTheLimitWithinAStepFromAStartThatIsNoMultiple, ()) {
  const double first = *rc::gen::inRange(1, 100000) * 0.1, step = *rc::gen::inRange(1, 20000) * 0.1;
  const double limit = *rc::gen::inRange(1, 20000) * 1.0;
  StiffnessClimb climb(first, step, 20e3);
  const std::vector<double> asked = climb_to(climb, limit);
  RC_ASSERT(!asked.empty() && asked.front() == first);
  for (const double stiffness : asked) RC_ASSERT(stiffness > 0.0);
  RC_ASSERT(climb.result() <= limit);
  if (!climb.beyond_last()) RC_ASSERT(limit < climb.result() + step * (1.0 + 1e-9));
}

TEST(StiffnessClimb, RefusesAbsurdSteps) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(StiffnessClimb(0, 100, 1000), std::invalid_argument);
  EXPECT_THROW(StiffnessClimb(3000, 0, 1e4), std::invalid_argument);
  EXPECT_THROW(StiffnessClimb(3000, -1, 1e4), std::invalid_argument);
  EXPECT_THROW(StiffnessClimb(3000, 100, 2000), std::invalid_argument);
  EXPECT_THROW(StiffnessClimb(3000, 100, 1e8), std::invalid_argument);
  EXPECT_THROW(StiffnessClimb(nan, 100, 1e4), std::invalid_argument);
  EXPECT_THROW(StiffnessClimb(3000, nan, 1e4), std::invalid_argument);
}

}  // namespace
}  // namespace kmax::experiment::stiffness_climb_test
