#include "host_tools/base/suggestion.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace kmax::base::suggestion_test {

const std::vector<std::string> names = {"wall.stiffness", "wall.damping",   "guard.damping",    "force.limit",
                                        "current.limit",  "velocity.limit", "temperature.limit"};

TEST(EditDistance, CountsTheFourKindsOfSlips) {
  EXPECT_EQ(edit_distance("stiffness", "stiffness"), 0u);
  EXPECT_EQ(edit_distance("stifness", "stiffness"), 1u);
  EXPECT_EQ(edit_distance("stiffnesss", "stiffness"), 1u);
  EXPECT_EQ(edit_distance("stuffness", "stiffness"), 1u);
  EXPECT_EQ(edit_distance("tsiffness", "stiffness"), 1u);
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("abc", ""), 3u);
}

RC_GTEST_PROP(EditDistance, IsSymmetricAndBoundedByLength, (const std::string& a, const std::string& b)) {
  const auto distance = edit_distance(a, b);
  RC_ASSERT(distance == edit_distance(b, a));
  RC_ASSERT(distance <= std::max(a.size(), b.size()));
  RC_ASSERT((distance == 0) == (a == b));
}

TEST(Closest, ALastPartNamesTheWhole) {
  EXPECT_EQ(closest("stiffness", names), std::vector<std::string>{"wall.stiffness"});
  EXPECT_EQ(closest("damping", names), (std::vector<std::string>{"wall.damping", "guard.damping"}));
}

TEST(Closest, ASlipIsForgiven) {
  EXPECT_EQ(closest("wall.stifness", names), std::vector<std::string>{"wall.stiffness"});
  EXPECT_EQ(closest("stifness", names), std::vector<std::string>{"wall.stiffness"});
  EXPECT_EQ(closest("fore.limit", names).front(), "force.limit");
}

TEST(Closest, NoMoreThanThreeAndNothingFarFetched) {
  EXPECT_EQ(closest("limit", names).size(), 3u);
  EXPECT_TRUE(closest("bananas", names).empty());
  EXPECT_TRUE(closest("", names).empty());
  EXPECT_EQ(did_you_mean("bananas", names), "");
  EXPECT_EQ(did_you_mean("stiffness", names), "; did you mean wall.stiffness?");
}

}  // namespace kmax::base::suggestion_test
