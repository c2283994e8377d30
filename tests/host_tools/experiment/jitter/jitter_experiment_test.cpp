#include "host_tools/experiment/jitter/jitter_experiment.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::jitter_experiment_test {

std::vector<RigSample> course(const std::vector<double>& outside, double begin = 0.0) {
  std::vector<RigSample> samples;
  for (std::size_t i = 0; i < outside.size(); ++i)
    samples.push_back({begin + 0.002 * static_cast<double>(i), outside[i], i % 2 == 0 ? 5.0 : 1.0, 0.0, 0.0});
  return samples;
}

JitterWall short_wall() {
  JitterWall wall;
  wall.window = 0.1;
  wall.settled_time = 0.01;
  return wall;
}

TEST(MeasureJitter, AHandleThatStaysInsideHasNone) {
  const JitterMeasure measure =
      measure_jitter(course({3e-3, 1e-3, 0, -1e-4, -2e-4, -2e-4, -2e-4, -2e-4}), short_wall());
  EXPECT_TRUE(measure.touched);
  EXPECT_TRUE(measure.settled);
  EXPECT_EQ(measure.amplitude, 0.0);
  EXPECT_EQ(measure.adjustment_time, 0.0);
  EXPECT_EQ(measure.beyond_limit_share, 0.5);
}

TEST(MeasureJitter, CountsFromTheFirstTouchToTheEndOfTheLastSampleOutside) {
  // Touch at sample 1, out at 2 to 3 and at 5, inside from 6 on.
  const JitterMeasure measure = measure_jitter(
      course({9e-3, -1e-4, 2e-3, 1e-3, -1e-4, 5e-4, -1e-4, -1e-4, -1e-4, -1e-4, -1e-4, -1e-4, -1e-4}),
      short_wall());
  EXPECT_TRUE(measure.settled);
  EXPECT_DOUBLE_EQ(measure.amplitude, 2e-3);
  EXPECT_NEAR(measure.adjustment_time, 5 * 0.002, 1e-12);
}

TEST(MeasureJitter, AHandleThatIsOutsideNearTheEndHasNotSettled) {
  EXPECT_FALSE(measure_jitter(course({-1e-4, 2e-3, -1e-4, 2e-3, -1e-4, -1e-4}), short_wall()).settled);
  EXPECT_FALSE(measure_jitter(course({-1e-4, 2e-3}), short_wall()).settled);
}

TEST(MeasureJitter, WithoutATouchThereIsNothing) {
  const JitterMeasure measure = measure_jitter(course({1e-3, 2e-3, 1e-6}), short_wall());
  EXPECT_FALSE(measure.touched);
  EXPECT_FALSE(measure.settled);
  EXPECT_FALSE(measure_jitter({}, short_wall()).touched);
}

TEST(MeasureJitter, WhatComesAfterTheWindowDoesNotCount) {
  std::vector<double> outside(80, -1e-4);
  outside[60] = 5e-3;  // 0.12 s after the touch
  EXPECT_EQ(measure_jitter(course(outside), short_wall()).amplitude, 0.0);
}

RC_GTEST_PROP(MeasureJitterProperty, DoesNotDependOnWhenTheRecordingBegan, ()) {
  const auto steps = *rc::gen::container<std::vector<int>>(40, rc::gen::inRange(-3, 4));
  std::vector<double> outside(steps.begin(), steps.end());
  const auto begin = *rc::gen::inRange(-5, 6);
  const JitterMeasure a = measure_jitter(course(outside), short_wall());
  const JitterMeasure b = measure_jitter(course(outside, begin), short_wall());
  RC_ASSERT(a.touched == b.touched);
  RC_ASSERT(a.settled == b.settled);
  RC_ASSERT(a.amplitude == b.amplitude);
  RC_ASSERT(std::abs(a.adjustment_time - b.adjustment_time) < 1e-9);
}

std::vector<JitterResult> as_printed() {
  std::vector<JitterResult> results;
  for (const paper::JitterCell& cell : paper::table_1) {
    JitterMeasure measure;
    measure.touched = measure.settled = true;
    measure.amplitude = cell.amplitude;
    measure.adjustment_time = cell.adjustment_time;
    results.push_back(mean_jitter(cell, {&measure, 1}));
  }
  return results;
}

