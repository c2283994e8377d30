#include "tests/studies/studies.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::studies::studies_test {

using experiment::few_people;
using experiment::found_stiffness;
using experiment::paragraphs_of;
using experiment::quick_run;
using experiment::two_people;
using Row = std::vector<std::string>;

std::vector<PeopleMean> means_of(const std::vector<double>& means) {
  std::vector<PeopleMean> found;
  for (const double mean : means) found.push_back({mean, {}, 0.0});
  return found;
}

// --- By name ----------------------------------------------------------------------------------------------

TEST(Studies, AnUnknownNameIsRefusedWithThoseThereAreAndSoIsNobody) {
  const auto message = [](const char* name, std::vector<SubjectSet> sets) {
    return host_tools_test::thrown_message<std::invalid_argument>([&] {
      run_studies({name}, {std::move(sets), quick_run(), {}});
    });
  };
  for (const char* name : {"", "cause", "Causes"})
    for (const Study& study : all_studies) EXPECT_CONTAINS(message(name, {few_people(1)}), study.name);
  EXPECT_TRUE(message("cause", {few_people(1)}).starts_with("cause: there is no such study"));
  EXPECT_CONTAINS(message("all", {}), "at least one subject set");
}

TEST(Studies, ASectionForEachSetOrOneTableForAll) {
  SubjectSet clipped = few_people(1), unclipped = few_people(1);
  unclipped.device.force_limit = 0.0;
  StudyInput input{{clipped, unclipped}, quick_run(), {}};
  input.run.steps.last = 1000.0;  // no wall that is stable so far up ends elsewhere
  const auto sections = run_studies({"figures", "causes"}, input);
  ASSERT_EQ(sections.size(), 3U);
  EXPECT_CONTAINS(sections[0].heading, "clipped at 3.3 N");
  EXPECT_CONTAINS(sections[1].heading, "not clipped");
  ASSERT_EQ(sections[1].tables.size(), 2U);
  EXPECT_EQ(sections[1].tables[1].rows.size(), 3U) << "V as printed and rescaled";
  EXPECT_EQ(sections[2].tables.at(0).columns.size(), 4U);
  EXPECT_EQ(sections[2].tables.at(0).rows.size(), cause_conditions(1.0).size());
  EXPECT_EQ(sections[2].tables.at(0).rows[0][2], ">1.00");
  for (const report::Section& section : sections)
    for (const report::Table& table : section.tables) EXPECT_NO_THROW(report::require_rectangular(table));
}

// --- Held walls -------------------------------------------------------------------------------------------

TEST(HeldWalls, CountsPeopleAndTouches) {
  const auto results = hold_walls(few_people(3), 5500.0, quick_run());
  ASSERT_EQ(results.size(), 9U);
  EXPECT_EQ(results[0].figure, "9");
  EXPECT_FALSE(results[0].paper_stable);
  EXPECT_EQ(results[2].figure, "11");
  EXPECT_TRUE(results[2].paper_stable);
  EXPECT_EQ(results[5].figure, "12");
  EXPECT_EQ(results[8].figure, "12");
  EXPECT_EQ(results[8].condition.name, "adaptive, peak_hold, V x 13.3");
  for (const HeldWallResult& result : results) {
    ASSERT_EQ(result.people.size(), 3U);
    EXPECT_EQ(result.named.touches, 2U);
    for (const HeldWall& held : result.people) {
      EXPECT_EQ(held.touches, 2U);
      // An unstable touch moves by more than the threshold.
      EXPECT_TRUE(held.stable() || held.worst > 0.165e-3);
    }
  }
  EXPECT_FALSE(results[0].named.stable());
  EXPECT_GT(results[0].named.worst, results[2].named.worst);
}

TEST(HeldWalls, ASoftWallIsStableUnderEveryLaw) {
  for (const HeldWallResult& result : hold_walls(few_people(2), 800.0, quick_run())) {
    EXPECT_EQ(result.stable_people(), 2U) << result.condition.name;
    EXPECT_TRUE(result.named.stable()) << result.condition.name;
  }
}

