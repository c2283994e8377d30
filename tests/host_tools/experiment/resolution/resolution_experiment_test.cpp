#include "host_tools/experiment/resolution/resolution_experiment.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::resolution_experiment_test {

ResolutionCell cell(double resolution, double speed, bool vibrates) {
  ResolutionCell made;
  made.resolution = resolution;
  made.speed = speed;
  made.touches = made.people = 1;
  made.unstable = made.people_unstable = vibrates ? 1 : 0;
  return made;
}

std::vector<ResolutionCell> as_claimed() {
  std::vector<ResolutionCell> cells;
  for (const double speed : {0.05, 0.09, 0.11, 0.3}) {
    cells.push_back(cell(0.4e-3, speed, true));
    cells.push_back(cell(0.1e-3, speed, speed > 0.1));
  }
  return cells;
}

TEST(JudgeResolution, WhatThePaperClaimsMeetsTheClaim) {
  const ResolutionVerdict verdict = judge_resolution(as_claimed());
  EXPECT_EQ(verdict.claim_met(), true);
  EXPECT_FALSE(verdict.onset_from_resolution);  // the encoder's own step was not run
  EXPECT_EQ(onset_speed(as_claimed(), 0.1e-3), 0.11);
  EXPECT_EQ(onset_speed(as_claimed(), 0.4e-3), 0.05);
}

TEST(JudgeResolution, EachCellThatDiffersBreaksIt) {
  for (std::size_t i = 0; i < as_claimed().size(); ++i) {
    auto cells = as_claimed();
    cells[i].people_unstable = cells[i].unstable = 1 - cells[i].unstable;
    EXPECT_EQ(judge_resolution(cells).claim_met(), false) << i;
  }
}

TEST(JudgeResolution, WhatWasNotTriedIsNotTested) {
  auto untouched = as_claimed();
  for (ResolutionCell& one : untouched) one.without_contact = one.touches;
  for (const ResolutionVerdict& verdict : {judge_resolution({}), judge_resolution(untouched)}) {
    EXPECT_EQ(verdict.coarse_vibrates, std::nullopt);
    EXPECT_EQ(verdict.fine_is_still, std::nullopt);
    EXPECT_EQ(verdict.fine_vibrates_fast, std::nullopt);
    EXPECT_EQ(verdict.claim_met(), std::nullopt);
    EXPECT_FALSE(verdict.all_tested());
  }
}

TEST(JudgeResolution, SpeedsOnOneSideOfTheOnsetTestOneHalf) {
  auto slow = as_claimed(), fast = as_claimed();
  std::erase_if(slow, [](const ResolutionCell& one) { return one.speed > 0.1; });
  std::erase_if(fast, [](const ResolutionCell& one) { return one.speed < 0.1; });
  EXPECT_EQ(judge_resolution(slow).fine_is_still, true);
  EXPECT_EQ(judge_resolution(slow).fine_vibrates_fast, std::nullopt);
  EXPECT_EQ(judge_resolution(slow).claim_met(), std::nullopt);
  EXPECT_EQ(judge_resolution(fast).fine_is_still, std::nullopt);
  EXPECT_EQ(judge_resolution(fast).fine_vibrates_fast, true);
  EXPECT_EQ(judge_resolution(fast).claim_met(), std::nullopt);
  // What was tested and does not hold is enough for a no.
  for (ResolutionCell& one : slow) one.unstable = one.people_unstable = 0;
  EXPECT_EQ(judge_resolution(slow).claim_met(), false);
  EXPECT_FALSE(judge_resolution(slow).all_tested());
}

TEST(JudgeResolution, TheEncodersOwnStepIsTheControl) {
  auto cells = as_claimed();
  cells.push_back(cell(0.0, 0.3, true));
  EXPECT_EQ(judge_resolution(cells).onset_from_resolution, false);
  cells.push_back(cell(0.0, 0.11, false));
  EXPECT_EQ(judge_resolution(cells).onset_from_resolution, true);
}

TEST(OnsetSpeed, NeedsTheFastestToVibrate) {
  const std::vector<ResolutionCell> cells{cell(0, 0.1, true), cell(0, 0.2, false), cell(0, 0.3, true),
                                          cell(0, 0.4, true)};
  EXPECT_EQ(onset_speed(cells, 0), 0.3);
  EXPECT_FALSE(onset_speed(std::span(cells).first(2), 0));
  EXPECT_FALSE(onset_speed({}, 0));
}

TEST(ResolutionCell, HalfThePeopleDecide) {
  ResolutionCell one;
  EXPECT_FALSE(one.vibrates());
  one.people = 12;
  one.people_unstable = 5;
  EXPECT_FALSE(one.vibrates());
  one.people_unstable = 6;
  EXPECT_TRUE(one.vibrates());
}

