#include "host_tools/check/check_table.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::check::check_table_test {

using firmware::ParameterValues;

std::string text_for(const ParameterValues& values, const control::Hand<double>& hand = {}) {
  return judgement_text(judge_parameters(values, 0, hand), "somebody");
}

ParameterValues with_damping(float damping, float friction) {
  ParameterValues values;
  values.set_real<"guard.damping">(damping);
  values.set_real<"guard.friction">(friction);
  return values;
}

TEST(CheckTable, EveryCriterionHasARowAndEveryWorthItsMeaning) {
  const std::string text = text_for(ParameterValues{});
  for (const CriterionText& criterion : all_criteria()) EXPECT_CONTAINS(text, criterion.name());
  for (const Worth worth : {Worth::guarantee, Worth::necessary, Worth::heuristic})
    EXPECT_CONTAINS(text, meaning_of(worth));
  EXPECT_CONTAINS(text, "needs guard.operator_force");
  EXPECT_CONTAINS(text, "hand    somebody");
}

TEST(CheckTable, TheLastWordsSayWhatFollows) {
  EXPECT_CONTAINS(text_for(with_damping(5, 1)),
                  "pass: every criterion that applies is met. Stable with every");
  EXPECT_CONTAINS(text_for(ParameterValues{}), "unstable with nobody at the handle");
  EXPECT_CONTAINS(text_for(ParameterValues{}), "guard.damping is 0");
  ParameterValues stiff = with_damping(0.5f, 0.1f);
  stiff.set_real<"wall.stiffness">(4000);
  const control::Hand<double> hand{0.234, 540, 1.7, 147, 9.1};
  EXPECT_CONTAINS(text_for(stiff, hand), "Nothing is guaranteed, and the linear loop is stable");
  EXPECT_CONTAINS(text_for(stiff, hand), "Let go inside the wall");
  stiff.set_real<"wall.stiffness">(50000);
  EXPECT_CONTAINS(text_for(stiff, hand), "unstable with this hand");
  ParameterValues none;
  none.set_whole<"wall.law">(0);
  EXPECT_CONTAINS(text_for(none), "There is no wall");
  ParameterValues late = with_damping(5, 1);
  late.set_real<"guard.delay">(0.01f);
  EXPECT_CONTAINS(text_for(late), "could not be judged: T_d is 207 periods");
  EXPECT_CONTAINS(text_for(late), "sampled_eigenvalues  not judged: T_d is 207 periods, more than 8");
  ParameterValues adaptive = with_damping(5, 1);
  adaptive.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::adaptive));
  EXPECT_CONTAINS(text_for(adaptive), "adaptive law's field follows the velocity");
}

TEST(CheckTable, AFieldOrADamperAloneIsAWallToo) {
  ParameterValues field = with_damping(5, 1);
  field.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::magnetic));
  field.set_real<"wall.stiffness">(0);
  field.set_real<"wall.magnetic_coefficient">(0.5f);
  const std::string text = text_for(field);
  EXPECT_EQ(text.find("There is no wall"), std::string::npos) << text;
  EXPECT_CONTAINS(text, "leaves out the field");
  EXPECT_CONTAINS(text, "Stable with every passive hand");
  EXPECT_CONTAINS(text, "colgate              not judged: wall.stiffness and wall.damping are 0");
  EXPECT_CONTAINS(text, "sampled_eigenvalues  not judged: wall.stiffness and wall.damping are 0");
  field.set_real<"guard.damping">(0);
  EXPECT_CONTAINS(text_for(field), "Nothing is guaranteed: if you try it");
  ParameterValues damper = with_damping(5, 1);
  damper.set_real<"wall.stiffness">(0);
  damper.set_real<"wall.damping">(0.1f);
  damper.set_whole<"velocity.estimator">(0);
  EXPECT_CONTAINS(text_for(damper), "Stable with every passive hand");
  EXPECT_CONTAINS(text_for(damper), "saturation_depth     not judged: wall.stiffness is 0");
  damper.set_real<"wall.damping">(0);
  EXPECT_CONTAINS(text_for(damper), "There is no wall");
}

// Stable again beyond the first loss: see control/sampled_stability.hpp.
TEST(CheckTable, AStableIslandIsNotCalledUnstable) {
  ParameterValues values = with_damping(0.08f, 0.1f);
  values.set_real<"device.mass">(0.05f);
  values.set_real<"guard.delay">(0.0015f);
  values.set_real<"haptic.rate">(2500);
  const control::Hand<double> hand{0.05, 2250, 9.6, 370, 1.1};
  const auto text_at = [&](float stiffness) {
    values.set_real<"wall.stiffness">(stiffness);
    return text_for(values, hand);
  };
  for (const float unstable : {700.0f, 4000.0f, 8000.0f})
    EXPECT_CONTAINS(text_at(unstable), "unstable with this hand: expect");
  const std::string text = text_at(5500);  // 4740 .. 6649 N/m
  EXPECT_CONTAINS(text, "The stiffness is beyond the first loss of stability");
  EXPECT_EQ(text.find("is unstable with"), std::string::npos) << text;
  EXPECT_CONTAINS(text, "no pass");
}

TEST(CheckTable, RemediesNameParameterSideAndUnit) {
  ParameterValues values = with_damping(0.5f, 0.1f);
  values.set_real<"wall.stiffness">(2000);
  const std::string text = text_for(values);
  EXPECT_CONTAINS(text, "wall.stiffness at most 1270 N/m");
  EXPECT_CONTAINS(text, "guard.damping at least 0.782 N s/m");
  EXPECT_CONTAINS(text, "all of them");
  EXPECT_EQ(text_for(with_damping(5, 1)).find("What would meet"), std::string::npos);
}

TEST(CheckTable, LinesFitATerminal) {
  ParameterValues values;
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::adaptive));
  values.set_real<"wall.stiffness">(123456);
  values.set_real<"guard.operator_force">(0.001f);
  values.set_real<"guard.operator_speed">(3);
  const std::string text = text_for(values, {0.234, 540, 1.7, 147, 9.1});
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    EXPECT_LE(end - begin, 115u) << text.substr(begin, end - begin);
    begin = end + 1;
  }
}

}  // namespace kmax::check::check_table_test
