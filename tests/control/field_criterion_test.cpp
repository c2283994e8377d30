#include "control/field_criterion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "control/wall_law.hpp"

namespace kmax::control {
namespace {

TEST(FieldCriterion, KnownNumbers) {
  EXPECT_DOUBLE_EQ(steepest_field_slope(2.0, 1e-3), 4000.0);
  EXPECT_DOUBLE_EQ(steepest_field_slope(2.0, 10e-6), 400000.0);
  EXPECT_EQ(steepest_field_slope(0.0, 1e-3), 0.0);
  EXPECT_EQ(steepest_field_slope(0.0, 0.0), 0.0);
  EXPECT_EQ(steepest_field_slope(1.0, 0.0), std::numeric_limits<double>::max());
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
}  // namespace kmax::control
