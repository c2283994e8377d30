#include "host_tools/experiment/max_stiffness/adaptive_gap_section.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::adaptive_gap_section_test {
namespace {

ApproachResult approach(double speed, double best) {
  return {speed, 9000.0, {best - 500.0, best, best - 100.0}, 7000.0, 1.3};
}

TEST(AdaptiveGapSection, TheWordsFollowTheNumbers) {
  const NeededCoefficient met{1.9, 8000.0, 1.1};
  const NeededCoefficient missed{4.0, 6000.0, 3.2};
  const report::Section slow_helps =
      adaptive_gap_section(two_people(), {approach(0.05, 8300.0), approach(0.5, 5000.0)}, met);
  EXPECT_CONTAINS(slow_helps.heading, "8.02 N/mm");
  EXPECT_CONTAINS(paragraphs_of(slow_helps), "a constant F_MC of 1.90 N gives 8.00 N/mm");
  EXPECT_CONTAINS(paragraphs_of(slow_helps), "approach of 1.10 m/s");
  EXPECT_CONTAINS(paragraphs_of(slow_helps), "at 0.05 m/s alone the best mode reaches 8.30 N/mm");
  EXPECT_CONTAINS(paragraphs_of(slow_helps), "--study assumptions");
  EXPECT_EQ(slow_helps.tables[0].rows[0],
            (std::vector<std::string>{"0.05", "9.00", "7.80", "8.30", "8.20", "7.00", "1.30"}));
  const std::string neither = paragraphs_of(
      adaptive_gap_section(two_people(), {approach(0.05, 5000.0), approach(0.5, 5000.0)}, missed));
  EXPECT_EQ(neither.find("as the law is printed"), std::string::npos) << neither;
  EXPECT_EQ(neither.find("The other way"), std::string::npos) << neither;
  EXPECT_CONTAINS(neither, "gives 6.00 N/mm, the nearest to 8.02 N/mm");
  EXPECT_CONTAINS(neither, "is no way");
}

TEST(AdaptiveGapSection, MarksMeansThatHoldBounds) {
  ApproachResult slow = approach(0.05, 8300.0);
  slow.constant_ends = {1, 0};
  slow.by_mode_ends = {{}, {0, 2}, {}};
  slow.held_ends = {0, 1};
  const report::Section section = adaptive_gap_section(two_people(), {slow}, {});
  EXPECT_EQ(section.tables[0].rows[0],
            (std::vector<std::string>{"0.05", "<9.00", "7.80", ">8.30", "8.20", ">7.00", "1.30"}));
  EXPECT_CONTAINS(paragraphs_of(section), "constant 2 N at 0.05 m/s: 1 of 2");
  EXPECT_CONTAINS(paragraphs_of(section),
                  "latched at 0.05 m/s: 2 of 2; held for the whole touch at 0.05 m/s: 1 of 2");
}

}  // namespace
}  // namespace kmax::experiment::adaptive_gap_section_test
