#include "host_tools/experiment/progress_report.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace kmax::experiment::progress_report_test {
namespace {

using Told = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(PartOf, PartsFollowEachOtherUpToTheWhole) {
  Told told;
  const ProgressReport whole = [&](std::size_t done, std::size_t count) { told.emplace_back(done, count); };
  const ProgressReport first = part_of(whole, 0, 1, 4), rest = part_of(whole, 1, 3, 4);
  for (std::size_t done = 0; done <= 2; ++done) first(done, 2);
  for (std::size_t done = 0; done <= 2; ++done) rest(done, 2);
  EXPECT_EQ(told, (Told{{0, 8}, {1, 8}, {2, 8}, {2, 8}, {5, 8}, {8, 8}}));
}

TEST(PartOf, NobodyNeedsToBeTold) {
  const ProgressReport nobody;
  EXPECT_NO_THROW(part_of(nobody, 0, 1, 2)(1, 2));
}

}  // namespace
}  // namespace kmax::experiment::progress_report_test