// A rule that the paper's own numbers break would say nothing.
TEST(JudgeJitter, ThePapersOwnTableMeetsItsClaim) {
  const JitterVerdict verdict = judge_jitter(as_printed());
  EXPECT_EQ(verdict.claim_met(), true);
  EXPECT_DOUBLE_EQ(verdict.amplitude_rank.value(), 1.0);
  EXPECT_DOUBLE_EQ(verdict.time_rank.value(), 1.0);
  ASSERT_EQ(verdict.amplitude.size(), 3u);  // at 1 N there is no jitter to fall
}

TEST(JudgeJitter, ATouchThatNeverSettlesHasNoTimeThatCouldFall) {
  std::vector<JitterResult> results = as_printed();
  results.back().unsettled = 1;
  EXPECT_EQ(judge_jitter(results).amplitude_falls(), true);
  EXPECT_EQ(judge_jitter(results).time_falls(), std::nullopt);
  results.back().unsettled = 0;
  results.back().aborted = 1;
  EXPECT_EQ(judge_jitter(results).claim_met(), std::nullopt);
}

TEST(JudgeJitter, OneForceThatDoesNotFallIsEnough) {
  std::vector<JitterResult> results = as_printed();
  for (JitterResult& result : results)
    if (result.paper.interference == 5.0 && result.paper.background == 4.0) result.amplitude = 6e-3;
  EXPECT_EQ(judge_jitter(results).amplitude_falls(), false);
  EXPECT_EQ(judge_jitter(results).time_falls(), true);
  EXPECT_EQ(judge_jitter(results).claim_met(), false);
  EXPECT_EQ(judge_jitter({}).claim_met(), std::nullopt);
}

TEST(JudgeJitter, NoTouchAtAllIsNoClaim) {
  std::vector<JitterResult> results = as_printed();
  for (JitterResult& result : results) result.touches = 0;
  EXPECT_EQ(judge_jitter(results).amplitude_falls(), std::nullopt);
  EXPECT_EQ(judge_jitter(results).claim_met(), std::nullopt);
}

const std::vector<simulation::OperatorModel> subject_1(1);

JitterVerdict verdict_of(const std::vector<simulation::OperatorModel>& people) {
  SimulatedRig rig("jitter", people, jitter_hands());
  return judge_jitter(run_jitter(rig, {}).results);
}

/// One touch of a simulated person.
RigTouch touch_of(double background, double interference, const SimulatedHands& hands = jitter_hands()) {
  SimulatedRig rig("jitter", subject_1, hands);
  rig.set({1000.0, 500.0, control::InterferenceMode::perpendicular, interference, background});
  return rig.record({});
}

TEST(SimulatedJitter, TheWeakestForceThrowsNobodyOut) {
  for (const double background : {0.0, 1.0}) {
    const JitterMeasure measure = measure_jitter(touch_of(background, 1.0).samples, {});
    EXPECT_TRUE(measure.touched);
    EXPECT_EQ(measure.amplitude, 0.0) << background;
    EXPECT_EQ(measure.adjustment_time, 0.0);
  }
}

TEST(SimulatedJitter, BothFallWithTheBackgroundForce) {
  const JitterVerdict verdict = verdict_of(subject_1);
  EXPECT_EQ(verdict.amplitude_falls(), true);
  EXPECT_EQ(verdict.time_falls(), true);
}

// The point of the experiment: it is the stiffening that makes the trend.
TEST(SimulatedJitter, AHandThatDoesNotStiffenShowsNoTrend) {
  simulation::OperatorModel person;
  person.activation_gain = 0.0;
  const JitterVerdict verdict = verdict_of({person});
  EXPECT_EQ(verdict.amplitude_falls(), false);
  for (const BackgroundTrend& trend : verdict.amplitude)
    EXPECT_GT(trend.with.value(), 0.8 * trend.without.value());
}

// gamma was fitted between 0 and 2 N: 11 N make nobody stiffer than 7 N.
TEST(SimulatedJitter, NobodyStiffensWithoutEnd) {
  const auto amplitude = [](double limit) {
    simulation::OperatorModel person;
    person.activation_limit = limit;
    SimulatedRig rig("jitter", {person}, jitter_hands());
    rig.set({1000.0, 500.0, control::InterferenceMode::perpendicular, 7.0, 4.0});
    return measure_jitter(rig.record({}).samples, {}).amplitude;
  };
  EXPECT_EQ(amplitude(simulation::OperatorModel{}.activation_limit), amplitude(7.0));
  EXPECT_NE(amplitude(7.0), amplitude(1000.0));
}

