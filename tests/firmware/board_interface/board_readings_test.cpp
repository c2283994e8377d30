#include "firmware/board_interface/board_readings.hpp"

#include <gtest/gtest.h>

namespace kmax::firmware::board_readings_test {
namespace {

TEST(BoardReadings, ABoardThatSaysNothingIsColdUnpoweredAndHasCountedNothing) {
  const BoardReadings readings;
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    EXPECT_EQ(readings.power_stage_temperature[axis], 25.0f);
    EXPECT_EQ(readings.offset_b[axis], 0.0f);
    EXPECT_EQ(readings.offset_c[axis], 0.0f);
    EXPECT_FALSE(readings.gate_driver_missing[axis]);
    EXPECT_EQ(readings.gate_driver_faults[axis], 0);
  }
  EXPECT_EQ(readings.supply_voltage, 0.0f);
  EXPECT_EQ(readings.modulation_limit, 0.0f) << "no current";
  EXPECT_EQ(readings.missed_ticks, 0u);
  EXPECT_EQ(readings.longest_tick, 0u);
  EXPECT_EQ(readings.interference_forgiven, 0u);
  EXPECT_FALSE(readings.has_power_stage);
  EXPECT_FALSE(readings.ticks_have_stopped);
}

}  // namespace
}  // namespace kmax::firmware::board_readings_test
