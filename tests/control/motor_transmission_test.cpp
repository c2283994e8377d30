#include "control/motor_transmission.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::control::motor_transmission_test {

MotorTransmissionConfig<float> capstan() {
  MotorTransmissionConfig<float> config;
  config.transmission = 0.01F;     // 10 mm per radian
  config.torque_constant = 0.05F;  // N m/A
  config.current_limit = 2.0F;
  return config;
}

TEST(MotorTransmission, ForceBecomesTorqueBecomesCurrent) {
  const auto c = MotorTransmission<float>::prepare(capstan());
  const auto out = MotorTransmission<float>::update(c, 3.0F);  // 30 mN m
  EXPECT_FLOAT_EQ(out.current, 0.6F);
  EXPECT_EQ(out.force, 3.0F);
  EXPECT_FALSE(out.limited);
  EXPECT_FLOAT_EQ(MotorTransmission<float>::force(c, 0.6F), 3.0F);
  EXPECT_FLOAT_EQ(MotorTransmission<float>::motor_speed(c, 0.5F), 50.0F);
}

TEST(MotorTransmission, WhatTheLimitLeavesIsWhatIsReported) {
  const auto c = MotorTransmission<float>::prepare(capstan());
  for (const float sign : {1.0F, -1.0F}) {
    const auto out = MotorTransmission<float>::update(c, sign * 12.0F);
    EXPECT_TRUE(out.limited);
    EXPECT_EQ(out.current, sign * 2.0F);
    EXPECT_FLOAT_EQ(out.force, sign * 10.0F);
  }
  EXPECT_FALSE(MotorTransmission<float>::update(c, 9.99F).limited);
}

// Power at the handle is power at the motor, whichever way round they turn.
TEST(MotorTransmission, PowerIsKept) {
  for (const float transmission : {0.01F, -0.01F, 0.3F}) {
    auto config = capstan();
    config.transmission = transmission;
    config.current_limit = 1e6F;
    const auto c = MotorTransmission<float>::prepare(config);
    const auto out = MotorTransmission<float>::update(c, 2.5F);
    const float motor_power =
        out.current * config.torque_constant * MotorTransmission<float>::motor_speed(c, 0.4F);
    EXPECT_NEAR(motor_power, 2.5F * 0.4F, 1e-6F);
    EXPECT_EQ(out.current > 0.0F, transmission > 0.0F);
  }
}

TEST(MotorTransmission, WhatIsNotFiniteGivesNoCurrentAndAFault) {
  const auto c = MotorTransmission<float>::prepare(capstan());
  for (const float bad :
       {std::nanf(""), std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::max()}) {
    auto steep = c;
    steep.current_per_force = 10.0F;
    const auto out = MotorTransmission<float>::update(steep, bad);
    EXPECT_TRUE(out.not_finite) << bad;
    EXPECT_EQ(out.current, 0.0F);
    EXPECT_EQ(out.force, 0.0F);
  }
  auto config = capstan();
  config.torque_constant = 0.0F;
  const auto out = MotorTransmission<float>::update(MotorTransmission<float>::prepare(config), 1.0F);
  EXPECT_TRUE(out.not_finite);
  EXPECT_EQ(out.current, 0.0F);
}

TEST(MotorTransmission, ALimitOfZeroMeansNoCurrent) {
  auto config = capstan();
  config.current_limit = 0.0F;
  const auto out = MotorTransmission<float>::update(MotorTransmission<float>::prepare(config), 1.0F);
  EXPECT_EQ(out.current, 0.0F);
  EXPECT_EQ(out.force, 0.0F);
  EXPECT_TRUE(out.limited);
}

}  // namespace kmax::control::motor_transmission_test