const std::vector<simulation::OperatorModel> subject_1(1);

ResolutionSettings one_touch(double resolution, double speed) {
  ResolutionSettings settings;
  settings.resolutions = {resolution};
  settings.speeds = {speed};
  return settings;
}

TEST(SimulatedRig, StepsAreWholeCounts) {
  SimulatedRig rig = rig_with({}, subject_1, resolution_hands());
  for (const auto& [resolution, counts] : {std::pair(0.0, 1), {0.1e-3, 4}, {0.4e-3, 17}}) {
    rig.set(rig_wall({}, resolution));
    EXPECT_DOUBLE_EQ(rig.resolution_step(), counts * 0.023e-3);
  }
}

// The null result: at no step and no speed.
TEST(SimulatedResolution, WithAFullGripAndNoDelayNothingVibrates) {
  SimulatedRig rig = rig_with({}, subject_1, resolution_hands());
  ResolutionSettings settings;
  settings.speeds = {0.02, 0.1, 0.5};
  for (const ResolutionCell& cell : run_resolution(rig, settings).cells)
    EXPECT_EQ(cell.unstable, 0u) << cell.resolution << " " << cell.speed;
}

TEST(SimulatedResolution, WithAWeakGripAndADelayBothClaimsAppear) {
  const auto runs = run_hands({}, weak_hand, resolution_hands(), subject_1);
  ASSERT_EQ(runs.size(), 4u);
  EXPECT_EQ(judge_resolution(runs.back().cells).claim_met(), true);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(judge_resolution(runs[i].cells).claim_met(), false) << i;
  // And yet the speed's part of them is none of the resolution's.
  EXPECT_EQ(judge_resolution(runs.back().cells).onset_from_resolution, false);
}

TEST(SimulatedResolution, TheCriterionStandsBesideIt) {
  SimulatedRig rig = rig_with({}, subject_1, resolution_hands());
  EXPECT_NEAR(run_resolution(rig, one_touch(0.4e-3, 0.02)).cells.at(0).force_step, 1200 * 17 * 0.023e-3,
              1e-9);
  EXPECT_NEAR(run_resolution(rig, one_touch(0.1e-3, 0.5)).cells.at(0).force_step, 1200 * 0.5e-3, 1e-9);
}

TEST(SimulatedResolution, SettingsOutOfRangeAreRefused) {
  EXPECT_THROW(rig_with({0.0, 0.0}, subject_1, resolution_hands()), std::invalid_argument);
  EXPECT_THROW(rig_with({1.0, std::nan("")}, subject_1, resolution_hands()), std::invalid_argument);
  EXPECT_THROW(rig_with({}, {}, resolution_hands()), std::invalid_argument);
  SimulatedRig rig = rig_with({}, subject_1, resolution_hands());
  ResolutionSettings settings;
  settings.pushes.clear();
  EXPECT_THROW(run_resolution(rig, settings), std::invalid_argument);
}

TEST(VaryResolution, EveryVariationDiffersFromTheSettings) {
  ResolutionSettings settings = one_touch(0.4e-3, 0.1);
  settings.touches = 1;
  ResolutionHand weak = weak_hand;
  const auto named = [&](const std::string& change) {
    const auto variations = vary_resolution(settings, weak, resolution_hands(), subject_1);
    return std::count_if(variations.begin(), variations.end(),
                         [&](const ResolutionVariation& one) { return one.change == change; });
  };
  EXPECT_EQ(vary_resolution(settings, weak, resolution_hands(), subject_1).size(), 14u);
  EXPECT_EQ(named("grip x 0.25"), 0);
  EXPECT_EQ(named("grip x 0.3"), 1);
  weak = {0.3, 1e-3};
  EXPECT_EQ(named("grip x 0.25"), 1);
  EXPECT_EQ(named("grip x 0.3"), 0);
  EXPECT_EQ(named("delay 1 ms"), 0);
}

ResolutionStudy study_of(const ResolutionSettings& settings) {
  return study_resolution(settings, weak_hand, resolution_hands(), std::vector<simulation::OperatorModel>(1));
}

ResolutionSettings few() {
  ResolutionSettings settings;
  settings.speeds = {0.05, 0.2};
  settings.touches = 1;
  return settings;
}

std::string all_words(const ResolutionStudy& study) {
  return fmt::format("{}\n", fmt::join(resolution_words(study), "\n"));
}

