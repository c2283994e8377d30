#include "host_tools/experiment/max_stiffness/update_rate_study.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>

#include "tests/host_tools/experiment/max_stiffness/quick_study.hpp"

namespace kmax::experiment::update_rate_study_test {
namespace {

TEST(UpdateRateStudy, AFasterLoopRendersAStifferWallAndADelayEatsIt) {
  RateStudySettings settings;
  settings.run = quick_run();
  const auto results =
      run_rate_study({{.rate = 500.0}, {.rate = 1000.0}, {.rate = 1000.0, .delay = 0.5e-3}}, settings);
  EXPECT_GT(results[1].found.stiffness, 1.5 * results[0].found.stiffness);
  EXPECT_LT(results[2].found.stiffness, 0.7 * results[1].found.stiffness);
  // One count of 55 um is 1 N at 18 N/mm.
  const auto felt = run_rate_study({{.rate = 5000.0, .measure = RateMeasure::feels}}, settings);
  EXPECT_LT(felt[0].found.stiffness, 1.04 / 55e-6);
}

TEST(UpdateRateStudy, NamesEveryCaseOfAnEncoderOnce) {
  const auto cases = rate_cases(5.5e-6, RateMeasure::moves);
  EXPECT_EQ(cases.size(), study_rates().size() * 8);
  std::set<std::pair<double, std::string>> names;
  for (const RateCase& setting : cases)
    EXPECT_TRUE(names.insert({setting.rate, name_of(setting)}).second) << name_of(setting);
}

}  // namespace
}  // namespace kmax::experiment::update_rate_study_test