TEST(HeldWalls, TheMedianIsTheMiddleOne) {
  HeldWallResult result;
  EXPECT_EQ(result.median_worst(), 0.0);
  for (const double worst : {5e-3, 1e-3, 3e-3}) result.people.push_back({1, 1, worst});
  EXPECT_EQ(result.median_worst(), 3e-3);
  result.people.push_back({1, 0, 4e-3});
  EXPECT_EQ(result.median_worst(), 3.5e-3);
  EXPECT_EQ(result.stable_people(), 1U);
}

TEST(HeldWalls, TheTableSaysWhatAgreesWithThePaper) {
  HeldWallResult wrong;
  wrong.condition = experiment::stiffness_conditions()[0];
  wrong.figure = "9";
  wrong.named = {15, 0, 0.1e-3};
  wrong.people = {{15, 0, 0.1e-3}, {15, 3, 0.5e-3}};
  HeldWallResult right = wrong;
  right.named = {15, 4, 1.25e-3};
  const report::Table table = held_wall_section(two_people(), {wrong, right}).tables.at(0);
  EXPECT_CONTAINS(table.caption, "15 touches");
  EXPECT_EQ(table.rows[0], (Row{"F_MC = 0 N", "9", "unstable", "0.10", "stable", "no", "1 (0.2 to 1.8)",
                                "0.30", "predicted"}));
  EXPECT_EQ(table.rows[1][4], "unstable");
  EXPECT_EQ(table.rows[1][5], "yes");
}

TEST(HeldWalls, RescaledStandsBesideLiteralOfTheSamePeople) {
  experiment::MaxStiffnessStudy study;
  for (const double factor : {1.0, 2.0}) {
    experiment::ConditionResult result;
    result.condition.name = "adaptive, instant";
    for (const double stiffness : {3000.0, 5000.0}) {
      result.subjects.emplace_back();
      result.subjects.back().stiffness = factor * stiffness;
    }
    study.conditions.push_back(result);
  }
  const report::Table table = rescaled_table(study);
  ASSERT_EQ(table.rows.size(), 1U);
  // Student's 12.706 of one degree of freedom, times the standard deviation, over the root of 2.
  EXPECT_EQ(table.rows[0], (Row{"adaptive, instant", "4.00 ± 12.71", "8.00 ± 25.41", "4.00 ± 12.71"}));
}

TEST(HeldWalls, WhatLiesBetweenTheFittedMeansIsNoTest) {
  std::vector<HeldWallResult> results(3);
  const auto conditions = experiment::stiffness_conditions();
  for (std::size_t n = 0; n < results.size(); ++n) {
    results[n].condition = conditions[2 * n];
    results[n].people.resize(1);
  }
  const auto worth_of = [&](const SubjectSet& set) {
    Row worth;
    const report::Table table = held_wall_section(set, results).tables.at(0);
    for (const Row& row : table.rows) worth.push_back(row.back());
    return worth;
  };
  SubjectSet set = two_people();
  EXPECT_EQ(worth_of(set), (Row{"predicted", "predicted", "predicted"}));
  EXPECT_CONTAINS(paragraphs_of(held_wall_section(set, results)), "Nothing was fitted to these people");
  set.fitted = experiment::Fitted{3580.0, 8410.0, set.device.force_limit};
  EXPECT_EQ(worth_of(set), (Row{"implied by the fit", "predicted", "implied by the fit"}));
  const std::string words = paragraphs_of(held_wall_section(set, results));
  EXPECT_CONTAINS(words, "Figs. 9 and 11 are implied by that fit");
  EXPECT_EQ(words.find("Nothing was fitted"), std::string::npos) << words;
  set.fitted->force_limit = 0.0;  // of another device
  EXPECT_EQ(worth_of(set)[0], "predicted");
}

// --- Causes -----------------------------------------------------------------------------------------------

