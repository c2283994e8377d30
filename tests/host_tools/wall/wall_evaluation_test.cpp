#include "host_tools/wall/wall_evaluation.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "firmware/object_dictionary/axis_groups.hpp"

namespace kmax::wall::wall_evaluation_test {

using control::WallKind;

firmware::ParameterValues wall(WallKind kind, std::size_t axis = 0) {
  firmware::ParameterValues values;
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(kind), axis);
  values.set_real<"wall.stiffness">(2000.0f, axis);
  values.set_real<"wall.position">(0.25f, axis);
  values.set_real<"wall.magnetic_coefficient">(2.0f, axis);
  values.set_real<"wall.magnetic_length">(0.125f, axis);
  return values;
}

TEST(WallEvaluator, PlainWallIsASpringInsideAndNothingOutside) {
  const WallEvaluator evaluator(wall(WallKind::plain));
  EXPECT_DOUBLE_EQ(evaluator.at(0.25 - 0.001, 0).force, 2.0);
  EXPECT_TRUE(evaluator.at(0.25 - 0.001, 0).inside);
  EXPECT_EQ(evaluator.at(0.25 + 1e-9, 0).force, 0.0);
  EXPECT_FALSE(evaluator.at(0.25 + 1e-9, 0).inside);
  EXPECT_TRUE(evaluator.at(0.25, 0).inside) << "the surface itself is inside";
  EXPECT_EQ(evaluator.at(0.25, 0).force, 0.0);
}

TEST(WallEvaluator, FieldIsAQuarterOfItsCoefficientOneLengthOutside) {
  const WallEvaluator evaluator(wall(WallKind::magnetic));
  EXPECT_DOUBLE_EQ(evaluator.at(0.25 + 0.125, 0).force, 2.0 / 4);
  EXPECT_DOUBLE_EQ(evaluator.at(0.25 + 0.125, 0).magnetic_force, 2.0 / 4);
  EXPECT_DOUBLE_EQ(evaluator.at(0.25 - 0.001, 0).force, 2.0 + 2.0);
  EXPECT_DOUBLE_EQ(evaluator.at(0.25 - 0.001, 0).magnetic_force, 2.0);
}

TEST(WallEvaluator, AxesHaveWallsOfTheirOwn) {
  const WallEvaluator second(wall(WallKind::plain, 1), 1), first(wall(WallKind::plain, 1), 0);
  EXPECT_DOUBLE_EQ(second.at(0.249, 0).force, 2.0);
  EXPECT_EQ(first.at(0.249, 0).force, 0.0);
}

TEST(WallEvaluator, ZeroForceOfAMirroredWallHasNoSign) {
  firmware::ParameterValues values = wall(WallKind::plain);
  values.set_whole<"wall.side">(-1);
  const Evaluation outside = WallEvaluator(values).at(0.0, 0.0);
  EXPECT_FALSE(outside.inside);
  EXPECT_FALSE(std::signbit(outside.force));
  EXPECT_FALSE(std::signbit(outside.magnetic_force));
}

RC_GTEST_PROP(WallEvaluatorProperty, OtherSideIsTheMirrorImage, ()) {
  auto values =
      wall(static_cast<WallKind>(*rc::gen::inRange<std::size_t>(0, std::size(firmware::names::wall_law))));
  values.set_real<"wall.position">(0.0f);
  values.set_real<"wall.damping">(static_cast<float>(*rc::gen::inRange(0, 20)));
  const double position = *rc::gen::inRange(-20000, 20000) * 1e-6;
  const double velocity = *rc::gen::inRange(-2000, 2000) * 1e-3;
  const Evaluation right = WallEvaluator(values).at(position, velocity);
  values.set_whole<"wall.side">(-1);
  const Evaluation left = WallEvaluator(values).at(-position, -velocity);
  RC_ASSERT(right.force == -left.force);
  RC_ASSERT(right.magnetic_force == -left.magnetic_force);
  RC_ASSERT(right.inside == left.inside);
  RC_ASSERT(right.force >= 0.0);
}

// "Each evaluation stands alone": no order of evaluations changes any of them.
RC_GTEST_PROP(WallEvaluatorProperty, NothingIsRemembered, ()) {
  auto values = wall(WallKind::adaptive);
  values.set_real<"wall.position">(0.0f);
  values.set_whole<"wall.adaptive_mode">(static_cast<std::uint32_t>(*rc::gen::inRange(0, 3)));
  const WallEvaluator used(values), fresh(values);
  for (int i = 0; i < 5; ++i) used.at(*rc::gen::inRange(-20, 20) * 1e-3, *rc::gen::inRange(-20, 20) * 0.1);
  const double position = *rc::gen::inRange(-20, 20) * 1e-3, velocity = *rc::gen::inRange(-20, 20) * 0.1;
  RC_ASSERT(used.at(position, velocity).force == fresh.at(position, velocity).force);
}

}  // namespace kmax::wall::wall_evaluation_test
