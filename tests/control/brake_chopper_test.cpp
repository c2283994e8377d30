#include "control/brake_chopper.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kmax::control::brake_chopper_test {

constexpr auto fitted = BrakeChopper::prepare({25.0f, 0.5f});

// Ticks out of 40 in which the resistor is on.
int ticks_on(BrakeChopper& chopper, const BrakeChopper::Coefficients& c, float voltage) {
  int on = 0;
  for (int tick = 0; tick < 40; ++tick) on += chopper.update(c, voltage) ? 1 : 0;
  return on;
}

TEST(BrakeChopper, IsOffWithoutAResistorWhateverTheVoltage) {
  BrakeChopper chopper;
  constexpr auto none = BrakeChopper::prepare({});
  for (const float voltage : {0.0f, 24.0f, 1e9f, std::numeric_limits<float>::infinity(), std::nanf("")})
    EXPECT_EQ(ticks_on(chopper, none, voltage), 0) << voltage;
}

TEST(BrakeChopper, SwitchesWithHysteresis) {
  BrakeChopper chopper;
  EXPECT_EQ(ticks_on(chopper, fitted, 24.9f), 0);
  EXPECT_EQ(ticks_on(chopper, fitted, 25.0f), 40);
  EXPECT_EQ(ticks_on(chopper, fitted, 24.6f), 40);  // still on inside the band
  EXPECT_EQ(ticks_on(chopper, fitted, 24.5f), 0);
  EXPECT_EQ(ticks_on(chopper, fitted, 24.9f), 0);  // and off inside it from below
}

TEST(BrakeChopper, TakesAVoltageThatIsNoNumberAsLow) {
  BrakeChopper chopper;
  (void)ticks_on(chopper, fitted, 30.0f);
  EXPECT_EQ(ticks_on(chopper, fitted, std::nanf("")), 0);
}

}  // namespace kmax::control::brake_chopper_test