TEST(CauseCondition, NothingOfTheFieldIsLeftWhereItIsSwitchedOff) {
  for (const CauseCondition& condition : cause_conditions(2.0)) {
    TouchSetup setup;
    condition.apply(setup);
    EXPECT_EQ(setup.wall.wall.kind == control::WallKind::magnetic, condition.field) << condition.name;
    EXPECT_EQ(setup.person.activation_gain > 0.0, condition.stiffens) << condition.name;
    EXPECT_EQ(setup.wall.interference.background_force > 0.0F, condition.preload) << condition.name;
    EXPECT_EQ(setup.person.grip_stiffness,
              simulation::OperatorModel{}.grip_stiffness * condition.grip_factor);
  }
}

class Causes : public testing::Test {
 protected:
  Causes() { set.device.force_limit = 0.0; }
  PeopleMean of(const std::vector<PeopleMean>& found, std::string_view name) {
    const auto conditions = cause_conditions(1.0);
    for (std::size_t n = 0; n < conditions.size(); ++n)
      if (conditions[n].name == name) return found[n];
    ADD_FAILURE() << name;
    return {};
  }
  SubjectSet set = few_people(3, 1.125);
};

TEST_F(Causes, TakeTheEffectApart) {
  const auto found = run_causes(set, cause_conditions(3.25), quick_run(2));
  const auto mean = [&](std::string_view name) { return of(found, name).mean; };
  // Unclipped, a field that no hand answers makes the wall worse; a stiffer grip makes it better, the arm
  // not.
  EXPECT_LT(mean("field, hand unchanged"), mean("plain wall"));
  EXPECT_GT(mean("grip stiffer, no field"), 1.5 * mean("plain wall"));
  EXPECT_NEAR(mean("arm stiffer, no field"), mean("plain wall"), 0.15 * mean("plain wall"));
  EXPECT_LT(mean("2 N inside only, hand unchanged"), 0.5 * mean("plain wall"));
  const auto lengths = run_causes(set, fields_of({0.25e-3, 1e-3, 5e-3}), quick_run(2));
  EXPECT_LT(lengths[0].mean, lengths[1].mean);
  EXPECT_LT(lengths[1].mean, lengths[2].mean);
}

TEST_F(Causes, AreLookedForBelowTheFirstStiffnessOfOtherSearches) {
  StiffnessRun run = quick_run(2);
  run.steps.last = 4000.0;
  // A steep field that no hand answers is unstable at 1 N/mm for some of these people.
  const auto lengths = run_causes(set, fields_of({0.02e-3}), run);
  EXPECT_LT(lengths[0].mean, 1000.0);
  EXPECT_GE(lengths[0].mean, cause_first_stiffness);
  EXPECT_EQ(lengths[0].ends.at_zero, 0U);
  // Everything is stable at so little, and nothing ends.
  run.steps.last = 200.0;
  run.protocol.threshold = 0.1;
  for (const PeopleMean& cause : run_causes(set, cause_conditions(3.25), run)) {
    EXPECT_EQ(cause.ends.beyond_last, 3U);
    EXPECT_EQ(cause.mean, 200.0);
  }
  // Nothing is.
  run.protocol.threshold = 1e-12;
  std::size_t at_zero = 0;
  for (const PeopleMean& cause : run_causes(set, cause_conditions(3.25), run)) at_zero += cause.ends.at_zero;
  EXPECT_GT(at_zero, 0U);
}

TEST(CauseSection, MarksMeansThatHoldBoundsAndSaysForHowMany) {
  CausesOfSet found{few_people(12), means_of(std::vector<double>(10, 2500.0)),
                    means_of(std::vector<double>(5, 900.0))};
  found.causes[1] = {150.0, {5, 0}, 0.0};
  found.causes[4].ends.beyond_last = 2;
  found.lengths[1] = {120.0, {7, 0}, 0.0};
  const report::Section section = cause_section({found});
  EXPECT_EQ(section.tables[0].rows[0][2], "2.50");
  EXPECT_EQ(section.tables[0].rows[1][2], "<0.15");
  EXPECT_EQ(section.tables[0].rows[4], (Row{"grip stiffer, no field", "k1 and b1 grown", ">2.50"}));
  EXPECT_EQ(section.tables[1].rows[1], (Row{"0.5", "8.00", "<0.12"}));
  EXPECT_EQ(section.tables[1].rows[2], (Row{"1", "4.00", "0.90"}));
  const std::string words = paragraphs_of(section);
  EXPECT_CONTAINS(words, "begins at 100 N/m");
  EXPECT_CONTAINS(words, "field, hand unchanged, force clipped at 3.3 N: 5 of 12");
  EXPECT_CONTAINS(words, "x_0 = 0.5 mm, force clipped at 3.3 N: 7 of 12");
  EXPECT_CONTAINS(words, "grip stiffer, no field, force clipped at 3.3 N: 2 of 12");
}

