#include "host_tools/experiment/deviation/deviation_experiment.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::deviation_experiment_test {

DeviationProtocol quick() {
  DeviationProtocol protocol;
  protocol.pulses = 2;
  return protocol;
}

TEST(DeviationProtocol, PulsesFollowARestInEachHalf) {
  const DeviationProtocol protocol;  // 1.5 s, five pulses of a second each
  EXPECT_DOUBLE_EQ(protocol.onset(), 6.5);
  EXPECT_DOUBLE_EQ(protocol.duration(), 13.0);
  EXPECT_DOUBLE_EQ(protocol.pulse_begin(0), 1.5);
  EXPECT_DOUBLE_EQ(protocol.pulse_begin(4), 5.5);
  EXPECT_DOUBLE_EQ(protocol.pulse_begin(5), 8.0);
  EXPECT_DOUBLE_EQ(protocol.pulse_begin(9), 12.0);
}

TEST(MeasureDeviation, TakesEachPulseFromWhereItBegan) {
  std::vector<RigSample> samples;
  for (int i = 0; i < 400; ++i) {
    const double time = 0.01 * i;
    double position = 0.005;  // an offset that must not count
    if (time >= 1.0 && time < 1.5) position += 0.010;
    if (time >= 3.0 && time < 3.5) position -= 0.004;
    samples.push_back({time, 0.0, 0.0, position, 0.0});
  }
  const DeviationMeasure measure = measure_deviation(samples, std::vector<double>{0.985, 2.985}, 0.5);
  EXPECT_NEAR(measure.without, 0.010, 1e-12);
  EXPECT_NEAR(measure.with, 0.004, 1e-12);
  EXPECT_EQ(measure.pulses, 2u);
}

TEST(MeasureDeviation, PulsesThatWereNotRecordedAreNotCounted) {
  const std::vector<RigSample> samples{{}, {0.1, 0.0, 0.0, 0.002, 0.0}};
  const DeviationMeasure measure = measure_deviation(samples, std::vector<double>{0.0, 5.0}, 0.5);
  EXPECT_EQ(measure.pulses, 1u);
  EXPECT_DOUBLE_EQ(measure.without, 0.002);
  EXPECT_EQ(measure.with, 0.0);
  EXPECT_EQ(measure_deviation({}, std::vector<double>{0.0}, 0.5).pulses, 0u);
}

std::vector<DeviationResult> as_printed() {
  std::vector<DeviationResult> results;
  for (const paper::DeviationCell& cell : paper::table_2) {
    DeviationTouch touch;
    touch.measure.with = cell.deviation;
    touch.measure.pulses = 10;
    results.push_back(mean_deviation(cell, {&touch, 1}));
  }
  return results;
}

TEST(JudgeDeviation, ThePapersOwnTableMeetsItsClaim) {
  const DeviationVerdict verdict = judge_deviation(as_printed());
  EXPECT_EQ(verdict.claim_met(), true);
  EXPECT_DOUBLE_EQ(verdict.rank.value(), 1.0);
  ASSERT_EQ(verdict.trends.size(), 3u);
  for (const BackgroundTrend& trend : verdict.trends) EXPECT_DOUBLE_EQ(trend.rank.value(), -1.0);
}

TEST(JudgeDeviation, ANumberThatStaysDoesNotFall) {
  std::vector<DeviationResult> results = as_printed();
  for (DeviationResult& result : results) result.deviation = 5e-3;
  EXPECT_EQ(judge_deviation(results).claim_met(), false);
}

TEST(JudgeDeviation, WhatNobodyTouchedIsNotShownAndLeavesThePapersNumbersAlone) {
  std::vector<DeviationResult> results = as_printed();
  for (DeviationResult& result : results) result.touches = 0;
  for (const DeviationVerdict& verdict : {judge_deviation(results), judge_deviation({})}) {
    EXPECT_EQ(verdict.claim_met(), std::nullopt);
    ASSERT_EQ(verdict.trends.size(), 3u);
    for (const BackgroundTrend& trend : verdict.trends) {
      EXPECT_EQ(trend.without, std::nullopt);
      EXPECT_EQ(trend.with, std::nullopt);
    }
  }
  const std::vector<BackgroundTrend> printed = printed_deviation_trends();
  ASSERT_EQ(printed.size(), 3u);
  EXPECT_EQ(printed[0].interference, 3.0);
  EXPECT_EQ(printed[0].without, 1.40e-3);
  EXPECT_EQ(printed[0].with, 0.68e-3);
  EXPECT_EQ(printed[2].without, 16.6e-3);
  EXPECT_EQ(printed[2].with, 7.8e-3);
  EXPECT_EQ(all_fall(printed), true);
}

std::vector<DeviationResult> simulated(const simulation::OperatorModel& person) {
  SimulatedRig rig("deviation", {person}, deviation_hands());
  return run_deviation(rig, {quick()}).results;
}

