#include "host_tools/simulated_board/simulated_bridge.hpp"

#include <gtest/gtest.h>

namespace kmax::simulated_board::simulated_bridge_test {

// Rounding and limits of duties are the driver's: tests/drivers/three_phase_pwm_test.cpp.
TEST(SimulatedBridge, ADutyWaitsForTheUpdateAndMoeDoesNot) {
  SimulatedBridge bridge;
  EXPECT_FALSE(bridge.command().legs[1].enabled);
  ASSERT_TRUE(bridge.pwm().ISR_set_duty({0.2f, 0.3333f, 1.0f}));
  ASSERT_TRUE(bridge.pwm().arm());
  EXPECT_TRUE(bridge.command().legs[1].enabled);
  EXPECT_EQ(bridge.command().legs[1].duty, 0.5) << "it begins without voltage";
  bridge.update();
  EXPECT_EQ(bridge.command().legs[0].duty, 840.0 / 4200.0);
  EXPECT_EQ(bridge.command().legs[1].duty, 1400.0 / 4200.0);
  EXPECT_EQ(bridge.command().legs[2].duty, (4200.0 - 252.0) / 4200.0);
  bridge.pwm().disarm();
  for (const auto& leg : bridge.command().legs) EXPECT_FALSE(leg.enabled);
}

TEST(SimulatedBridge, ALegThatIsNotEnabledStaysOff) {
  SimulatedBridge bridge;
  ASSERT_TRUE(bridge.pwm().enable_legs({.a = false}));
  ASSERT_TRUE(bridge.pwm().arm());
  const auto legs = bridge.command().legs;
  EXPECT_FALSE(legs[0].enabled);
  EXPECT_TRUE(legs[1].enabled && legs[2].enabled);
}

TEST(SimulatedBridge, DeadTimeAndFrequencyAreTheTimers) {
  EXPECT_DOUBLE_EQ(SimulatedBridge().command().dead_time, 21.0 / 168e6);
  EXPECT_DOUBLE_EQ(SimulatedBridge().command().pwm_frequency, 20000.0);
}

}  // namespace kmax::simulated_board::simulated_bridge_test