// --- Variations -------------------------------------------------------------------------------------------

const std::vector<double> as_in_the_paper{3580, 4000, 5000, 7000, 8410, 8020, 6000, 6000};

VariationResult result_with(const std::vector<double>& means, bool refit = false, bool plain_met = true,
                            bool magnetic_met = true) {
  VariationResult result;
  result.variation.refit = refit;
  result.means = means_of(means);
  result.plain_met = plain_met;
  result.magnetic_met = magnetic_met;
  return result;
}

TEST(Variations, ChangeOneThingAtATime) {
  auto variations = assumption_variations(few_people(2), {});
  ASSERT_GT(variations.size(), 15U);
  for (Variation& one : compliance_variations(few_people(2), {})) variations.push_back(std::move(one));
  EXPECT_EQ(variations.front().group, "none");
  const experiment::TouchProtocol usual;
  for (const Variation& variation : variations) {
    const simulation::DeviceModel& device = variation.set.device;
    const int changed =
        (variation.protocol.threshold != usual.threshold) + (variation.protocol.pushes != usual.pushes) +
        (variation.protocol.approach_speeds != usual.approach_speeds) +
        (device.structure || device.mass != 0.045 || device.damping != 0.05 || device.delay != 0.0) +
        (variation.protocol.phases != usual.phases) +
        (variation.integrator.kind != simulation::IntegratorKind::exact);
    EXPECT_EQ(changed, variation.group == "none" ? 0 : 1) << variation.name;
  }
}

TEST(Variations, ADeviceThatBendsWeighsTheSame) {
  std::size_t compliant = 0;
  for (const Variation& variation : compliance_variations(few_people(1), {})) {
    const simulation::DeviceModel& device = variation.set.device;
    if (!device.structure) continue;
    ++compliant;
    EXPECT_DOUBLE_EQ(device.mass + device.structure->handle_mass, 0.045);
  }
  EXPECT_EQ(compliant, 4U);
}

TEST(VariationSection, SaysWhatTheHandFeelsBehindACompliance) {
  VariationResult bends = result_with({2000, 2, 3, 4, 5, 1, 1, 1});
  bends.variation.set.device.structure = simulation::StructureModel{.stiffness = 2000.0};
  EXPECT_CONTAINS(paragraphs_of(variation_section("x", {bends})),
                  "without a field, 2.00 N/mm with a structure of 2.00 N/mm are 1.00 at the tip");
  EXPECT_EQ(paragraphs_of(variation_section("x", {result_with(as_in_the_paper)})).find("at the tip"),
            std::string::npos);
}

TEST(Variations, OtherPeopleAreNotTheFittedOnes) {
  SubjectSet set = few_people(2);
  set.fitted = experiment::Fitted{3580.0, 8410.0, 3.3};
  const auto groups = draw_variations(set, {}, 25);
  ASSERT_EQ(groups.size(), 25U);
  EXPECT_NE(groups[0].set.subjects[0].person.hand_mass, groups[24].set.subjects[0].person.hand_mass);
  for (const Variation& group : groups) EXPECT_FALSE(group.set.fitted);
}

TEST(Variations, RunWithWhatTheySayAndSayWhetherTheirFitMetItsTargets) {
  Variation as_is{"as is", "none", false, few_people(1), quick_run().protocol}, coarse = as_is, refit = as_is;
  coarse.protocol.threshold = 5e-3;  // nothing moves that far
  refit.refit = true;
  experiment::CalibrationSettings out_of_reach = experiment::paper_targets();
  out_of_reach.magnetic_target = 39e3;
  out_of_reach.gain_most = 0.01;
  out_of_reach.most_steps = 2;
  StiffnessRun run = quick_run();
  run.steps.last = 12e3;
  const auto results = run_variations({as_is, coarse, refit}, out_of_reach, run);
  ASSERT_EQ(results.size(), 3U);
  ASSERT_EQ(results[0].means.size(), experiment::stiffness_conditions().size());
  EXPECT_GT(results[1].means[0].mean, results[0].means[0].mean);
  EXPECT_TRUE(results[0].met());
  EXPECT_FALSE(results[2].magnetic_met);
}

