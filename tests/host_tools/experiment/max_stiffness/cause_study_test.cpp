#include "host_tools/experiment/max_stiffness/cause_study.hpp"

#include <gtest/gtest.h>

#include <string_view>

#include "tests/host_tools/experiment/max_stiffness/quick_study.hpp"

namespace kmax::experiment::cause_study_test {
namespace {

TEST(CauseStudy, TakesTheEffectApart) {
  SubjectSet set = few_people(3, 1.125);
  set.device.force_limit = 0.0;
  const auto causes = run_cause_study(set, quick_run(2));
  const auto mean = [&](std::string_view name) {
    for (const CauseResult& cause : causes) {
      if (cause.condition.name == name) return cause.mean;
    }
    ADD_FAILURE() << name;
    return 0.0;
  };
  // Unclipped, a field that no hand answers makes the wall worse; a stiffer grip makes it better, the arm
  // not.
  EXPECT_LT(mean("field, hand unchanged"), mean("plain wall"));
  EXPECT_GT(mean("grip stiffer, no field"), 1.5 * mean("plain wall"));
  EXPECT_NEAR(mean("arm stiffer, no field"), mean("plain wall"), 0.15 * mean("plain wall"));
  EXPECT_LT(mean("2 N inside only, hand unchanged"), 0.5 * mean("plain wall"));
  const auto lengths = run_field_lengths(set, {0.25e-3, 1e-3, 5e-3}, quick_run(2));
  EXPECT_LT(lengths[0].mean, lengths[1].mean);
  EXPECT_LT(lengths[1].mean, lengths[2].mean);
  EXPECT_DOUBLE_EQ(lengths[1].slope, 4000.0);
}

TEST(CauseStudy, LooksBelowTheFirstStiffnessOfOtherSearches) {
  SubjectSet set = few_people(3, 1.125);
  set.device.force_limit = 0.0;
  StiffnessRun run = quick_run(2);
  run.steps.last = 4000.0;
  // A steep field that no hand answers is unstable at 1 N/mm for some of these people.
  const auto lengths = run_field_lengths(set, {0.02e-3}, run);
  EXPECT_LT(lengths[0].mean, 1000.0);
  EXPECT_GE(lengths[0].mean, cause_first_stiffness);
  EXPECT_EQ(lengths[0].ends.at_zero, 0U);
  // Everything is stable at so little, and nothing ends.
  run.steps.last = 200.0;
  run.protocol.threshold = 0.1;
  for (const CauseResult& cause : run_cause_study(set, run)) {
    EXPECT_EQ(cause.ends.beyond_last, 3U) << cause.condition.name;
    EXPECT_EQ(cause.mean, 200.0) << cause.condition.name;
  }
  // Nothing is.
  run.protocol.threshold = 1e-12;
  std::size_t at_zero = 0;
  for (const CauseResult& cause : run_cause_study(set, run)) at_zero += cause.ends.at_zero;
  EXPECT_GT(at_zero, 0U);
}

}  // namespace
}  // namespace kmax::experiment::cause_study_test
