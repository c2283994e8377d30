#include "host_tools/experiment/report_words.hpp"

#include <gtest/gtest.h>

namespace kmax::experiment {
namespace {

TEST(ReportWords, AreThoseOfEveryReport) {
  EXPECT_EQ(yes_no(true), "yes");
  EXPECT_EQ(yes_no(false), "no");
  EXPECT_EQ(rank_text(0.874), "+0.87");
  EXPECT_EQ(rank_text(-1.0), "-1.00");
  EXPECT_EQ(rank_text({}), "-");
  EXPECT_EQ(people_words(1), "1 person");
  EXPECT_EQ(people_words(12), "12 people");
  simulation::DeviceModel device;
  device.force_limit = 3.3;
  EXPECT_EQ(clipping_words(device), "clipped at 3.3 N");
  device.force_limit = 0.0;
  EXPECT_EQ(clipping_words(device), "not clipped");
}

}  // namespace
}  // namespace kmax::experiment
