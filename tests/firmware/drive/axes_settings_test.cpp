#include "firmware/drive/axes_settings.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace kmax::firmware::axes_settings_test {

TEST(AxesSettings, AreMadeByTheParametersOfEachAxis) {
  ParameterValues values;
  values.set_whole<"encoder.direction">(-1, 1);
  values.set_real<"supply.voltage_max">(31.0f);
  AxesSettings settings(values);
  EXPECT_EQ(settings.of(0).motor.dc.share_limit, 0.0f) << "the board has not said what it can give";
  constexpr AxesSettings::Circumstances board{.modulation_limit = 0.5f};
  settings.make(values, 0, {board, board}, {});
  EXPECT_EQ(settings.of(0).encoder_direction, 1);
  EXPECT_EQ(settings.of(1).encoder_direction, -1);
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    EXPECT_EQ(settings.of(axis).supply.high(), 31.0f);
    EXPECT_EQ(settings.of(axis).motor.dc.share_limit, 0.25f) << "what the board's bridge can give";
  }
}

TEST(AxesSettings, WhatTheTickLooksAtItselfIsOfEachAxis) {
  ParameterValues values;
  values.set_whole<"encoder.offset">(static_cast<std::uint32_t>(-77), 1);
  values.set_whole<"drive.mode">(static_cast<std::uint32_t>(DriveMode::torque), 1);
  values.set_real<"device.hand_force">(0.0f, 1);
  values.set_real<"supply.voltage_min">(9.0f);
  AxesSettings settings(values);
  EXPECT_EQ(settings.of(0).encoder_offset, 0);
  EXPECT_EQ(settings.of(1).encoder_offset, -77);
  EXPECT_EQ(settings.of(0).mode, DriveMode::haptic);
  EXPECT_EQ(settings.of(1).mode, DriveMode::torque);
  EXPECT_TRUE(settings.of(0).watch_motion);
  EXPECT_FALSE(settings.of(1).watch_motion) << "0 turns it off";
  values.set_real<"device.hand_force">(0.5f, 1);
  settings.make(values, 6, {}, {});
  EXPECT_TRUE(settings.of(1).watch_motion);
  EXPECT_TRUE(settings.of(1).supply.contains(9.0f));
  EXPECT_FALSE(settings.of(1).supply.contains(8.999f));
  EXPECT_EQ(settings.generation(), 7u);
  EXPECT_EQ(&settings.all().axis[1], &settings.of(1));
  // In eight ticks of 50 us: m/s for 1 N.
  EXPECT_FLOAT_EQ(settings.of(0).plausibility.acceleration, 8 * 5e-5f / values.real<"device.mass">(0));
}

TEST(AxesSettings, NoParameterLetsTheSupplyRiseAboveTheBoardsCeiling) {
  for (const auto& [ceiling, trips_above] : {std::pair{0.0f, 31.0f}, {25.68f, 25.68f}, {58.0f, 31.0f}}) {
    ParameterValues values;
    values.set_real<"supply.voltage_max">(31.0f);
    values.set_real<"supply.ceiling">(ceiling);
    EXPECT_EQ(AxesSettings(values).of(1).supply.high(), trips_above);
  }
}

TEST(AxesSettings, ARestartGivesAllAxesTheSameNewGeneration) {
  const ParameterValues values;
  AxesSettings settings(values);
  const std::uint32_t first = settings.generation();
  EXPECT_NE(first, AxisReport{}.generation) << "an axis that has not ticked yet has not taken them";
  settings.make(values, 0, {}, {});
  EXPECT_EQ(settings.generation(), first);
  settings.make(values, 3, {}, {});
  EXPECT_NE(settings.generation(), first);
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    EXPECT_EQ(settings.of(axis).generation, settings.generation()) << axis;
}

TEST(AxesSettings, TheCircumstancesOfAnAxisActOnThatAxisAlone) {
  const ParameterValues values;
  AxesSettings settings(values);
  const float full = settings.of(0).motor.transmission.current_limit;
  AxesSettings::AllCircumstances now;
  now[1] = {.current_share = 0.25f, .winding_temperature = 90.0f, .commutated = false};
  settings.make(values, 0, now, {});
  EXPECT_EQ(settings.circumstances(), now);
  EXPECT_EQ(settings.of(0).motor.transmission.current_limit, full);
  EXPECT_TRUE(settings.of(0).commutated);
  EXPECT_FLOAT_EQ(settings.of(1).motor.transmission.current_limit, 0.25f * full);
  EXPECT_FALSE(settings.of(1).commutated);
}

TEST(AxesSettings, TheScaleIsAWholeNumberOfResamplersSteps) {
  ParameterValues values;
  AxesSettings settings(values);
  const double count = settings.scale(1).count_length;
  EXPECT_GT(count, 0.0);
  values.set_real<"position.resolution">(static_cast<float>(10.0 * count), 1);
  settings.make(values, 0, {}, {});
  EXPECT_FLOAT_EQ(settings.scale(1).resolution, static_cast<float>(10.0 * count));
  EXPECT_NE(settings.scale(0).resolution, settings.scale(1).resolution);
}

}  // namespace kmax::firmware::axes_settings_test
