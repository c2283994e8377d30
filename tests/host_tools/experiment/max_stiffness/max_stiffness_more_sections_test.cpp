// The sections of max_stiffness_more_sections.cpp, which are declared in max_stiffness_sections.hpp.
#include <gtest/gtest.h>

#include "host_tools/experiment/max_stiffness/max_stiffness_sections.hpp"
#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment {
namespace {

SubjectSet two_people() {
  SubjectSet set;
  set.subjects = draw_subjects(2, 1);
  return set;
}

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

TEST(RateSection, HasOneTableForEachEncoderAndMeasureAndGapsWhereNothingWasRun) {
  RateResult known{{.rate = 1000.0, .count_length = 55e-6}, found_stiffness(7000.0)};
  RateResult beyond = known;
  beyond.setting.rate = 20e3;
  beyond.found.stiffness = 40e3;
  beyond.found.beyond_last = true;
  RateResult fine = known;
  fine.setting.count_length = 5.5e-6;
  fine.setting.measure = RateMeasure::feels;
  const report::Section section = rate_section({fine, known, beyond});
  ASSERT_EQ(section.tables.size(), 2U);
  // The coarse encoder comes first.
  EXPECT_CONTAINS(section.tables[0].caption, "55 um, unstable: moves by 3 counts");
  EXPECT_CONTAINS(section.tables[1].caption, "5.5 um, unstable: swings by 1 N");
  ASSERT_EQ(section.tables[0].rows.size(), 1U);
  const std::vector<double> rates = study_rates();
  for (std::size_t n = 0; n < rates.size(); ++n) {
    EXPECT_EQ(section.tables[0].rows[0][n + 1], rates[n] == 1000.0 ? "7"
                                                : rates[n] == 20e3 ? ">40"
                                                                   : "-")
        << rates[n];
  }
  for (const report::Table& table : section.tables) EXPECT_NO_THROW(report::require_rectangular(table));
}

}  // namespace
}  // namespace kmax::experiment