RigTouch touch_of(const DeviationProtocol& protocol, double background, double interference,
                  const simulation::OperatorModel& person = {}) {
  SimulatedRig rig("deviation", {person}, deviation_hands());
  rig.set({protocol.stiffness, protocol.haptic_rate, control::InterferenceMode::parallel});
  return rig.record(deviation_plan(protocol, {background, interference, 0.0}));
}

TEST(SimulatedDeviation, FallsWithTheBackgroundForceAndContactIsKept) {
  const std::vector<DeviationResult> results = simulated({});
  EXPECT_EQ(judge_deviation(results).claim_met(), true);
  for (const DeviationResult& result : results) {
    EXPECT_GT(result.contact_share, 0.99);
    if (result.paper.background > 0.0) {
      EXPECT_LT(result.deviation, result.before);
    }
  }
}

// The point of the experiment: it is the stiffening that makes the trend.
TEST(SimulatedDeviation, AHandThatDoesNotStiffenShowsNoTrend) {
  simulation::OperatorModel person;
  person.activation_gain = 0.0;
  const DeviationVerdict verdict = judge_deviation(simulated(person));
  EXPECT_EQ(verdict.claim_met(), false);
  for (const BackgroundTrend& trend : verdict.trends)
    EXPECT_NEAR(trend.with.value() / trend.without.value(), 1.0, 0.01);
}

// A hand at rest gives way by F/k; k1 and k2 in series, less the friction.
TEST(SimulatedDeviation, ALongPulseMovesTheHandAsFarAsItsSpringsSay) {
  DeviationProtocol protocol = quick();
  protocol.pulse_on = protocol.pulse_off = 3.0;
  simulation::OperatorModel person;
  person.activation_gain = 0.0;
  const auto deviation = [&](double interference) {
    const RigTouch touch = touch_of(protocol, 0.0, interference, person);
    const std::vector<double> begins{protocol.pulse_begin(0) - 0.001, protocol.pulse_begin(2) - 0.001};
    return measure_deviation(touch.samples, begins, protocol.pulse_on).without;
  };
  const double stiffness = simulation::series_stiffness(simulation::OperatorModel{});
  EXPECT_NEAR(deviation(3.0), 3.0 / stiffness, deviation_hands().device.friction / stiffness + 1e-4);
  // One who stiffens does so for the force along the surface too: the hand is the same.
  person.activation_gain = simulation::OperatorModel{}.activation_gain;
  EXPECT_LT(deviation(3.0), 0.8 * 3.0 / stiffness);
}

TEST(SimulatedDeviation, TheForceAlongTheSurfaceComesInPulses) {
  for (const RigSample& sample : touch_of(quick(), 3.0, 5.0).samples) {
    bool on = false;
    for (int pulse = 0; pulse < 4; ++pulse) {
      const double since = sample.time - quick().pulse_begin(pulse);
      on = on || (since >= -1e-9 && since < 0.5 - 1e-9);
    }
    ASSERT_EQ(sample.tangential_force, on ? 5.0 : 0.0) << sample.time;
  }
}

TEST(SimulatedDeviation, SettingsOutOfRangeAreRefused) {
  SimulatedRig rig("deviation", {simulation::OperatorModel{}}, deviation_hands());
  DeviationSettings settings;
  settings.protocol.pulse_on = std::nan("");
  EXPECT_THROW(run_deviation(rig, settings), std::invalid_argument);
}

using host_tools_test::thrown_message;

DeviationSettings few() {
  DeviationSettings settings;
  settings.protocol.pulses = 1;
  return settings;
}

std::string all_words(const DeviationStudy& study) {
  return fmt::format("{}\n", fmt::join(deviation_words(study), "\n"));
}

TEST(DeviationReport, SaysWhatHoldsAndWhatTheTableDoesNotTell) {
  const DeviationStudy study =
      study_deviation(few(), deviation_hands(), std::vector<simulation::OperatorModel>(1));
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "Here it falls at every F_I");
  EXPECT_CONTAINS(words, "With a hand that does not stiffen it does not fall");
  EXPECT_CONTAINS(words, "hardly identifies a stiffness gain");
  EXPECT_CONTAINS(words, "Sizes are not reproduced");
  for (const auto& table :
       {deviation_table(study), deviation_claims_table(study), deviation_fit_table(study)})
    EXPECT_NO_THROW(report::require_rectangular(table));
  EXPECT_EQ(deviation_table(study).rows.size(), paper::table_2.size());
  EXPECT_EQ(deviation_claims_table(study).rows.size(), 9u);
  EXPECT_EQ(deviation_fit_table(study).rows.size(), 4u);
}

