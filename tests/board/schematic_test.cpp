// What the schematic of the ODrive v3.5 and its firmware say of the board, written a second time: the models
// of the virtual board read the description, so they would follow an error in it.
#include <gtest/gtest.h>

#include <array>

#include "board/odrive_v3/description.hpp"

namespace kmax::board::odrive_v3::schematic_test {

using Temperatures = std::array<std::uint8_t, 2>;

TEST(Schematic, AmplifiersAndDividersAreOnTheseChannels) {
  // PC0, PC1 of axis 0; PC3, PC2 of axis 1, whose phases B and C are the other way round.
  EXPECT_EQ(sampling_config.axes[0].b, 10);
  EXPECT_EQ(sampling_config.axes[0].c, 11);
  EXPECT_EQ(sampling_config.axes[1].b, 13);
  EXPECT_EQ(sampling_config.axes[1].c, 12);
  EXPECT_EQ(sampling_config.supply, 6);                            // PA6
  EXPECT_EQ(sampling_config.temperatures, (Temperatures{15, 4}));  // PC5, PA4
}

TEST(Schematic, TheBridgesHaveTheseTimes) {
  EXPECT_EQ(description.core_clock_hz, 168'000'000U);
  EXPECT_EQ(description.half_period_ticks, 4200U) << "20 kHz, counted both ways";
  EXPECT_EQ(description.dead_time_ticks, 21U) << "125 ns";
  EXPECT_EQ(description.minimum_low_ticks, 252U) << "1.5 us";
  EXPECT_DOUBLE_EQ(description.shunt, 0.5e-3);
}

}  // namespace kmax::board::odrive_v3::schematic_test