TEST(SimulatedJitter, APersonWhoNeverPressesHarderNeverSettles) {
  SimulatedHands indifferent = jitter_hands();
  indifferent.reaction = 0.0;
  const JitterMeasure measure = measure_jitter(touch_of(0.0, 7.0, indifferent).samples, {});
  EXPECT_TRUE(measure.touched);
  EXPECT_FALSE(measure.settled);
}

TEST(SimulatedJitter, TheForceIsNotClippedUnlessAskedFor) {
  const auto strongest = [](const SimulatedHands& hands) {
    double most = 0.0;
    for (const RigSample& sample : touch_of(4.0, 7.0, hands).samples) most = std::max(most, sample.force);
    return most;
  };
  SimulatedHands hands = jitter_hands();
  EXPECT_GT(strongest(hands), 11.0);
  hands.device.force_limit = 3.3;
  EXPECT_LE(strongest(hands), 3.3001);
}

TEST(SimulatedJitter, ABackgroundForceActsBeforeTheTouch) {
  const std::vector<RigSample> samples = touch_of(3.0, 5.0).samples;
  ASSERT_LT(samples.front().time, 0.0);
  EXPECT_NEAR(samples.front().force, 3.0, 1e-6);
}

TEST(SimulatedJitter, SettingsOutOfRangeAreRefused) {
  SimulatedHands hands = jitter_hands();
  hands.reaction = 1.5;
  EXPECT_THROW(SimulatedRig("jitter", subject_1, hands), std::invalid_argument);
  EXPECT_THROW(SimulatedRig("jitter", {}, jitter_hands()), std::invalid_argument);
  SimulatedRig rig("jitter", subject_1, jitter_hands());
  JitterSettings settings;
  settings.wall.stiffness = std::nan("");
  EXPECT_THROW(run_jitter(rig, settings), std::invalid_argument);
  settings = {};
  settings.touches = 0;
  EXPECT_THROW(run_jitter(rig, settings), std::invalid_argument);
}

TEST(PaperTables, HaveTheSamePairsOfForcesAndTimesOfWhole15Milliseconds) {
  for (std::size_t i = 0; i < paper::table_1.size(); ++i) {
    const paper::JitterCell& cell = paper::table_1[i];
    EXPECT_EQ(cell.background, paper::table_2[i].background);
    EXPECT_EQ(cell.interference, paper::table_2[i].interference);
    EXPECT_LE(cell.background, cell.interference);
    const double times = cell.adjustment_time / 0.015;
    EXPECT_NEAR(times, std::round(times), 1e-9);
  }
  EXPECT_FALSE(paper::jitter(4, 3));
  EXPECT_EQ(paper::jitter(2, 3)->amplitude, 1.6e-3);
  EXPECT_EQ(paper::deviation(3, 7)->deviation, 9.2e-3);
}

JitterSettings few() {
  JitterSettings settings;
  settings.touches = 1;
  return settings;
}

std::string all_words(const JitterStudy& study) {
  return fmt::format("{}\n", fmt::join(jitter_words(study), "\n"));
}

TEST(JitterReport, SaysWhatHoldsAndWhatIsNotReproduced) {
  const JitterStudy study = study_jitter(few(), jitter_hands(), std::vector<simulation::OperatorModel>(1));
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "Sizes are not reproduced");
  EXPECT_CONTAINS(words, "not clipped");
  EXPECT_CONTAINS(words, "15 ms");
  ASSERT_EQ(study.variations.size(), 2u);
  EXPECT_EQ(study.variations[0].verdict.amplitude_falls(), false);
  EXPECT_CONTAINS(words, "1 person, 1 touch each");
  EXPECT_CONTAINS(words,
                  "With a hand that does not stiffen Jit does not fall: in this model the trend is the");
  for (const auto& table : {jitter_table(study), jitter_claims_table(study), jitter_variations_table(study)})
    EXPECT_NO_THROW(report::require_rectangular(table));
  EXPECT_EQ(jitter_table(study).rows.size(), paper::table_1.size());
  EXPECT_EQ(jitter_claims_table(study).rows.size(), 6u);
}