TEST(VariationSection, AMissedFitIsSaidAndNothingIsRobustWithIt) {
  const VariationResult good = result_with(as_in_the_paper, true),
                        plain = result_with(as_in_the_paper, true, false),
                        magnetic = result_with(as_in_the_paper, true, true, false),
                        both = result_with(as_in_the_paper, true, false, false);
  const report::Section clean = variation_section("x", {good, result_with(as_in_the_paper)});
  EXPECT_EQ(clean.tables[0].rows[0][3], "met");
  EXPECT_EQ(clean.tables[0].rows[1][3], "-");
  EXPECT_TRUE(clean.paragraphs[0].starts_with("Robust: ")) << clean.paragraphs[0];
  EXPECT_CONTAINS(clean.paragraphs.back(), "fitted again, all three means of the paper come out");
  EXPECT_CONTAINS(clean.paragraphs[0], "(2 of 2)");
  const report::Section missed = variation_section("x", {good, plain, magnetic, both});
  EXPECT_EQ(missed.tables[0].rows[1][3], "missed: plain");
  EXPECT_EQ(missed.tables[0].rows[2][3], "missed: 2 N");
  EXPECT_EQ(missed.tables[0].rows[3][3], "missed: both");
  for (const std::string& words : missed.paragraphs)
    EXPECT_EQ(words.find("Robust: "), std::string::npos) << words;
  EXPECT_TRUE(missed.paragraphs[0].starts_with("Holds where judged: ")) << missed.paragraphs[0];
  EXPECT_CONTAINS(missed.paragraphs[0], "(1 of 1; 3 whose fit missed its targets left out)");
  EXPECT_TRUE(
      variation_section("x", {good, good, good, both}).paragraphs[0].starts_with("Holds where judged: "));
  EXPECT_TRUE(variation_section("x", {both}).paragraphs[0].starts_with("Not judged: "));
  EXPECT_NO_THROW(report::require_rectangular(missed.tables[0]));
}

TEST(VariationSection, MarksMeansThatHoldBounds) {
  VariationResult one = result_with(as_in_the_paper);
  one.variation.name = "pushes of 1 N";
  one.variation.set = few_people(12);
  one.means[1].ends = {3, 0};
  one.means[2].ends = {0, 2};
  const report::Section section = variation_section("x", {one});
  EXPECT_EQ(section.tables[0].rows[0][6], "3.58");
  EXPECT_EQ(section.tables[0].rows[0][7], "<4.00");
  EXPECT_EQ(section.tables[0].rows[0][8], ">5.00");
  EXPECT_CONTAINS(paragraphs_of(section), "pushes of 1 N, F_MC = 0.5 N: 3 of 12");
  EXPECT_CONTAINS(paragraphs_of(section), "pushes of 1 N, F_MC = 1 N: 2 of 12");
}

TEST(VariationSection, TheWordsFollowTheShareOfEachClaim) {
  const VariationResult rises = result_with({1, 2, 3, 4, 9000, 8000, 2, 2}),
                        falls = result_with({5000, 4000, 3, 4, 5, 1, 1, 1});
  const auto first_word = [&](std::size_t rising, std::size_t falling) {
    std::vector<VariationResult> results(rising, rises);
    results.insert(results.end(), falling, falls);
    const std::string words = variation_section("x", results).paragraphs[0];
    return words.substr(0, words.find(':'));
  };
  EXPECT_EQ(first_word(3, 0), "Robust");
  EXPECT_EQ(first_word(3, 1), "Mostly");
  EXPECT_EQ(first_word(2, 1), "Not robust");
  EXPECT_EQ(first_word(0, 2), "Never");
  const auto words = variation_section("x", {rises, falls}).paragraphs;
  EXPECT_CONTAINS(words[1], "above the plain one, in its best mode (1 of 2)");
  EXPECT_CONTAINS(words[2], "below a constant 2 N, in its best mode (2 of 2)");
  EXPECT_CONTAINS(words[3], "reaches 8.02 N/mm within 0.4 N/mm, in its best mode (1 of 2)");
}

