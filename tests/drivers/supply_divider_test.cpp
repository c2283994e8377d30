#include "drivers/supply_divider.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::supply_divider_test {

TEST(SupplyDivider, FullScaleOfBothBoards) {
  EXPECT_NEAR((SupplyDivider{11.0F}.volts(4095)), 36.29, 0.01);
  EXPECT_NEAR((SupplyDivider{19.0F}.volts(4095)), 62.68, 0.01);
  EXPECT_EQ(SupplyDivider{19.0F}.volts(0), 0.0F);
}

TEST(SupplyDivider, TwentyFourVoltsComeBack) {
  // 24 V / 11 = 2.1818 V at the tap.
  const SupplyDivider divider{11.0F};
  EXPECT_NEAR(divider.volts(2708), 24.0F, 0.5F * divider.volts(1));
}

TEST(SupplyDivider, OnlyTheLastCodeIsSaturated) {
  const SupplyDivider divider{19.0F};
  EXPECT_FALSE(divider.saturated(4094));
  EXPECT_TRUE(divider.saturated(4095));
}

}  // namespace kmax::drivers::supply_divider_test
