#include "host_tools/virtual_board/stm32f4/pwr.hpp"

#include <gtest/gtest.h>

// RM0090, chapter Power controller (PWR), PWR power control register. The rule with HCLK: rcc_test.cpp.

namespace kmax::virtual_board::pwr_test {
namespace {

TEST(Pwr, VoltageScaleMustBeChosen) {
  BoardClocks clocks;
  PwrModel model{clocks};
  EXPECT_FALSE(model.voltage_scale_1());
  model.write({0, 4, 0}, 1U << 14);
  EXPECT_TRUE(model.voltage_scale_1());
  EXPECT_EQ(model.read({0, 4, 0}), 1U << 14);
  EXPECT_EQ(model.read({4, 4, 0}), 1U << 14) << "VOSRDY";
  model.reset(0);
  EXPECT_FALSE(model.voltage_scale_1());
}

TEST(Pwr, RefusesTheRest) {
  BoardClocks clocks;
  PwrModel model{clocks};
  for (const unsigned bit : {0U, 1U, 4U, 8U, 15U})
    EXPECT_THROW(model.write({0, 4, 0}, 1U << bit), RefusedAccess) << bit;
  EXPECT_THROW(model.write({4, 4, 0}, 0), RefusedAccess);
  EXPECT_THROW(model.read({8, 4, 0}), RefusedAccess);
}

}  // namespace
}  // namespace kmax::virtual_board::pwr_test
