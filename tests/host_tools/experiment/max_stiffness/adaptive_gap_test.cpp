#include "host_tools/experiment/max_stiffness/adaptive_gap.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/quick_study.hpp"

namespace kmax::experiment::adaptive_gap_test {
namespace {

TEST(AdaptiveGap, AHeldCoefficientIsWorthMoreTheFasterTheApproach) {
  SubjectSet set = few_people(2);
  StiffnessRun run = quick_run();
  const auto results = run_approaches(set, {0.2, 1.0}, run);
  ASSERT_EQ(results.size(), 2U);
  EXPECT_GT(results[1].coefficient_at_contact, results[0].coefficient_at_contact);
  EXPECT_GE(results[1].held, results[1].by_mode[0]);
  ASSERT_EQ(results[0].by_mode.size(), 3U);
  const auto needed = coefficient_for(set, 6000.0, run);
  EXPECT_NEAR(needed.mean, 6000.0, 300.0);
  // Eq. 7 is V + 0.8 N for V in m/s.
  EXPECT_NEAR(needed.approach_speed, needed.coefficient - 0.8, 1e-9);
}

}  // namespace
}  // namespace kmax::experiment::adaptive_gap_test
