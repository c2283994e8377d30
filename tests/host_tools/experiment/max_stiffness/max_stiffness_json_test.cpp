#include "host_tools/experiment/max_stiffness/max_stiffness_json.hpp"

#include <gtest/gtest.h>

namespace kmax::experiment::max_stiffness_json_test {
namespace {

TEST(MaxStiffnessJson, ReadsBackToTheLastBit) {
  MaxStiffness result;
  result.stiffness = 3.58e3 + 1e-9;
  result.never_touched = true;
  result.ending_peak_to_peak = 0.1 + 0.2;
  result.saturated_share = 1.0 / 3.0;
  result.touches = 1234567890123456789ULL;
  const MaxStiffness back = max_stiffness_from(nlohmann::ordered_json::parse(json_of(result).dump()));
  EXPECT_EQ(back.stiffness, result.stiffness);
  EXPECT_EQ(back.never_touched, true);
  EXPECT_EQ(back.beyond_last, false);
  EXPECT_EQ(back.ending_peak_to_peak, result.ending_peak_to_peak);
  EXPECT_EQ(back.saturated_share, result.saturated_share);
  EXPECT_EQ(back.touches, result.touches);
  EXPECT_THROW(max_stiffness_from(nlohmann::ordered_json::parse("{}")), nlohmann::json::exception);
}

}  // namespace
}  // namespace kmax::experiment::max_stiffness_json_test
