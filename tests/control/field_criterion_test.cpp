#include "control/field_criterion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "control/wall_law.hpp"

namespace kmax::control::field_criterion_test {
namespace {

TEST(FieldCriterion, KnownNumbers) {
  EXPECT_DOUBLE_EQ(steepest_field_slope(2.0, 1e-3), 4000.0);
  EXPECT_DOUBLE_EQ(steepest_field_slope(2.0, 10e-6), 400000.0);
  EXPECT_EQ(steepest_field_slope(0.0, 1e-3), 0.0);
  EXPECT_EQ(steepest_field_slope(0.0, 0.0), 0.0);
  EXPECT_EQ(steepest_field_slope(1.0, 0.0), std::numeric_limits<double>::max());
}

TEST(FieldCriterion, TheLimitIsTheSmallerOfHoldAndStep) {
  // (20 - 0)/0.5 ms = 40000 and 2 * 0.01/0.055 mm = 364: 2 N over 0.2 mm pass the first and buzz.
  EXPECT_DOUBLE_EQ(field_slope_limit(20.0, 0.0, 0.01, 1e-3, 0.0, 0.0), 40000.0);
  EXPECT_NEAR(field_slope_limit(20.0, 0.0, 0.01, 1e-3, 0.0, 55e-6), 363.6, 0.1);
  EXPECT_DOUBLE_EQ(field_slope_limit(20.0, 0.0, 10.0, 1e-3, 0.0, 55e-6), 40000.0);
  EXPECT_NEAR(field_slope_limit(20.0, 1.0, 0.1, 1e-3, 0.5e-3, 50e-6), 2000.0, 1e-6);
  EXPECT_NEAR(field_slope_limit(2.0, 1.0, 1.0, 1e-3, 0.5e-3, 50e-6), 1000.0, 1e-6);
}

// No field within its limit changes by more than twice the friction over one step, wherever the steps lie.
RC_GTEST_PROP(FieldCriterion, FrictionHoldsEveryStepWithinTheLimit, ()) {
  const double friction = *rc::gen::inRange(1, 100) * 0.01, quantum = *rc::gen::inRange(1, 100) * 1e-6;
  const double length = *rc::gen::inRange(1, 100) * 1e-5;
  const double limit = field_slope_limit(1e6, 0.0, friction, 1e-3, 0.0, quantum);
  WallLawConfig<double> config;
  config.kind = WallKind::magnetic;
  config.magnetic_coefficient = limit * length / 2;
  config.magnetic_length = length;
  WallLaw<double> law;
  const auto prepared = WallLaw<double>::prepare(config, 1e-3);
  for (int i = 0; i < 40; ++i) {
    const double from = i * 0.25 * quantum;
    const double step =
        law.update(prepared, from, 0.0).force - law.update(prepared, from + quantum, 0.0).force;
    RC_ASSERT(step <= 2 * friction * (1 + 1e-12));
  }
}

// The slope is that of the law that runs: reached at the surface, and nowhere exceeded.
RC_GTEST_PROP(FieldCriterion, IsTheLawsSteepestSlope, ()) {
  WallLawConfig<double> config;
  config.kind = WallKind::magnetic;
  config.magnetic_coefficient = *rc::gen::inRange(1, 100) * 0.1;
  config.magnetic_length = *rc::gen::inRange(1, 100) * 1e-4;
  WallLaw<double> law;
  const auto prepared = WallLaw<double>::prepare(config, 1e-3);
  const auto slope_at = [&](double distance) {
    const double step = 1e-6 * config.magnetic_length;
    return (law.update(prepared, distance, 0.0).force - law.update(prepared, distance + step, 0.0).force) /
           step;
  };
  const double steepest = steepest_field_slope(config.magnetic_coefficient, config.magnetic_length);
  const double near = slope_at(1e-6 * config.magnetic_length);
  RC_ASSERT(near <= steepest && near > 0.9999 * steepest);
  for (int i = 1; i < 50; ++i) RC_ASSERT(slope_at(i * 0.1 * config.magnetic_length) < steepest);
  RC_ASSERT(std::abs(slope_at(config.magnetic_length) / steepest - 0.125) < 1e-4);  // as the header says
}

}  // namespace
}  // namespace kmax::control::field_criterion_test
