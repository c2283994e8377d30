#include "host_tools/simulated_board/simulated_bridge.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace kmax::simulated_board::simulated_bridge_test {
namespace {

firmware::MotorControl::Output duties(float a, float b, float c) {
  firmware::MotorControl::Output out{};
  out.duty_a = a;
  out.duty_b = b;
  out.duty_c = c;
  return out;
}

TEST(SimulatedBridge, DutiesAreWholeTicksOfTheHalfPeriod) {
  SimulatedBridge bridge;
  bridge.arm();
  ASSERT_TRUE(bridge.set_duty(duties(0.50001f, 0.3333f, 0.7f)));
  bridge.update();
  const auto legs = bridge.command().legs;
  EXPECT_EQ(legs[0].duty, 2100.0 / 4200.0);
  EXPECT_EQ(legs[1].duty, 1400.0 / 4200.0);
  EXPECT_EQ(legs[2].duty, 2940.0 / 4200.0);
}

TEST(SimulatedBridge, TheLowSidesKeepTheirWindow) {
  SimulatedBridge bridge;
  bridge.arm();
  ASSERT_TRUE(bridge.set_duty(duties(1.0f, -0.5f, 30.0f)));
  bridge.update();
  EXPECT_EQ(bridge.command().legs[0].duty, (4200.0 - 252.0) / 4200.0);
  EXPECT_EQ(bridge.command().legs[1].duty, 0.0);
  EXPECT_EQ(bridge.command().legs[2].duty, (4200.0 - 252.0) / 4200.0);
}

TEST(SimulatedBridge, ADutyWaitsForTheUpdateAndMoeDoesNot) {
  SimulatedBridge bridge;
  EXPECT_FALSE(bridge.command().legs[1].enabled);
  ASSERT_TRUE(bridge.set_duty(duties(0.2f, 0.2f, 0.2f)));
  bridge.arm();
  EXPECT_TRUE(bridge.command().legs[1].enabled);
  EXPECT_EQ(bridge.command().legs[1].duty, 0.5) << "it begins without voltage";
  bridge.update();
  EXPECT_EQ(bridge.command().legs[1].duty, 0.2);
  bridge.disarm();
  for (const auto& leg : bridge.command().legs) EXPECT_FALSE(leg.enabled);
}

TEST(SimulatedBridge, ABrushedMotorHasNoLegA) {
  SimulatedBridge bridge;
  bridge.choose_legs(firmware::MotorKind::dc);
  bridge.arm();
  EXPECT_FALSE(bridge.command().legs[0].enabled);
  EXPECT_TRUE(bridge.command().legs[1].enabled && bridge.command().legs[2].enabled);
  bridge.choose_legs(firmware::MotorKind::pmsm);
  EXPECT_FALSE(bridge.command().legs[0].enabled) << "not while it is armed";
  bridge.disarm();
  bridge.choose_legs(firmware::MotorKind::pmsm);
  bridge.arm();
  EXPECT_TRUE(bridge.command().legs[0].enabled);
}

TEST(SimulatedBridge, WhatIsNotANumberChangesNothing) {
  SimulatedBridge bridge;
  bridge.arm();
  ASSERT_TRUE(bridge.set_duty(duties(0.4f, 0.4f, 0.4f)));
  EXPECT_FALSE(bridge.set_duty(duties(0.1f, std::numeric_limits<float>::quiet_NaN(), 0.1f)));
  bridge.update();
  EXPECT_EQ(bridge.command().legs[0].duty, 0.4);
}

TEST(SimulatedBridge, DeadTimeAndFrequencyAreTheTimers) {
  EXPECT_DOUBLE_EQ(SimulatedBridge().command().dead_time, 21.0 / 168e6);
  EXPECT_DOUBLE_EQ(SimulatedBridge().command().pwm_frequency, 20000.0);
}

}  // namespace
}  // namespace kmax::simulated_board::simulated_bridge_test
