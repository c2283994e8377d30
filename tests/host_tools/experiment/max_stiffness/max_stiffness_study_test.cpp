#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host_tools/experiment/max_stiffness/max_stiffness_report.hpp"
#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::experiment::max_stiffness_study_test {

TEST(MaxStiffnessStudy, DoesNotDependOnTheThreads) {
  const auto one = run_max_stiffness_study(few_people(3, 0.5), stiffness_conditions(), quick_run(1));
  const auto three = run_max_stiffness_study(few_people(3, 0.5), stiffness_conditions(), quick_run(3));
  ASSERT_EQ(one.conditions.size(), 8U);
  for (std::size_t n = 0; n < one.conditions.size(); ++n) {
    ASSERT_EQ(one.conditions[n].subjects.size(), 3U);
    for (std::size_t person = 0; person < 3; ++person)
      EXPECT_EQ(one.conditions[n].subjects[person].stiffness, three.conditions[n].subjects[person].stiffness);
  }
  EXPECT_EQ(one.event_limit_hits, 0U);
  EXPECT_GT(one.conditions[4].mean(), one.conditions[0].mean());
}

TEST(MaxStiffnessStudy, ResumesFromItsJournal) {
  const host_tools_test::TemporaryFolder folder;
  const auto conditions = std::vector{stiffness_conditions()[0], stiffness_conditions()[4]};
  const auto settings = nlohmann::ordered_json::parse(R"({"what": "test"})");
  StiffnessRun run = quick_run();
  const auto whole = run_max_stiffness_study(few_people(3, 0.5), conditions, run);
  struct Stop {};
  {
    RunJournal journal(folder / "run.journal", settings, RunJournal::Begin::fresh);
    run.journal = &journal;
    run.progress = [](std::size_t done, std::size_t) {
      if (done >= 2) throw Stop{};
    };
    EXPECT_THROW(run_max_stiffness_study(few_people(3, 0.5), conditions, run), Stop);
  }
  RunJournal journal(folder / "run.journal", settings, RunJournal::Begin::resume);
  EXPECT_GE(journal.resumed(), 2U);
  EXPECT_LT(journal.resumed(), 6U);
  run.journal = &journal;
  run.progress = nullptr;
  const auto resumed = run_max_stiffness_study(few_people(3, 0.5), conditions, run);
  EXPECT_EQ(journal.size(), 6U);
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_EQ(resumed.conditions[n].mean(), whole.conditions[n].mean());
    EXPECT_EQ(resumed.conditions[n].largest_saturated_share(), whole.conditions[n].largest_saturated_share());
  }
}

TEST(MaxStiffnessStudy, MeanAndDeviationAreThoseOfTheBook) {
  ConditionResult result;
  for (const double stiffness : {2000.0, 4000.0, 4000.0, 4000.0, 5000.0, 5000.0, 7000.0, 9000.0}) {
    MaxStiffness found;
    found.stiffness = stiffness;
    result.subjects.push_back(found);
  }
  EXPECT_DOUBLE_EQ(result.mean(), 5000.0);
  EXPECT_NEAR(result.standard_deviation(), 2138.09, 0.01);
  // t of a table, 2.3646 with seven degrees of freedom.
  EXPECT_NEAR(result.interval(), 2.3646 * 2138.09 / std::sqrt(8.0), 0.1);
  result.subjects.resize(1);
  EXPECT_EQ(result.interval(), 0.0);
  EXPECT_EQ(ConditionResult{}.mean(), 0.0);
}

TEST(MaxStiffnessStudy, IsCalibratedOnlyWhereTheSetWasFitted) {
  const auto origins = [](const SubjectSet& set) {
    StiffnessRun run = quick_run();
    run.steps.last = 1000.0;
    std::string letters;
    for (const ConditionResult& result : run_max_stiffness_study(set, stiffness_conditions(), run).conditions)
      letters += result.condition.origin == report::Origin::calibrated ? 'c' : 'p';
    return letters;
  };
  SubjectSet set = few_people(1);
  EXPECT_EQ(origins(set), "pppppppp");
  set.fitted = Fitted{3580.0, 8410.0, set.device.force_limit};
  EXPECT_EQ(origins(set), "cpppcppp");
  set.fitted->magnetic_target = 8000.0;
  EXPECT_EQ(origins(set), "cppppppp");
  set.fitted = Fitted{3600.0, 8410.0, set.device.force_limit};
  EXPECT_EQ(origins(set), "ppppcppp");
  // Another force limit than that of the fit.
  set.fitted = Fitted{3580.0, 8410.0, set.device.force_limit + 1.0};
  EXPECT_EQ(origins(set), "pppppppp");
}