// --- The adaptive gap -------------------------------------------------------------------------------------

TEST(AdaptiveGap, AHeldCoefficientIsWorthMoreTheFasterTheApproach) {
  const auto results = run_approaches(few_people(2), {0.2, 1.0}, quick_run());
  ASSERT_EQ(results.size(), 2U);
  EXPECT_GT(results[1].coefficient_at_contact, results[0].coefficient_at_contact);
  EXPECT_GE(results[1].walls[4].mean, results[1].walls[1].mean);
  const auto needed = coefficient_for(few_people(2), 6000.0, quick_run());
  EXPECT_NEAR(needed.mean, 6000.0, 300.0);
  // Eq. 7 is V + 0.8 N for V in m/s.
  EXPECT_NEAR(needed.approach_speed, needed.coefficient - 0.8, 1e-9);
}

ApproachResult approach(double speed, double best) {
  ApproachResult result{speed, {}, 1.3, 0.04};
  const auto means = means_of({9000.0, best - 500.0, best, best - 100.0, 7000.0});
  std::copy(means.begin(), means.end(), result.walls.begin());
  return result;
}

TEST(AdaptiveGapSection, TheWordsFollowTheNumbers) {
  const report::Section slow_helps =
      adaptive_gap_section(two_people(), {approach(0.05, 8300.0), approach(0.5, 5000.0)}, {1.9, 8000.0, 1.1});
  EXPECT_CONTAINS(slow_helps.heading, "8.02 N/mm");
  EXPECT_CONTAINS(paragraphs_of(slow_helps), "a constant F_MC of 1.90 N gives 8.00 N/mm");
  EXPECT_CONTAINS(paragraphs_of(slow_helps), "where the handle moves at 1.10 m/s");
  EXPECT_CONTAINS(paragraphs_of(slow_helps), "at 0.05 m/s alone the best mode reaches 8.30 N/mm");
  EXPECT_CONTAINS(paragraphs_of(slow_helps), "the study \"assumptions\"");
  EXPECT_EQ(slow_helps.tables[0].rows[0],
            (Row{"0.05", "0.04", "9.00", "7.80", "8.30", "8.20", "7.00", "1.30"}));
  const std::string neither = paragraphs_of(adaptive_gap_section(
      two_people(), {approach(0.05, 5000.0), approach(0.5, 5000.0)}, {4.0, 6000.0, 3.2}));
  EXPECT_EQ(neither.find("One way"), std::string::npos) << neither;
  EXPECT_EQ(neither.find("Another is"), std::string::npos) << neither;
  EXPECT_CONTAINS(neither, "gives 6.00 N/mm, the nearest to 8.02 N/mm");
  EXPECT_CONTAINS(neither, "is no way");
}

TEST(AdaptiveGapSection, NeverSaysThatTheWaysItKnowsAreAll) {
  const std::string words = paragraphs_of(adaptive_gap_section(
      two_people(), {approach(0.05, 8300.0), approach(0.5, 5000.0)}, {1.9, 8000.0, 1.1}));
  EXPECT_EQ(words.find("needs touches"), std::string::npos) << words;
  EXPECT_CONTAINS(words, "Others were not looked for");
}

TEST(Slopes, ASteeperLawIsWorthMoreWhereItFollowsTheVelocity) {
  const auto results = run_slopes(few_people(2), {2.4, 0.18}, quick_run());
  ASSERT_EQ(results.size(), 2U);
  EXPECT_GT(results[1].modes[0].mean, results[0].modes[0].mean + 500.0);
  const auto printed = run_approaches(few_people(2), {0.1}, quick_run());
  StiffnessRun one = quick_run();
  one.protocol.approach_speeds = {0.1};
  EXPECT_EQ(run_slopes(few_people(2), {2.4}, one)[0].modes[0].mean, printed[0].walls[1].mean);
}

