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

TEST(TouchPrice, OfAHandleAtRestTheWholeTouchHasStoredWhatTheSpringHolds) {
  // A push of 1 N comes to rest where the spring pushes back with nearly as much; friction may hold the rest.
  TouchSetup setup = touch(1000.0, 3.0, 0.0);
  std::vector<TouchSample> samples;
  simulate_touch(setup, &samples);
  const double depth = -samples.back().position, stored = 0.5 * 1000.0 * depth * depth;
  const TouchPrice price = price_of(setup);
  EXPECT_GT(depth, 0.5e-3);
  EXPECT_GT(price.touch_work, stored) << "and something has been damped";
  EXPECT_LT(price.touch_work, 4.0 * stored);
  EXPECT_GT(price.peak_force, 1000.0 * (price.depth - 55e-6));
  setup.wall.force.limit = 0.4F;
  EXPECT_FLOAT_EQ(static_cast<float>(price_of(setup).peak_force), 0.4F);
  const TouchPrice field = price_of(touch(1000.0, 3.0, 1.0));
  EXPECT_GT(field.touch_work, field.work);
}

TEST(TouchPrice, OfAWallThatIsNotMetThereIsNoHardness) {
  TouchSetup setup = touch(1000.0, 0.0, 0.0);
  setup.device.friction = 50.0;
  const TouchPrice price = price_of(setup);
  EXPECT_EQ(price.rate_hardness, 0.0);
  EXPECT_EQ(price.depth, 0.0);
  EXPECT_EQ(price.peak_force, 0.0);
  EXPECT_EQ(price.touch_work, 0.0);
}

}  // namespace kmax::experiment::touch_price_test
