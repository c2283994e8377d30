#include "host_tools/record/row.hpp"

#include <gtest/gtest.h>

namespace kmax::record::row_test {

Row row() {
  Row made{.tick = 1'000'020};
  made.axes[0] = {1'000'020, 0.0123456789, -0.5F, 2.4F, 0.25F, 17};
  made.axes[1] = {1'000'033, static_cast<double>(0.1F), 1e-7F, 0, -1, 0};
  return made;
}

TEST(RowCsv, HeadingsSayTheUnits) {
  EXPECT_EQ(RowCsv({0, 1}, false).heading(),
            "time_s,tick,axis0_position_m,axis0_velocity_m_per_s,axis0_force_n,axis0_current_a,axis0_flags,"
            "axis1_position_m,axis1_velocity_m_per_s,axis1_force_n,axis1_current_a,axis1_flags\n");
  EXPECT_EQ(
      RowCsv({1}, false).heading(),
      "time_s,tick,axis1_position_m,axis1_velocity_m_per_s,axis1_force_n,axis1_current_a,axis1_flags\n");
}

TEST(RowCsv, AxesReadApartHaveTheirOwnTick) {
  const std::string heading = RowCsv({0, 1}, true).heading();
  EXPECT_TRUE(heading.ends_with(",axis1_flags,axis1_tick\n"));
  const std::string line = RowCsv({0, 1}, true).line(row(), 1'000'000);
  EXPECT_TRUE(line.ends_with(",0,1000033\n")) << line;
}

TEST(RowCsv, ALineHasTheDevicesTimeAndNoMoreDigitsThanThereAre) {
  EXPECT_EQ(RowCsv({0, 1}, false).line(row(), 1'000'000),
            "0.00100,1000020,0.0123456789,-0.5,2.4,0.25,17,0.1,1e-07,0,-1,0\n");
}

TEST(RowCsv, TimesOfLongRecordingsKeepTheTick) {
  Row late = row();
  late.tick = 1'000'000ULL + 20'000ULL * 3600 * 1000 + 1;
  EXPECT_TRUE(RowCsv({0}, false).line(late, 1'000'000).starts_with("3600000.00005,"));
}

}  // namespace kmax::record::row_test