TEST(MaxStiffnessStudy, WhatIsChangedIsOfEveryTouchAndCalibratedNoMore) {
  SubjectSet set = few_people(2);
  set.fitted = Fitted{3580.0, 8410.0, set.device.force_limit};
  const std::vector<StiffnessCondition> plain{stiffness_conditions()[0]};
  StiffnessRun run = quick_run();
  const MaxStiffnessStudy as_it_is = run_max_stiffness_study(set, plain, run);
  run.changes = TouchChanges({"device.delay=1ms"}, Touching::set_of_people);
  const MaxStiffnessStudy late = run_max_stiffness_study(set, plain, run);
  EXPECT_EQ(as_it_is.conditions[0].condition.origin, report::Origin::calibrated);
  EXPECT_EQ(late.conditions[0].condition.origin, report::Origin::predicted);
  EXPECT_LT(late.conditions[0].mean(), 0.8 * as_it_is.conditions[0].mean());
}

// 20 mm are too few for 1 m/s, and enough for 0.1.
TEST(MaxStiffnessStudy, KnowsHowFastTheHandleWasAtContact) {
  StiffnessRun run = quick_run();
  run.protocol.approach_speeds = {0.1, 1.0};
  const std::vector<StiffnessCondition> plain{stiffness_conditions()[0]};
  const auto speeds = [&] { return run_max_stiffness_study(few_people(2), plain, run).contact_speeds; };
  const auto usual = speeds();
  ASSERT_EQ(usual.size(), 2U);
  EXPECT_EQ(usual[1].intended, 1.0);
  EXPECT_NEAR(usual[0].at_contact, 0.1, 0.02);
  EXPECT_LT(usual[1].at_contact, 0.85);
  run.changes = TouchChanges({"motion.start_position=100mm"}, Touching::set_of_people);
  EXPECT_GT(speeds()[1].at_contact, usual[1].at_contact + 0.1);
}

TEST(MaxStiffnessStudy, WhatIsTakenForStableSavesTouches) {
  const Subject person = few_people(1).subjects.front();
  const auto found_from = [&](double taken_for_stable) {
    const StiffnessJob job{"", touch_setup({}, person.person, stiffness_conditions()[2]), taken_for_stable};
    return run_stiffness_jobs({job}, quick_run()).front();
  };
  const MaxStiffness whole = found_from(0.0);
  ASSERT_GT(whole.stiffness, 2000.0);
  const MaxStiffness half = found_from(std::round(whole.stiffness / 200.0) * 100.0);
  EXPECT_EQ(half.stiffness, whole.stiffness);
  EXPECT_EQ(half.ending_peak_to_peak, whole.ending_peak_to_peak);
  EXPECT_LT(half.touches, whole.touches);
  const MaxStiffness at_it = found_from(whole.stiffness);
  EXPECT_EQ(at_it.stiffness, whole.stiffness);
  EXPECT_LT(at_it.touches, 5U);
  // It was not: nothing of it is left but its touches.
  const MaxStiffness above = found_from(whole.stiffness + 100.0);
  EXPECT_EQ(above.stiffness, whole.stiffness);
  EXPECT_GT(above.touches, whole.touches);
  EXPECT_GT(above.simulated_time, whole.simulated_time);
}

TEST(MaxStiffnessStudy, CountsThePeopleWhoseNumberIsABound) {
  std::vector<MaxStiffness> found(4);
  found[0].stiffness = found[1].stiffness = 40e3;
  found[1].beyond_last = true;
  const CountedEnds ends = counted_ends(found);
  EXPECT_EQ(ends.at_zero, 2U);
  EXPECT_EQ(ends.beyond_last, 1U);
}

// The supplied sets are calibrated: this is what the project shows of paper 1. The bounds are those of the
// study itself.
TEST(MaxStiffnessStudy, TheSuppliedSetsMeetThePaperWhereTheyWereFitted) {
  StiffnessRun run;
  run.threads = 2;
  for (const char* name : {"clipped", "unclipped"}) {
    const SubjectSet set = open_subject_set(name);
    const auto conditions = stiffness_conditions();
    const auto study = run_max_stiffness_study(set, {conditions.begin(), conditions.begin() + 5}, run);
    EXPECT_NEAR(study.conditions[0].mean(), 3580.0, 100.0) << name;
    EXPECT_NEAR(study.conditions[4].mean(), 8410.0, 150.0) << name;
    for (std::size_t n = 1; n < 5; ++n)
      EXPECT_GT(study.conditions[n].mean(), study.conditions[n - 1].mean()) << name << ' ' << n;
    EXPECT_TRUE(as_calibrated(study)) << name;
    EXPECT_EQ(study.conditions[0].condition.origin, report::Origin::calibrated);
    EXPECT_EQ(study.conditions[4].condition.origin, report::Origin::calibrated);
    EXPECT_EQ(study.event_limit_hits, 0U);
  }
}

}  // namespace kmax::experiment::max_stiffness_study_test
