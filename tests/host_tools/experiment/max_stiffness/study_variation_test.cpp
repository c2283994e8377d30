#include "host_tools/experiment/max_stiffness/study_variation.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/quick_study.hpp"
#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::experiment::study_variation_test {
namespace {

TEST(StudyVariation, VariesOneThingAtATime) {
  const auto variations = assumption_variations(few_people(2), {});
  ASSERT_GT(variations.size(), 15U);
  EXPECT_EQ(variations.front().group, "none");
  for (const StudyVariation& variation : variations) {
    const bool threshold = variation.protocol.threshold != TouchProtocol{}.threshold;
    const bool pushes = variation.protocol.pushes != TouchProtocol{}.pushes;
    const bool speeds = variation.protocol.approach_speeds != TouchProtocol{}.approach_speeds;
    const bool device = variation.set.device.mass != 0.045 || variation.set.device.damping != 0.05 ||
                        variation.set.device.delay != 0.0;
    const bool integrator = variation.integrator.kind != simulation::IntegratorKind::exact;
    const int changed = threshold + pushes + speeds + device + integrator;
    EXPECT_EQ(changed, variation.group == "none" ? 0 : 1) << variation.name;
  }
  const auto draws = draw_variations(few_people(2), {}, 25);
  EXPECT_EQ(draws.size(), 25U);
  EXPECT_NE(draws[0].set.subjects[0].person.hand_mass, draws[24].set.subjects[0].person.hand_mass);
}

TEST(StudyVariation, CountsWhatHolds) {
  VariationResult rises;
  rises.means = {1, 2, 3, 4, 9000, 8000, 2, 2};
  VariationResult falls;
  falls.means = {5000, 4000, 3, 4, 5, 1, 1, 1};
  const auto findings = findings_of({rises, falls});
  EXPECT_EQ(findings[0].holds, 1U);
  EXPECT_EQ(findings[0].of, 2U);
  EXPECT_EQ(findings[1].holds, 1U);  // above plain
  EXPECT_EQ(findings[2].holds, 2U);  // below 2 N
  EXPECT_EQ(findings[3].holds, 1U);  // 8.02
}

TEST(StudyVariation, RunsWithWhatItSays) {
  StudyVariation coarse{"coarse", "threshold", false, few_people(2), quick_run().protocol};
  coarse.protocol.threshold = 5e-3;  // nothing moves that far
  StudyVariation as_is{"as is", "none", false, few_people(2), quick_run().protocol};
  StiffnessRun run = quick_run();
  run.steps.last = 12e3;
  const auto results = run_variations({as_is, coarse}, paper_targets(), run);
  ASSERT_EQ(results.size(), 2U);
  ASSERT_EQ(results[0].means.size(), stiffness_conditions().size());
  EXPECT_GT(results[1].means[0], results[0].means[0]);
}

TEST(StudyVariation, AFitThatMissedCountsForNothing) {
  VariationResult rises, missed;
  rises.means = missed.means = {1, 2, 3, 4, 9000, 8000, 2, 2};
  missed.magnetic_met = false;
  for (const VariationFinding& finding : findings_of({rises, missed})) {
    EXPECT_EQ(finding.of, 1U);
    EXPECT_EQ(finding.holds, 1U) << finding.claim;
    EXPECT_EQ(finding.missed, 1U);
  }
  EXPECT_NE(findings_of({rises})[3].claim.find("8.02 N/mm"), std::string::npos);
}

TEST(StudyVariation, SaysWhetherItsFitMetItsTargetsAlsoFromTheJournal) {
  const host_tools_test::TemporaryFolder folder;
  CalibrationSettings out_of_reach = paper_targets();
  out_of_reach.magnetic_target = 39e3;
  out_of_reach.gain_most = 0.01;
  out_of_reach.most_steps = 2;
  const StudyVariation refit{"fitted", "none", true, few_people(1), quick_run().protocol};
  StiffnessRun run = quick_run(1);
  run.steps = {.first = 1000.0, .step = 1000.0, .last = 5000.0};
  RunJournal journal(folder / "run.journal", {{"what", "test"}}, RunJournal::Begin::anew);
  run.journal = &journal;
  const auto fresh = run_variations({refit}, out_of_reach, run);
  EXPECT_FALSE(fresh[0].magnetic_met);
  const auto known = run_variations({refit}, out_of_reach, run);
  EXPECT_EQ(journal.size(), 1U);
  EXPECT_EQ(known[0].plain_met, fresh[0].plain_met);
  EXPECT_FALSE(known[0].magnetic_met);
  EXPECT_EQ(known[0].means, fresh[0].means);
  ASSERT_EQ(fresh[0].ends.size(), stiffness_conditions().size());
  ASSERT_EQ(known[0].ends.size(), fresh[0].ends.size());
  for (std::size_t n = 0; n < fresh[0].ends.size(); ++n) {
    EXPECT_EQ(known[0].ends[n].at_zero, fresh[0].ends[n].at_zero);
    EXPECT_EQ(known[0].ends[n].beyond_last, fresh[0].ends[n].beyond_last);
    EXPECT_EQ(fresh[0].ends[n].at_zero, fresh[0].means[n] == 0.0 ? 1U : 0U);
  }
}

TEST(StudyVariation, OtherPeopleAreNotTheFittedOnes) {
  SubjectSet set = few_people(2);
  set.fitted = Fitted{3580.0, 8410.0, 3.3};
  for (const StudyVariation& draw : draw_variations(set, {}, 3)) EXPECT_FALSE(draw.set.fitted);
}

}  // namespace
}  // namespace kmax::experiment::study_variation_test