TEST(SlopeSection, IsAHypothesisWithWhatSpeaksAgainstIt) {
  const auto slope = [](double velocity_max, double instant) {
    SlopeResult result{velocity_max, {}};
    const auto means = means_of({instant, 5000.0, 5000.0});
    std::copy(means.begin(), means.end(), result.modes.begin());
    return result;
  };
  const report::Section reached = slope_section(two_people(), {slope(2.4, 4900.0), slope(0.18, 7900.0)});
  EXPECT_CONTAINS(reached.heading, "hypothesis");
  EXPECT_EQ(reached.tables[0].rows[1], (Row{"0.18", "x 13.3", "7.90", "5.00", "5.00"}));
  EXPECT_CONTAINS(paragraphs_of(reached), "instant with 0.18 m/s (7.90)");
  for (const char* part : {"For it:", "Against it:", "What would decide it:"})
    EXPECT_CONTAINS(paragraphs_of(reached), part);
  const std::string not_reached = paragraphs_of(slope_section(two_people(), {slope(0.18, 6000.0)}));
  EXPECT_CONTAINS(not_reached, "With none of these");
  EXPECT_EQ(not_reached.find("For it:"), std::string::npos) << not_reached;
}

TEST(AdaptiveGapSection, MarksMeansThatHoldBounds) {
  ApproachResult slow = approach(0.05, 8300.0);
  slow.walls[0].ends = {1, 0};
  slow.walls[2].ends = {0, 2};
  slow.walls[4].ends = {0, 1};
  const report::Section section = adaptive_gap_section(two_people(), {slow}, {});
  EXPECT_EQ(section.tables[0].rows[0],
            (Row{"0.05", "0.04", "<9.00", "7.80", ">8.30", "8.20", ">7.00", "1.30"}));
  EXPECT_CONTAINS(paragraphs_of(section), "constant 2 N at 0.05 m/s: 1 of 2");
  EXPECT_CONTAINS(paragraphs_of(section),
                  "latched at 0.05 m/s: 2 of 2; held for the whole touch at 0.05 m/s: 1 of 2");
}

// --- Both criteria at once --------------------------------------------------------------------------------

TEST(SweepByBoth, TakesOfEachPersonTheCriterionThatGivesLess) {
  const SubjectSet set = few_people(3);
  StiffnessRun run = quick_run();
  run.protocol.approach_speeds = {0.1, 0.5};
  const WallChange damped_wall = damped(8.0, control::VelocityEstimatorKind::difference);
  const std::vector<TwoMeans> found = sweep_by_both(set, {[](TouchSetup&) {}, damped_wall}, run);
  ASSERT_EQ(found.size(), 2U);
  double least = 0.0;
  for (const experiment::Subject& subject : set.subjects) {
    TouchSetup setup = experiment::touch_setup(set.device, subject.person, {});
    damped_wall(setup);
    double smaller = 1e9;
    for (const TouchProtocol& protocol : by_both(run))
      smaller = std::min(smaller, experiment::search_max_stiffness(setup, protocol, run.steps).stiffness);
    least += smaller / 3.0;
  }
  EXPECT_NEAR(found[1].both.mean, least, 1e-9 * least);
  EXPECT_LE(found[0].both.mean, std::min(found[0].moves.mean, found[0].feels.mean));
  EXPECT_EQ(found[1].moves.mean, sweep(set, {damped_wall}, run).front().mean);
}

// --- Rates ------------------------------------------------------------------------------------------------

TEST(LoopRates, AFasterLoopRendersAStifferWallAndADelayEatsIt) {
  const auto results =
      run_rates({{.rate = 500.0}, {.rate = 1000.0}, {.rate = 1000.0, .delay = 0.5e-3}}, {}, quick_run());
  EXPECT_GT(results[1].moves.stiffness, 1.5 * results[0].moves.stiffness);
  EXPECT_LT(results[2].moves.stiffness, 0.7 * results[1].moves.stiffness);
  // One count of 55 um is 1 N at 18 N/mm.
  const auto fast = run_rates({{.rate = 5000.0}}, {}, quick_run());
  EXPECT_LT(fast[0].feels.stiffness, 1.04 / 55e-6);
  EXPECT_GT(fast[0].moves.stiffness, fast[0].feels.stiffness);
}

