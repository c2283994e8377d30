#include "host_tools/experiment/resolution/resolution_experiment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace kmax::experiment::resolution_experiment_test {
namespace {

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

}  // namespace
}  // namespace kmax::experiment::resolution_experiment_test
