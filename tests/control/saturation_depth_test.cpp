#include "control/saturation_depth.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "control/wall_law.hpp"

namespace kmax::control::saturation_depth_test {

TEST(SaturationDepth, PaperOnesStiffestWallSaturatesWithinThreeCounts) {
  const double depth = saturation_depth(8410.0, 2.0, 3.3);
  EXPECT_NEAR(depth, 0.1546e-3, 1e-7);
  EXPECT_LT(depth, saturation_quanta * 55e-6);
  EXPECT_GT(saturation_depth(3580.0, 0.0, 3.3), saturation_quanta * 55e-6);
}

TEST(SaturationDepth, Limits) {
  EXPECT_EQ(saturation_depth(1000.0, 4.0, 3.3), 0.0);
  EXPECT_EQ(saturation_depth(1000.0, 3.3, 3.3), 0.0);
  EXPECT_EQ(saturation_depth(0.0, 4.0, 3.3), 0.0);
  EXPECT_EQ(saturation_depth(0.0, 1.0, 3.3), std::numeric_limits<double>::max());
}

RC_GTEST_PROP(SaturationDepth, IsWhereTheLawMeetsTheLimit, ()) {
  const auto amount = [](double unit) { return unit * *rc::gen::inRange(1, 1000); };
  WallLawConfig<double> config;
  config.kind = WallKind::magnetic;
  config.stiffness = amount(10.0);
  config.magnetic_coefficient = amount(0.005);
  const double limit = config.magnetic_coefficient + amount(0.01);
  WallLaw<double> law;
  const auto prepared = WallLaw<double>::prepare(config, 1e-3);
  const double depth = saturation_depth(config.stiffness, config.magnetic_coefficient, limit);
  RC_ASSERT(std::abs(law.update(prepared, -depth, 0.0).force - limit) < 1e-12 * limit);
}

}  // namespace kmax::control::saturation_depth_test
