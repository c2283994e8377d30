#include "tests/studies/wall_design.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host_tools/experiment/design/family_search.hpp"
#include "tests/host_tools/experiment/design/design_case.hpp"

namespace kmax::studies::wall_design_test {

using experiment::DesignTask;

/// A random device, touched seldom.
DesignTask quick_device(std::uint64_t seed) {
  DesignTask task = random_device(seed);
  const DesignTask quick = experiment::quick_task();
  task.set.subjects = quick.set.subjects;
  task.protocol = quick.protocol;
  task.rate = 500.0;
  return task;
}

/// Every wall of the grid from the first stiffness upwards, and nothing left out.
int plain_optimum(const DesignTask& task, const WallGrid& grid) {
  experiment::WallTrials trials(task);
  int best = -1;
  for (const experiment::WallFamily& family : experiment::families_of(task)) {
    for (const double damping : grid.dampings) {
      for (int rung = grid.first; !trials.first_not_held({family, damping, grid.stiffness(rung)});
           rung += grid.step)
        best = std::max(best, rung);
    }
  }
  return best;
}

TEST(WallGrid, ItsOptimumIsThatOfGoingThroughAllOfIt) {
  const DesignTask task = quick_device(1);
  for (const bool between : {false, true}) {
    const WallGrid grid{{0.0, 2.0, 8.0}, 162, 20, between};
    const int best = plain_optimum(task, grid);
    ASSERT_GT(best, 0);
    EXPECT_EQ(grid_optimum(task, grid, -1, {2}).rung, best);
    EXPECT_EQ(grid_optimum(task, grid, best - 1, {2}).rung, best);
    EXPECT_EQ(grid_optimum(task, grid, best, {2}).rung, -1) << "none above it";
  }
}

TEST(WallGrid, BetweenSharesNoWallWithTheDesignsLattice) {
  const DesignTask task = random_device(1);
  const WallGrid same = fine_grid(task, false), between = fine_grid(task, true);
  ASSERT_EQ(same.dampings.size(), between.dampings.size());
  const double half = std::pow(experiment::damping_ratio, -1.0 / 16.0);
  for (std::size_t n = 1; n < same.dampings.size(); ++n)
    EXPECT_NEAR(between.dampings[n] / same.dampings[n], half, 1e-9);
  EXPECT_EQ(same.stiffness(300), experiment::stiffness_of(300));
  EXPECT_NEAR(between.stiffness(300) / experiment::stiffness_of(300), std::sqrt(1.01), 1e-9);
}

TEST(WallGrid, ADesignIsHardlyBehindIt) {
  // Of the third device stiffer walls hold again beyond an island of instability, which the search must not
  // be led astray by.
  const DesignTask task = quick_device(3);
  const experiment::WallDesign design = experiment::design_wall(task, {2}, false);
  ASSERT_TRUE(design.found);
  WallGrid grid = fine_grid(task, true);
  // Each eighth of the dampings, but no stiffness left out: a coarser climb would step over the island.
  std::vector<double> fewer;
  for (std::size_t n = 0; n < grid.dampings.size(); n += 8) fewer.push_back(grid.dampings[n]);
  grid.dampings = std::move(fewer);
  const GridOptimum best = grid_optimum(task, grid, 0, {2});
  ASSERT_GE(best.rung, 0);
  EXPECT_GT(design.largest, 0.9 * grid.stiffness(best.rung));
  EXPECT_LT(design.touches, best.points * task.touches());
}

// By the touches that ended other walls alone, some of these would be unstable when softer.
TEST(WallDesign, HoldsForEverybodyOnRandomDevicesWhenItIsSofter) {
  for (const std::uint64_t seed : {3, 7}) {
    const DesignTask task = quick_device(seed);
    for (const experiment::WallFamily& family : experiment::families_of(task)) {
      const experiment::FamilyResult found = experiment::search_family(task, family, -1, {});
      experiment::WallTrials trials(task);
      for (const int rung : experiment::rungs_below(found.rung))
        EXPECT_FALSE(trials.first_not_held({family, found.damping, experiment::stiffness_of(rung)}))
            << seed << ' ' << name_of(family) << ' ' << rung;
    }
  }
}

}  // namespace kmax::studies::wall_design_test
