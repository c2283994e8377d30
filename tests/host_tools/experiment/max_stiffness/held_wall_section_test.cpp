#include "host_tools/experiment/max_stiffness/held_wall_section.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::held_wall_section_test {
namespace {

TEST(HeldWallSection, SaysWhatAgreesWithThePaper) {
  HeldWallResult wrong;
  wrong.condition = stiffness_conditions()[0];
  wrong.figure = "9";
  wrong.paper_stable = false;
  wrong.named = {15, 0, 0.1e-3};
  wrong.people = {{15, 0, 0.1e-3}, {15, 3, 0.5e-3}};
  HeldWallResult right = wrong;
  right.named = {15, 4, 1.25e-3};
  const report::Table table = held_wall_section(two_people(), {wrong, right}).tables.at(0);
  EXPECT_CONTAINS(table.caption, "15 touches");
  const std::vector<std::string> expected{"F_MC = 0 N", "9", "unstable", "0.10",     "stable",
                                          "no",         "1", "0.30",     "predicted"};
  EXPECT_EQ(table.rows[0], expected);
  EXPECT_EQ(table.rows[1][4], "unstable");
  EXPECT_EQ(table.rows[1][5], "yes");
  EXPECT_NO_THROW(report::require_rectangular(table));
}

}  // namespace
}  // namespace kmax::experiment::held_wall_section_test
