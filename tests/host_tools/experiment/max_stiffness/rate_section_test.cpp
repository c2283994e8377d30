#include "host_tools/experiment/max_stiffness/rate_section.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/max_stiffness/made_up_study.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::rate_section_test {
namespace {

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
}  // namespace kmax::experiment::rate_section_test
