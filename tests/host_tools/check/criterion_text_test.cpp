#include "host_tools/check/criterion_text.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::check::criterion_text_test {

using control::Criterion;

TEST(CriterionText, EveryCriterionIsExplainedOnce) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < control::criterion_count; ++i) {
    const auto criterion = static_cast<Criterion>(i);
    const CriterionText& text = text_of(criterion);
    EXPECT_EQ(text.criterion, criterion);
    EXPECT_EQ(criterion_of(text.name()), criterion);
    EXPECT_TRUE(names.insert(text.name()).second) << text.name();
    for (const std::string_view part :
         {text.unit, text.value, text.bound, text.assumptions, text.source, text.with_structure})
      EXPECT_FALSE(part.empty()) << text.name();
    const std::string all = explanation(criterion);
    for (const std::string_view part : {text.name(), name_of(text.worth), text.unit})
      EXPECT_CONTAINS(all, part);
    EXPECT_CONTAINS(criterion_names(), text.name());
  }
  EXPECT_EQ(criterion_of("colgat"), std::nullopt);
  EXPECT_EQ(criterion_of(""), std::nullopt);
}

// The relation that is written must be the one that is judged.
TEST(CriterionText, TheRelationHoldsOnTheBound) {
  for (const CriterionText& text : all_criteria()) {
    if (text.criterion == Criterion::sampled_eigenvalues) continue;
    // Chosen so that everything applies and value and bound are exact.
    control::StabilityCase<double> c{};
    c.stiffness = 1024;
    c.magnetic_coefficient = 0.5;
    c.magnetic_length = 1.0 / 1024;
    c.period = 1.0 / 1024;
    c.quantum = 1.0 / 4096;
    c.mass = 0.0625;
    c.damping = 0.5;
    c.friction = 0.25;
    c.operator_force = 0.25;
    c.operator_speed = 0.25;
    c.force_limit = 0.5 + 0.75;
    if (text.criterion == Criterion::diolaiti) {
      c.damping = 0.25;
      c.operator_speed = 1;
    }
    const auto result = control::judge(text.criterion, c);
    ASSERT_TRUE(result.applies) << text.name();
    ASSERT_EQ(result.value, result.bound) << text.name();
    EXPECT_EQ(result.pass, text.relation != "<") << text.name();
    EXPECT_EQ(result.at_least, text.relation == ">=") << text.name();
  }
}

TEST(CriterionText, LinesAreShortAndWhole) {
  const std::string words = "one two three " + std::string(120, 'x') + " four";
  const std::string text = wrapped(words, "  ");
  EXPECT_EQ(text, "  one two three\n  " + std::string(108, 'x') + "\n  " + std::string(12, 'x') + " four\n");
  EXPECT_EQ(wrapped("", ">"), ">\n");
  for (const CriterionText& criterion : all_criteria()) {
    const std::string all = explanation(criterion.criterion);
    for (std::size_t begin = 0; begin < all.size();) {
      const std::size_t end = all.find('\n', begin);
      ASSERT_NE(end, std::string::npos);
      EXPECT_LE(end - begin, 110u) << all.substr(begin, end - begin);
      begin = end + 1;
    }
  }
}

}  // namespace kmax::check::criterion_text_test
