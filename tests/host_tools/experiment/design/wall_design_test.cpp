#include "host_tools/experiment/design/wall_design.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/experiment/design/wall_design_report.hpp"
#include "tests/host_tools/experiment/design/design_case.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::wall_design_test {

using host_tools_test::thrown_message;

/// All that is said of it, and its file: equal only where every number is.
std::string all_of(const DesignTask& task, const WallDesign& design) {
  std::string text = wall_design_file(task, design);
  for (const std::string& words : wall_design_words(task, design)) text += words + "\n";
  return text;
}

TEST(DesignTask, NumbersEveryTouchOfEverybodyOnce) {
  const DesignTask task = quick_task(3);
  ASSERT_EQ(task.touches(), 6U);
  EXPECT_EQ(case_of(task, 0).person, 0U);
  EXPECT_EQ(case_of(task, 0).speed, 0.1);
  EXPECT_EQ(case_of(task, 5).person, 2U);
  EXPECT_EQ(case_of(task, 5).speed, 0.5);
}

TEST(DesignTask, LooksAtFieldsOnlyWhereOneIsAllowed) {
  DesignTask task = quick_task();
  const std::size_t without = families_of(task).size();
  for (const WallFamily& family : families_of(task)) EXPECT_EQ(family.coefficient, 0.0) << name_of(family);
  task.field = 1.0;
  const auto families = families_of(task);
  EXPECT_EQ(families.size(), 5 * without);
  for (const WallFamily& family : families) EXPECT_LE(family.coefficient, 1.0) << name_of(family);
}

TEST(DesignTask, LooksAtWallsThatGrowOnlyWhereTheyMay) {
  DesignTask task = quick_task();
  for (const WallFamily& family : families_of(task)) EXPECT_FALSE(family.grows()) << name_of(family);
  task.growth_time = 0.3;
  const auto families = families_of(task);
  const WallFamily& last = families.back();
  EXPECT_EQ(name_of(last), "grows from 40 %");
  const TouchSetup touch = touch_of(task, {last, 6.0, 10000.0}, case_of(task, 0));
  EXPECT_FLOAT_EQ(touch.wall.wall.growing.touch_stiffness, 4000.0F);
  EXPECT_FLOAT_EQ(touch.wall.wall.growing.growth_time, 0.3F);
  EXPECT_EQ(touch.wall.damping_window, 1);
  EXPECT_FALSE(families.front().grows());
  // As parameters they make the same wall.
  firmware::ParameterValues values;
  for (const device::Assignment& assignment : parameters_of(task, {last, 6.0, 10000.0}))
    values.set_raw(assignment.parameter.slot(), assignment.raw);
  const auto wall = firmware::wall_configuration<float>(values, 0);
  EXPECT_EQ(wall.growing.touch_stiffness, touch.wall.wall.growing.touch_stiffness);
  EXPECT_EQ(wall.growing.calm_velocity, touch.wall.wall.growing.calm_velocity);
}

TEST(DesignTask, SaysWhatIsNotAllowed) {
  const auto refused = [](const auto& change) {
    DesignTask task = quick_task();
    change(task);
    return thrown_message<std::invalid_argument>([&] { validate(task); });
  };
  EXPECT_CONTAINS(refused([](DesignTask& task) { task.field = 5.0; }),
                  "field of 5 N on a device that makes 3.3 N");
  EXPECT_CONTAINS(refused([](DesignTask& task) { task.growth_time = -1.0; }), "growth time of -1 s");
  EXPECT_CONTAINS(refused([](DesignTask& task) { task.margin = 1.0; }), "margin of 100 %");
  EXPECT_CONTAINS(refused([](DesignTask& task) { task.rate = 1.0; }), "loop of 1 Hz");
  EXPECT_CONTAINS(refused([](DesignTask& task) { task.set.subjects.clear(); }), "nobody touches");
  EXPECT_CONTAINS(refused([](DesignTask& task) { task.set.device.mass = -1.0; }), "device.mass = -1");
}

TEST(WallDesign, HoldsForEverybodyAndTheNextStifferOneDoesNot) {
  const DesignTask task = quick_task();
  const WallDesign design = design_wall(task, {2}, false);
  ASSERT_TRUE(design.found);
  ASSERT_TRUE(design.bound);
  WallTrials trials(task);
  DesignedWall largest = design.wall;
  largest.stiffness = design.largest;
  EXPECT_FALSE(trials.first_not_held(largest));
  EXPECT_FALSE(trials.first_not_held(design.wall));
  largest.stiffness = design.bound->stiffness;
  EXPECT_TRUE(trials.first_not_held(largest));
  EXPECT_LT(design.bound->stiffness, 1.05 * design.largest);
  EXPECT_NEAR(design.wall.stiffness, 0.8 * design.largest, 0.01 * design.largest);
  EXPECT_EQ(design.price.field_at_rest, 0.0);
  EXPECT_GT(design.price.depth, 0.0);
}