TEST(ResolutionReport, SaysWhatHoldsAndWhatDoesNot) {
  const ResolutionStudy study = study_of(few());
  const std::string all = all_words(study);
  EXPECT_CONTAINS(all, "1 person, 1 touch with each push");
  EXPECT_EQ(all.find("Not tested"), std::string::npos) << all;
  EXPECT_CONTAINS(all, "With a full grip and no delay nothing vibrates");
  EXPECT_CONTAINS(all, "both claims appear");
  EXPECT_CONTAINS(all, "calibrated, not predicted");
  EXPECT_CONTAINS(all, "not the work of the resolution");
  EXPECT_NO_THROW(report::require_rectangular(resolution_table(study)));
  EXPECT_NO_THROW(report::require_rectangular(resolution_claims_table(study)));
  EXPECT_EQ(resolution_table(study).rows.size(), 6u);
  EXPECT_GT(resolution_variations_table(study).rows.size(), 10u);
}

TEST(ResolutionReport, NumbersOfTheUsersWereNotChosenToAgree) {
  const auto study_with = [](const ResolutionHand& hand, double stiffness) {
    ResolutionSettings settings = few();
    settings.wall.stiffness = stiffness;
    return study_resolution(settings, hand, resolution_hands(), std::vector<simulation::OperatorModel>(1));
  };
  const auto asked_for = study_with({0.2, 0.5e-3}, paper::resolution_stiffness);
  EXPECT_CONTAINS(all_words(asked_for), "both claims appear. Hand and wall are as asked for");
  EXPECT_EQ(asked_for.origin, report::Origin::predicted);
  EXPECT_EQ(study_of(few()).origin, report::Origin::calibrated);
  for (const ResolutionStudy& study : {asked_for, study_with(weak_hand, 1250.0)})
    EXPECT_EQ(all_words(study).find("chosen so"), std::string::npos) << all_words(study);
}

TEST(ResolutionReport, WritesAPageWithItsPictures) {
  const host_tools_test::TemporaryFolder folder;
  const ResolutionStudy study = study_of(few());
  const auto files = write_resolution(study, {"2026-01-02", "kmax 9", "", {}, {}}, folder / "new", ".svg");
  EXPECT_CONTAINS(folder.read("new/resolution.md"), "Made on 2026-01-02 with kmax 9");
  EXPECT_EQ(files.size(), 6u);
  for (const auto& file : files) EXPECT_GT(std::filesystem::file_size(file), 100u) << file;
}

TEST(ResolutionReport, ADevicesTouchesNeedNoSimulation) {
  const host_tools_test::TemporaryFolder folder;
  ResolutionStudy study;
  study.origin = report::Origin::measured;
  ResolutionCell cell;
  cell.resolution = 0.4e-3;
  cell.touches = cell.people = cell.unstable = cell.people_unstable = 1;
  cell.speed = 0.1;
  cell.peak_to_peak = 1e-3;
  study.runs = {{{}, {cell}}};
  EXPECT_EQ(resolution_table(study).rows.size(), 1u);
  EXPECT_EQ(write_resolution(study, {}, folder / "new", ".svg").size(), 5u);
  EXPECT_CONTAINS(resolution_words(study)[1], "the paper's claims are not all tested");
  EXPECT_CONTAINS(all_words(study), "for want of a touch there: 0.1 mm below 0.1 m/s, 0.1 mm above 0.1 m/s.");
  study.runs[0].cells[0].unstable = study.runs[0].cells[0].people_unstable = 0;
  EXPECT_CONTAINS(resolution_words(study)[1], "not met");
}

// With one speed only half of the second claim can be seen, and no other setting shows more of it.
TEST(ResolutionReport, WhatNoTouchTestedIsNeitherYesNorNo) {
  for (const double speed : {0.05, 0.2}) {
    ResolutionSettings settings = few();
    settings.speeds = {speed};
    const bool slow = speed < paper::vibration_onset_speed;
    const ResolutionStudy study = study_of(settings);
    const report::Table claims = resolution_claims_table(study), changed = resolution_variations_table(study);
    const std::size_t untested = slow ? 3 : 2, tested = slow ? 2 : 3;
    for (std::size_t run = 0; run < study.runs.size(); ++run) {
      EXPECT_EQ(claims.rows[run][untested], "not tested") << speed << " " << run;
      EXPECT_NE(claims.rows[run][tested], "not tested") << speed << " " << run;
    }
    for (const std::vector<std::string>& row : changed.rows) {
      EXPECT_EQ(row[untested], "not tested") << row[0];
      EXPECT_NE(row[4], "yes") << row[0];
    }
    const std::string all = all_words(study);
    EXPECT_CONTAINS(all, "the two claims were not both tested");
    EXPECT_CONTAINS(all, slow ? "for want of a touch there: 0.1 mm above 0.1 m/s."
                              : "for want of a touch there: 0.1 mm below 0.1 m/s.");
    EXPECT_EQ(all.find("both claims appear in"), std::string::npos) << all;
  }
}

}  // namespace kmax::experiment::resolution_experiment_test
