#include "host_tools/check/check_table.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::check {
namespace {
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
  EXPECT_CONTAINS(text_for(late), "more than 8 periods");
  ParameterValues adaptive = with_damping(5, 1);
  adaptive.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::adaptive));
  EXPECT_CONTAINS(text_for(adaptive), "adaptive law's field follows the velocity");
}

TEST(CheckTable, RemediesNameParameterSideAndUnit) {
  ParameterValues values = with_damping(0.5f, 0.1f);
  values.set_real<"wall.stiffness">(2000);
  const std::string text = text_for(values);
  EXPECT_CONTAINS(text, "wall.stiffness at most 1390 N/m");
  EXPECT_CONTAINS(text, "guard.damping at least 0.717 N s/m");
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

}  // namespace
}  // namespace kmax::check
