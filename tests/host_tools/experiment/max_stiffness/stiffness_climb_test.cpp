#include "host_tools/experiment/max_stiffness/stiffness_climb.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <stdexcept>
#include <vector>

namespace kmax::experiment::stiffness_climb_test {

StiffnessClimb climb_of(double first, double step, double last) {
  return {{.first = first, .step = step, .last = last, .goes_down = true}, false};
}

/// The stiffnesses it asks for while everything up to `limit` is stable.
std::vector<double> climb_to(StiffnessClimb& climb, double limit) {
  std::vector<double> asked;
  while (const auto stiffness = climb.next()) {
    asked.push_back(*stiffness);
    climb.record(*stiffness <= limit);
  }
  return asked;
}

TEST(StiffnessClimb, GoesUpToTheFirstUnstableOne) {
  StiffnessClimb climb = climb_of(3000, 100, 20e3);
  EXPECT_EQ(climb_to(climb, 3250), (std::vector<double>{3000, 3100, 3200, 3300}));
  EXPECT_EQ(climb.result(), 3200);
  EXPECT_FALSE(climb.beyond_last());
}

TEST(StiffnessClimb, GoesDownFromAnUnstableStart) {
  StiffnessClimb climb = climb_of(5000, 1000, 20e3);
  EXPECT_EQ(climb_to(climb, 3580), (std::vector<double>{5000, 4000, 3000}));
  EXPECT_EQ(climb.result(), 3000);
}

TEST(StiffnessClimb, EndsAtBothEnds) {
  StiffnessClimb nothing = climb_of(300, 100, 1000);
  EXPECT_EQ(climb_to(nothing, 0), (std::vector<double>{300, 200, 100}));
  EXPECT_EQ(nothing.result(), 0);
  EXPECT_FALSE(nothing.beyond_last());
  StiffnessClimb everything = climb_of(800, 100, 1000);
  EXPECT_EQ(climb_to(everything, 1e9), (std::vector<double>{800, 900, 1000}));
  EXPECT_EQ(everything.result(), 1000);
  EXPECT_TRUE(everything.beyond_last());
}

TEST(StiffnessClimb, GivenUpItKeepsWhatItHas) {
  StiffnessClimb climb = climb_of(3000, 100, 20e3);
  climb.record(true);
  climb.give_up();
  EXPECT_FALSE(climb.next());
  EXPECT_EQ(climb.result(), 3000);
  EXPECT_FALSE(climb.beyond_last());
}

RC_GTEST_PROP(StiffnessClimbProperty, FindsTheLimitWithinAStepFromAnyStart, ()) {
  const double first = *rc::gen::inRange(1, 100) * 100.0, limit = *rc::gen::inRange(1, 200) * 50.0;
  StiffnessClimb climb = climb_of(first, 100, 20e3);
  climb_to(climb, limit);
  RC_ASSERT(climb.result() <= limit);
  RC_ASSERT(limit < climb.result() + 100);
}

TEST(StiffnessClimb, AStartBelowHalfAStepIsTouched) {
  StiffnessClimb up = climb_of(40, 100, 1000);
  EXPECT_EQ(climb_to(up, 250), (std::vector<double>{40, 140, 240, 340}));
  EXPECT_EQ(up.result(), 240);
  StiffnessClimb down = climb_of(40, 100, 1000);
  EXPECT_EQ(climb_to(down, 0), (std::vector<double>{40}));
  StiffnessClimb remainder = climb_of(230, 100, 1000);
  EXPECT_EQ(climb_to(remainder, 110), (std::vector<double>{230, 130, 30}));
  EXPECT_EQ(remainder.result(), 30);
}

RC_GTEST_PROP(StiffnessClimbProperty, FindsTheLimitWithinAStepFromAStartThatIsNoMultiple, ()) {
  const double first = *rc::gen::inRange(1, 100000) * 0.1, step = *rc::gen::inRange(1, 20000) * 0.1;
  const double limit = *rc::gen::inRange(1, 20000) * 1.0;
  StiffnessClimb climb = climb_of(first, step, 20e3);
  const std::vector<double> asked = climb_to(climb, limit);
  RC_ASSERT((!asked.empty() && asked.front() == first));
  for (const double stiffness : asked) RC_ASSERT(stiffness > 0.0);
  RC_ASSERT(climb.result() <= limit);
  if (!climb.beyond_last()) RC_ASSERT(limit < climb.result() + step * (1.0 + 1e-9));
}

TEST(StiffnessClimb, RefusesAbsurdSteps) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(climb_of(0, 100, 1000), std::invalid_argument);
  EXPECT_THROW(climb_of(3000, 0, 1e4), std::invalid_argument);
  EXPECT_THROW(climb_of(3000, -1, 1e4), std::invalid_argument);
  EXPECT_THROW(climb_of(3000, 100, 2000), std::invalid_argument);
  EXPECT_THROW(climb_of(3000, 100, 1e8), std::invalid_argument);
  EXPECT_THROW(climb_of(nan, 100, 1e4), std::invalid_argument);
  EXPECT_THROW(climb_of(3000, nan, 1e4), std::invalid_argument);
}

TEST(StiffnessClimb, WithoutAWayDownAnUnstableStartIsTheEnd) {
  StiffnessClimb climb({.first = 3000, .last = 20e3}, false);
  EXPECT_EQ(climb_to(climb, 2500), (std::vector<double>{3000}));
  EXPECT_EQ(climb.result(), 0);
  EXPECT_FALSE(climb.beyond_last());
}

TEST(StiffnessClimb, OfAnAdaptiveLawBeginsAtItsOwnStart) {
  const StiffnessSteps steps{.first = 3000, .last = 4000, .first_adaptive = 5000};
  EXPECT_EQ(StiffnessClimb(steps, false).next(), 3000);
  EXPECT_THROW(StiffnessClimb(steps, true), std::invalid_argument);
  EXPECT_EQ(StiffnessClimb({.first = 3000, .last = 8000, .first_adaptive = 5000}, true).next(), 5000);
}

TEST(StiffnessClimb, GrowsByAShareWhereThatIsTheLongerStep) {
  StiffnessClimb climb({.first = 1000, .step = 100, .growth = 0.5, .last = 4000}, false);
  EXPECT_EQ(climb_to(climb, 1e9), (std::vector<double>{1000, 1500, 2250, 3375}));
  EXPECT_TRUE(climb.beyond_last());
  StiffnessClimb slow({.first = 100, .step = 100, .growth = 0.25, .last = 700}, false);
  EXPECT_EQ(climb_to(slow, 1e9), (std::vector<double>{100, 200, 300, 400, 500, 625}));
}

}  // namespace kmax::experiment::stiffness_climb_test