TEST(JitterReport, WritesAPageWithItsPictures) {
  const host_tools_test::TemporaryFolder folder;
  const JitterStudy study = study_jitter(few(), jitter_hands(), std::vector<simulation::OperatorModel>(1));
  const auto files = write_jitter(study, {"2026-01-02", "kmax 9", "", {}, {}}, folder / "new", ".svg");
  EXPECT_CONTAINS(folder.read("new/jitter.md"), "Made on 2026-01-02 with kmax 9");
  EXPECT_EQ(files.size(), 6u);
  for (const auto& file : files) EXPECT_GT(std::filesystem::file_size(file), 100u) << file;
}

// All that was aborted or never touched has no numbers, and a page all the same.
TEST(JitterReport, APageOfADeviceWithoutResults) {
  const host_tools_test::TemporaryFolder folder;
  JitterStudy study;
  study.origin = report::Origin::measured;
  study.results = {mean_jitter(*paper::jitter(0, 5), {}), mean_jitter(*paper::jitter(3, 5), {})};
  study.results[0].aborted = 1;
  study.verdict = judge_jitter(study.results);
  EXPECT_CONTAINS(all_words(study), "Jit: not shown");
  EXPECT_CONTAINS(all_words(study), "AT: not shown");
  EXPECT_EQ(all_words(study).find("the work of F_I"), std::string::npos) << "of numbers that nobody has";
  EXPECT_EQ(jitter_table(study).rows[0][3], "-");
  for (const std::vector<std::string>& row : jitter_claims_table(study).rows) {
    EXPECT_EQ(row[2], "-");
    EXPECT_EQ(row[3], "-");
    EXPECT_EQ(row.back(), "not shown");
  }
  EXPECT_EQ(write_jitter(study, {}, folder / "new", ".svg").size(), 4u);
}

// A device that clips the force takes the trend away, and with it all that could be said of its cause.
TEST(JitterReport, WhereNothingFallsThereIsNoTrendWhoseCauseTheStiffeningIs) {
  SimulatedHands hands = jitter_hands();
  hands.device.force_limit = 1.0;
  const JitterStudy study = study_jitter(few(), hands, std::vector<simulation::OperatorModel>(1));
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "Jit: does not fall");
  EXPECT_CONTAINS(words, "no trend to explain");
  EXPECT_EQ(words.find("the trend is the stiffening"), std::string::npos) << words;
}

// A handle that was outside to the window's end has no adjustment time: neither one that falls nor one that
// does not.
TEST(JitterReport, TimesThatNobodyHasAreNotShownInEveryTable) {
  JitterStudy study;
  for (const paper::JitterCell& cell : paper::table_1) {
    JitterMeasure measure;
    measure.touched = true;
    measure.amplitude = cell.amplitude;
    measure.adjustment_time = cell.adjustment_time;
    study.results.push_back(mean_jitter(cell, {&measure, 1}));
  }
  study.verdict = judge_jitter(study.results);
  EXPECT_CONTAINS(all_words(study), "AT: not shown, since touches did not settle");
  const report::Table claims = jitter_claims_table(study);
  ASSERT_EQ(claims.rows.size(), 6u);
  for (std::size_t row = 0; row < 6; ++row)
    EXPECT_EQ(claims.rows[row].back(), row < 3 ? "yes" : "not shown") << row;
  EXPECT_EQ(jitter_variations_table(study).rows[0][1], "yes");
  EXPECT_EQ(jitter_variations_table(study).rows[0][2], "not shown");
}

TEST(JitterReport, APairThatNobodyTouchedHasNoNumberAmongTheCauses) {
  JitterStudy study;
  for (const paper::JitterCell& cell : paper::table_1) study.results.push_back(mean_jitter(cell, {}));
  study.verdict = judge_jitter(study.results);
  const std::vector<std::string> row = jitter_variations_table(study).rows[0];
  EXPECT_EQ(row[4], "- -> -");
  EXPECT_EQ(row[5], "- -> -");
}

}  // namespace kmax::experiment::jitter_experiment_test