TEST(WallDesign, DoesNotDependOnTheThreads) {
  const DesignTask task = quick_task();
  const WallDesign one = design_wall(task, {1}), three = design_wall(task, {3});
  EXPECT_EQ(all_of(task, one), all_of(task, three));
  EXPECT_EQ(one.touches, three.touches);
  EXPECT_EQ(one.hard, three.hard);
}

TEST(WallDesign, IsTheSameFromShares) {
  const DesignTask task = quick_task();
  const host_tools_test::TemporaryFolder folder;
  std::vector<std::unique_ptr<RunJournal>> shares;
  std::vector<const RunJournal*> known;
  for (std::size_t part = 1; part <= 3; ++part) {
    shares.push_back(std::make_unique<RunJournal>(folder / std::to_string(part), design_settings(task),
                                                  RunJournal::Begin::fresh));
    known.push_back(shares.back().get());
    if (part == 3) {
      EXPECT_CONTAINS(thrown_message<JournalError>([&] { require_whole(task, known); }),
                      "in none of the shares");
    }
    search_share(task, {part, 3}, *shares.back(), {2});
  }
  require_whole(task, known);
  const WallDesign whole = design_wall(task, {2}), merged = design_wall(task, {2}, true, known);
  EXPECT_EQ(all_of(task, whole), all_of(task, merged));
}

TEST(WallDesign, LetsNobodyDeeperInThanAllowed) {
  DesignTask task = quick_task();
  const WallDesign free = design_wall(task, {2}, false);
  ASSERT_TRUE(free.found);
  task.depth = 1.1 * free.price.depth;
  const WallDesign limited = design_wall(task, {2}, false);
  ASSERT_TRUE(limited.found);
  EXPECT_LE(limited.price.depth, *task.depth);
  task.depth = 1e-6;
  const WallDesign none = design_wall(task, {2}, false);
  EXPECT_FALSE(none.found);
  // It is given up after the coarse search: three times as many touches here, and twenty times with the fine
  // one.
  EXPECT_LT(none.touches, 5 * free.touches);
  EXPECT_CONTAINS(wall_design_words(task, none).front(), "deeper in than 0.001 mm: the least found is");
}

TEST(WallDesign, HoldsForEverybodyWhenItIsSofter) {
  const DesignTask task = quick_task();
  const FamilyResult found = search_family(task, families_of(task).front(), -1, {});
  ASSERT_GE(found.rung, 0);
  const std::vector<int> rungs = rungs_below(found.rung);
  ASSERT_GT(rungs.size(), 30U);
  WallTrials trials(task);
  for (const int rung : rungs)
    EXPECT_FALSE(trials.first_not_held({families_of(task).front(), found.damping, stiffness_of(rung)}))
        << rung;
}

TEST(WallDesign, LooksAtRungsDownToATenth) {
  const std::vector<int> rungs = rungs_below(301);
  EXPECT_EQ(rungs.front(), 70);
  EXPECT_LE(stiffness_of(rungs.front()), 0.101 * stiffness_of(301));
  EXPECT_EQ(rungs.back(), 299);
  EXPECT_TRUE(std::is_sorted(rungs.begin(), rungs.end()));
  EXPECT_TRUE(rungs_below(0).empty());
  EXPECT_EQ(rungs_below(5), (std::vector<int>{1, 3}));
}

TEST(WallDesign, SaysThatNoneHolds) {
  const std::string words = fmt::format("{}", fmt::join(wall_design_words(quick_task(), WallDesign{}), " "));
  EXPECT_CONTAINS(words, "No wall of 20 N/m or more holds");
  EXPECT_CONTAINS(words, "--feels");
}

TEST(WallDesign, ItsFileIsTheWallAndSaysWhereItComesFrom) {
  const DesignTask task = quick_task();
  WallDesign design;
  design.found = true;
  design.wall = {{{control::VelocityEstimatorKind::low_pass, 16, 100.0F}, 1.0, 3e-3}, 8.0, 5500.0};
  design.largest = 7000.0;
  design.bound = DesignBound{{1, 0.5, 0.6}, {.by_force = true, .peak_to_peak = 1.5}, 7070.0};
  const std::string text = wall_design_file(task, design);
  EXPECT_CONTAINS(text, "# A wall by 'kmax design wall'");
  EXPECT_CONTAINS(text, "drawn 2 at 0.5 m/s with a push of 0.6 N");
  EXPECT_CONTAINS(text, "the force swings by 1.5 N");
  design.bound->ending = {.rendered_share = 0.6, .softer = true};
  EXPECT_CONTAINS(wall_design_file(task, design), "the wall comes to 60 % of that and no more");
  EXPECT_CONTAINS(text, "stiffness = 5500");
  EXPECT_CONTAINS(text, "estimator = \"low_pass\"");
  EXPECT_CONTAINS(text, "magnetic_length = 0.003");
  EXPECT_CONTAINS(text, "rate = 500");
}

}  // namespace kmax::experiment::wall_design_test
