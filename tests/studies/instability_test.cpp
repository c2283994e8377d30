#include "tests/studies/instability.hpp"

#include <gtest/gtest.h>

namespace kmax::studies::instability_test {

using experiment::SubjectSet;

SubjectSet first_people(const char* name, std::size_t count) {
  SubjectSet set = experiment::open_subject_set(name);
  set.subjects.resize(count);
  return set;
}

// A part of what docs/instability_detector.md has of everybody.
TEST(InstabilityStudy, UnstableWallsAreFoundAndSoftenedToRest) {
  const auto results = watch_ratios({first_people("clipped", 3)}, {0.3, 2.0},
                                    {.approach_speeds = {0.1, 0.5}, .pushes = {0.6, 1.0}}, 2);
  const RatioResult& calm = results[0];
  EXPECT_EQ(calm.unstable, 0U);
  EXPECT_EQ(calm.stable, 3U * 8U * 4U);
  EXPECT_EQ(calm.alarms, 0U);
  const RatioResult& wild = results[1];
  EXPECT_GE(wild.steady, 40U);
  EXPECT_GE(wild.found_in_time * 100, wild.steady * 95) << wild.found_in_time << " of " << wild.steady;
  EXPECT_GE(wild.softened, wild.found_in_time);
  EXPECT_GE(wild.silenced * 100, wild.softened * 98) << wild.silenced << " of " << wild.softened;
  for (const double ending : wild.endings) EXPECT_LE(ending, 1.5);
  for (const double frequency : wild.frequencies) {
    EXPECT_GE(frequency, 20.0);
    EXPECT_LE(frequency, 400.0);
  }
}

TEST(InstabilityStudy, StableWallsAndRoughTouchesAreNotCalledUnstable) {
  const StableResult result =
      watch_stable({first_people("clipped", 12), first_people("unclipped", 12)}, 8, 50, 0.4, 2);
  EXPECT_EQ(result.alarms, 0U);
  EXPECT_GE(result.touches, 250U);
  EXPECT_EQ(result.throws, 8U * 5U);
}

}  // namespace kmax::studies::instability_test