TEST(DeviationReport, WritesAPageWithItsPictures) {
  const host_tools_test::TemporaryFolder folder;
  const DeviationStudy study =
      study_deviation(few(), deviation_hands(), std::vector<simulation::OperatorModel>(1));
  const auto files = write_deviation(study, {"2026-01-02", "kmax 9", "", {}, {}}, folder / "new", ".svg");
  EXPECT_CONTAINS(folder.read("new/deviation.md"), "Made on 2026-01-02 with kmax 9");
  EXPECT_EQ(files.size(), 6u);
  for (const auto& file : files) EXPECT_GT(std::filesystem::file_size(file), 100u) << file;
}

TEST(DeviationReport, APageOfADeviceWithoutResults) {
  const host_tools_test::TemporaryFolder folder;
  DeviationStudy study;
  study.origin = report::Origin::measured;
  study.results = {mean_deviation(*paper::deviation(0, 5), {}), mean_deviation(*paper::deviation(3, 5), {})};
  study.verdict = judge_deviation(study.results);
  study.fits = fit_table_2();
  EXPECT_NO_THROW(report::require_rectangular(deviation_table(study)));
  EXPECT_EQ(write_deviation(study, {}, folder / "new", ".svg").size(), 5u);
  const std::string words = all_words(study);
  EXPECT_CONTAINS(words, "this is not shown");
  EXPECT_EQ(words.find("does not fall"), std::string::npos) << words;
  EXPECT_EQ(words.find("the work of F_I"), std::string::npos) << "of numbers that nobody has";
  const report::Table claims = deviation_claims_table(study);
  ASSERT_EQ(claims.rows.size(), 6u);
  using Row = std::vector<std::string>;
  EXPECT_EQ(claims.rows[0], (Row{"measured", "3", "-", "-", "-", "-", "not shown"}));
  EXPECT_EQ(claims.rows[3], (Row{"paper", "3", "1.40", "0.68", "0.49", "-", "yes"}));
  EXPECT_EQ(claims.rows[5], (Row{"paper", "7", "16.60", "7.80", "0.47", "-", "yes"}));
}

// The numbers of another pair of forces in its place would be taken for those without F_B.
TEST(DeviationReport, WithoutTheTouchWithoutABackgroundForceNothingIsShown) {
  DeviationStudy study;
  study.origin = report::Origin::measured;
  for (const paper::DeviationCell& cell : paper::table_2) {
    DeviationResult result = mean_deviation(cell, {});
    result.deviation = cell.deviation;
    result.touches = cell.background > 0.0 ? 1 : 0;
    study.results.push_back(result);
  }
  study.verdict = judge_deviation(study.results);
  using Row = std::vector<std::string>;
  EXPECT_EQ(deviation_claims_table(study).rows[1],
            (Row{"measured", "5", "-", "2.40", "-", "-1.00", "not shown"}));
  EXPECT_CONTAINS(all_words(study), "this is not shown");
}

TEST(DeviationReport, TheStiffeningIsTheCauseOnlyIfNothingElseIs) {
  const auto words_when = [](bool falls, bool falls_without) {
    const auto results = [](bool fall) {
      std::vector<DeviationResult> cells;
      for (const paper::DeviationCell& cell : paper::table_2) {
        DeviationResult result = mean_deviation(cell, {});
        result.touches = 1;
        const double share = fall ? 1.0 / (1.0 + cell.background) : 1.0 + cell.background;
        result.deviation = 1e-3 * cell.interference * share;
        cells.push_back(result);
      }
      return cells;
    };
    DeviationStudy study;
    study.results = results(falls);
    study.verdict = judge_deviation(study.results);
    study.without_stiffening = results(falls_without);
    study.verdict_without_stiffening = judge_deviation(study.without_stiffening);
    return all_words(study);
  };
  const char* cause = "the stiffening and nothing else";
  EXPECT_CONTAINS(words_when(true, false), cause);
  for (const auto& [falls, without] :
       {std::pair{true, true}, std::pair{false, true}, std::pair{false, false}})
    EXPECT_EQ(words_when(falls, without).find(cause), std::string::npos) << falls << without;
  EXPECT_CONTAINS(words_when(true, true), "something else than the stiffening makes the trend");
  EXPECT_CONTAINS(words_when(false, false), "no trend to explain");
}

TEST(DeviationReport, APushThatLosesTheWallIsRefused) {
  SimulatedHands hands = deviation_hands();
  hands.push = 3.0;
  EXPECT_CONTAINS(thrown_message<std::invalid_argument>(
                      [&] { study_deviation({}, hands, std::vector<simulation::OperatorModel>(1)); }),
                  "push harder than every F_B");
}

// People who do not stiffen are their own comparison.
TEST(DeviationReport, PeopleWhoDoNotStiffenShowNoWorkOfStiffening) {
  std::vector<simulation::OperatorModel> people(1);
  people[0].activation_gain = 0.0;
  const std::string words = all_words(study_deviation(few(), deviation_hands(), people));
  EXPECT_EQ(words.find("nothing else"), std::string::npos) << words;
}

}  // namespace kmax::experiment::deviation_experiment_test