TEST(LoopRates, NamesEveryCaseOfAnEncoderOnce) {
  const auto cases = rate_cases(5.5e-6);
  EXPECT_EQ(cases.size(), study_rates.size() * (3 + all_estimators.size()));
  std::set<std::pair<double, std::string>> names;
  for (const RateCase& setting : cases)
    EXPECT_TRUE(names.insert({setting.rate, setting.name()}).second) << setting.name();
  EXPECT_EQ(cases.back().name(), "damping 2 N s/m, edge_period");
}

TEST(RateSection, HasATableForEachEncoderAndMeasureAndGapsWhereNothingWasRun) {
  const host_tools_test::TemporaryFolder folder;
  const RateResult known{
      {.rate = 1000.0, .count_length = 55e-6}, found_stiffness(7000.0), found_stiffness(5000.0)};
  RateResult beyond = known, fine = known;
  beyond.setting.rate = 20e3;
  beyond.moves.stiffness = 40e3;
  beyond.moves.beyond_last = true;
  fine.setting.count_length = 5.5e-6;
  fine.setting.delay = 0.5e-3;
  const report::Section section = rate_section({fine, known, beyond});
  ASSERT_EQ(section.tables.size(), 4U);
  // The coarse encoder comes first.
  EXPECT_CONTAINS(section.tables[0].caption, "55 um, unstable: moves by 3 counts");
  EXPECT_CONTAINS(section.tables[1].caption, "55 um, unstable: swings by 1 N");
  EXPECT_CONTAINS(section.tables[3].caption, "5.5 um, unstable: swings by 1 N");
  ASSERT_EQ(section.tables[0].rows.size(), 1U);
  EXPECT_EQ(section.tables[0].rows[0], (Row{"no damping", "-", "7", "-", "-", "-", ">40"}));
  ASSERT_EQ(section.tables[1].rows.size(), 1U);
  EXPECT_EQ(section.tables[1].rows[0], (Row{"no damping", "-", "5", "-", "-", "-", "5"}));
  for (const report::Table& table : section.tables) EXPECT_NO_THROW(report::require_rectangular(table));
  // A picture is of one encoder and measure.
  const auto picture = draw_rates({known, fine}, 55e-6, RateMeasure::moves, folder / "r.svg");
  EXPECT_CONTAINS(picture.caption, "Encoder of 55 um, unstable: moves by 3 counts");
  EXPECT_CONTAINS(folder.read("r.svg"), known.setting.name());
  EXPECT_EQ(folder.read("r.svg").find(fine.setting.name()), std::string::npos);
}

TEST(RateSection, BeginsWithWhatTheHighestRateHolds) {
  EXPECT_EQ(all_studies.front().name, "rates") << "the page begins with its strongest result";
  std::vector<RateResult> results;
  for (const double rate : {500.0, 20e3})
    for (const double damping : {0.0, 2.0})
      results.push_back({{.rate = rate, .count_length = 5.5e-6, .wall_damping = damping},
                         found_stiffness(rate < 1e3 ? 6000.0 : 200e3),
                         found_stiffness(rate < 1e3      ? 7000.0
                                         : damping > 0.0 ? 14e3
                                                         : 180e3)});
  results.push_back(results.back());  // with delay nothing is counted
  results.back().setting.delay = 0.5e-3;
  const std::string first = rate_section(results).paragraphs.front();
  EXPECT_EQ(
      first,
      "With 5.5 um 2 of 2 walls without delay hold 15 N/mm at 20 kHz by the position and 1 by both criteria, "
      "the stiffest of them 180 N/mm; at 500 Hz none does, the stiffest 6.");
  results[1].moves = results[1].feels = found_stiffness(16e3);
  EXPECT_CONTAINS(rate_section(results).paragraphs.front(), "at 500 Hz 1, the stiffest 16.");
}

}  // namespace kmax::studies::studies_test
