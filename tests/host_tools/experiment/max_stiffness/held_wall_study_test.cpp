#include "host_tools/experiment/max_stiffness/held_wall_study.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/quick_study.hpp"

namespace kmax::experiment::held_wall_study_test {
namespace {

TEST(HeldWallStudy, CountsPeopleAndTouches) {
  const auto results = run_held_walls(few_people(3), 5500.0, quick_run());
  ASSERT_EQ(results.size(), 6U);
  EXPECT_EQ(results[0].figure, "9");
  EXPECT_FALSE(results[0].paper_stable);
  EXPECT_EQ(results[2].figure, "11");
  EXPECT_TRUE(results[2].paper_stable);
  EXPECT_EQ(results[5].figure, "12");
  for (const HeldWallResult& result : results) {
    ASSERT_EQ(result.people.size(), 3U);
    EXPECT_EQ(result.named.touches, 2U);
    for (const HeldWall& held : result.people) {
      EXPECT_EQ(held.touches, 2U);
      // An unstable touch moves by more than the threshold.
      if (!held.stable()) {
        EXPECT_GT(held.worst, 0.165e-3);
      }
    }
    EXPECT_EQ(result.condition.origin, report::Origin::predicted);
  }
  EXPECT_FALSE(results[0].named.stable());
  EXPECT_GT(results[0].named.worst, results[2].named.worst);
}

TEST(HeldWallStudy, ASoftWallIsStableUnderEveryLaw) {
  for (const HeldWallResult& result : run_held_walls(few_people(2), 800.0, quick_run())) {
    EXPECT_EQ(result.stable_people(), 2U) << result.condition.name;
    EXPECT_TRUE(result.named.stable()) << result.condition.name;
  }
}

TEST(HeldWallStudy, TheMedianIsTheMiddleOne) {
  HeldWallResult result;
  EXPECT_EQ(result.median_worst(), 0.0);
  for (const double worst : {5e-3, 1e-3, 3e-3}) result.people.push_back({1, 1, worst});
  EXPECT_EQ(result.median_worst(), 3e-3);
  result.people.push_back({1, 0, 4e-3});
  EXPECT_EQ(result.median_worst(), 3.5e-3);
  EXPECT_EQ(result.stable_people(), 1U);
}

}  // namespace
}  // namespace kmax::experiment::held_wall_study_test
