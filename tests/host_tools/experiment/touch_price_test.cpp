#include "host_tools/experiment/touch_price.hpp"

#include <gtest/gtest.h>

namespace kmax::experiment::touch_price_test {

TouchSetup touch(double stiffness, double damping, double field) {
  TouchSetup setup;
  setup.wall.wall.kind = field > 0.0 ? control::WallKind::magnetic : control::WallKind::plain;
  setup.wall.wall.stiffness = static_cast<float>(stiffness);
  setup.wall.wall.damping = static_cast<float>(damping);
  setup.wall.wall.magnetic_coefficient = static_cast<float>(field);
  setup.wall.velocity.kind = control::VelocityEstimatorKind::difference;
  return setup;
}

TEST(TouchPrice, AFieldIsPaidForAtRestAndOnTheWayIn) {
  const TouchPrice plain = price_of(touch(1000.0, 0.0, 0.0)), field = price_of(touch(1000.0, 0.0, 1.0));
  EXPECT_EQ(plain.field_at_rest, 0.0);
  EXPECT_EQ(plain.work, 0.0);
  EXPECT_NEAR(field.field_at_rest, 1.0, 1e-6);
  EXPECT_GT(field.work, 0.0);
}

TEST(TouchPrice, AStifferOrDampedWallRisesFasterAndLetsLessDeepIn) {
  const TouchPrice soft = price_of(touch(500.0, 0.0, 0.0)), stiff = price_of(touch(1500.0, 0.0, 0.0)),
                   damped = price_of(touch(500.0, 5.0, 0.0));
  EXPECT_GT(stiff.rate_hardness, 1.5 * soft.rate_hardness);
  EXPECT_GT(damped.rate_hardness, soft.rate_hardness);
  EXPECT_LT(stiff.depth, soft.depth);
  // The spring alone, over a speed that falls within the time.
  EXPECT_GT(soft.rate_hardness, 0.5 * 500.0);
  EXPECT_LT(soft.rate_hardness, 1.1 * 500.0);
}

TEST(TouchPrice, OfAWallThatIsNotMetThereIsNoHardness) {
  TouchSetup setup = touch(1000.0, 0.0, 0.0);
  setup.device.friction = 50.0;
  const TouchPrice price = price_of(setup);
  EXPECT_EQ(price.rate_hardness, 0.0);
  EXPECT_EQ(price.depth, 0.0);
}

}  // namespace kmax::experiment::touch_price_test
