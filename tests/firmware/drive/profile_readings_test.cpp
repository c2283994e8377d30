#include "firmware/drive/profile_readings.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware::profile_readings_test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

struct Told {
  ParameterValues values;
  AxisReport report;
  std::size_t axis = 0;
  void tell() { publish_profile(values, axis, report); }
};

TEST(ProfileReadings, TheDigitalInputsAreWhatTheBoardHas) {
  for (const Fault condition :
       {Fault::none, Fault::emergency_stop, Fault::gate_driver, Fault::over_voltage}) {
    for (const bool referenced : {false, true}) {
      Told told;
      told.axis = 1;
      told.report.condition = condition;
      told.report.referenced = referenced;
      told.tell();
      const std::uint32_t expected = (condition == Fault::emergency_stop ? 0x1'0000U : 0U) |
                                     (condition == Fault::gate_driver ? 0x2'0000U : 0U) |
                                     (referenced ? 0x4'0000U : 0U);
      EXPECT_EQ(told.values.whole<"profile.digital_inputs">(1), static_cast<std::int64_t>(expected));
    }
  }
}

TEST(ProfileReadings, WholeNumbersOf16BitsStayAtTheEndsOfTheirRange) {
  const auto whole = [](float value) { return static_cast<std::int32_t>(integer16_of(value)); };
  EXPECT_EQ(whole(0.0f), 0);
  EXPECT_EQ(whole(0.49f), 0);
  EXPECT_EQ(whole(0.5f), 1);
  EXPECT_EQ(whole(-0.49f), 0);
  EXPECT_EQ(whole(-0.5f), -1);
  EXPECT_EQ(whole(-1.4f), -1);
  EXPECT_EQ(whole(32766.4f), 32766);
  for (const float beyond : {32766.6f, 32767.0f, 32768.0f, 1e9f, 1e38f, infinity})
    EXPECT_EQ(whole(beyond), 32767);
  EXPECT_EQ(whole(-32767.4f), -32767);
  for (const float beyond : {-32767.6f, -32768.0f, -32769.0f, -1e38f, -infinity})
    EXPECT_EQ(whole(beyond), -32768);
  EXPECT_EQ(whole(nan), 0);
  EXPECT_EQ(whole(-nan), 0);
}

TEST(ProfileReadings, WholeNumbersOf32BitsStayAtTheEndsOfTheirRange) {
  const auto whole = [](float value) { return static_cast<std::int32_t>(integer32_of(value)); };
  EXPECT_EQ(whole(0.49f), 0);
  EXPECT_EQ(whole(0.5f), 1);
  EXPECT_EQ(whole(-0.5f), -1);
  EXPECT_EQ(whole(4194303.5f), 4194304);
  EXPECT_EQ(whole(8388607.5f), 8388608);
  // Whole numbers that are not moved by rounding them.
  for (const int number : {8388608, 8388609, 8388611, 16777215, 16777216, 2147483520}) {
    EXPECT_EQ(whole(static_cast<float>(number)), number);
    EXPECT_EQ(whole(static_cast<float>(-number)), -number);
  }
  constexpr auto highest = std::numeric_limits<std::int32_t>::max(),
                 lowest = std::numeric_limits<std::int32_t>::min();
  for (const float beyond : {2147483648.0f, 3e9f, 1e38f, infinity}) EXPECT_EQ(whole(beyond), highest);
  for (const float beyond : {-2147483648.0f, -3e9f, -1e38f, -infinity}) EXPECT_EQ(whole(beyond), lowest);
  EXPECT_EQ(whole(nan), 0);
}

RC_GTEST_PROP(ProfileReadings, VelocityInCountsIsTheVelocityOverTheCountsLength, ()) {
  const auto in = [](double low, double high) {
    return static_cast<float>(low * std::pow(high / low, *rc::gen::inRange(0, 1001) / 1000.0));
  };
  ParameterValues values;
  values.set_real<"device.transmission">(in(1e-6, 10));
  values.set_whole<"encoder.counts_per_turn">(
      static_cast<std::uint32_t>(*rc::gen::inRange(4, 1'000'000'000)));
  const float velocity = in(1e-6, 100) * (*rc::gen::arbitrary<bool>() ? 1.0f : -1.0f);
  const double wanted = double(velocity) / count_length(values, 0);
  RC_ASSERT(std::abs(double(counts_per_second(values, 0, velocity)) - wanted) <= 4e-7 * std::abs(wanted));
}

TEST(ProfileReadings, OfAMotorUnderForceInTheStandardsUnits) {
  for (const std::size_t axis : {0u, 1u}) {
    Told t;
    t.axis = axis;
    t.values.set_real<"current.limit">(4.0f, axis);
    t.values.set_real<"motor.torque_constant">(0.025f, axis);    // 100 mN m
    t.values.set_real<"device.transmission">(0.02f, axis);       // 5 N
    t.values.set_whole<"encoder.counts_per_turn">(10000, axis);  // 12.57 um
    t.values.set_whole<"drive.mode">(2, axis);
    t.report.motor.current = -1.2345f;
    t.report.motor.force_made = -1.2345f * 0.025f / 0.02f;
    t.report.haptic.velocity = 0.1f;
    t.tell();
    EXPECT_EQ(t.values.whole<"profile.operation_mode_display">(axis), 10);
    EXPECT_EQ(t.values.whole<"profile.velocity">(axis), 7958);  // 0.1 m/s / (2 pi 0.02 m / 10000)
    EXPECT_EQ(t.values.whole<"profile.rated_current">(axis), 4000);
    EXPECT_EQ(t.values.whole<"profile.rated_torque">(axis), 100);
    EXPECT_EQ(t.values.whole<"profile.torque">(axis), -309);   // 30.86 mN m of 100
    EXPECT_EQ(t.values.whole<"profile.current">(axis), -309);  // 1.2345 A of 4
    EXPECT_EQ(t.values.whole<"profile.supported_modes">(axis), 0x00030200);
    EXPECT_EQ(t.values.whole<"profile.device_type">(axis), 0x00020192);
    EXPECT_EQ(t.values.whole<"telemetry.current">(axis), -1235);
    t.report.haptic.velocity = -0.1f;
    t.tell();
    EXPECT_EQ(t.values.whole<"profile.velocity">(axis), -7958);
  }
}

TEST(ProfileReadings, ModeIsShownAsTheStandardNumbersIt) {
  Told t;
  for (const auto& [mode, shown] : {std::pair{0u, -1}, {1u, -2}, {2u, 10}}) {
    t.values.set_whole<"drive.mode">(mode);
    t.tell();
    EXPECT_EQ(t.values.whole<"profile.operation_mode_display">(), shown);
  }
}

TEST(ProfileReadings, WhatIsNoNumberIsZeroAndWhatIsTooMuchStaysAtTheEnd) {
  Told t;
  for (const auto& [value, shown, velocity] : {std::tuple{nan, 0, 0},
                                               {infinity, 32767, std::numeric_limits<std::int32_t>::max()},
                                               {-infinity, -32768, std::numeric_limits<std::int32_t>::min()},
                                               {1e30f, 32767, std::numeric_limits<std::int32_t>::max()},
                                               {-1e30f, -32768, std::numeric_limits<std::int32_t>::min()}}) {
    t.report.motor.current = t.report.motor.force_made = t.report.haptic.velocity = value;
    t.tell();
    EXPECT_EQ(t.values.whole<"profile.torque">(), shown) << value;
    EXPECT_EQ(t.values.whole<"profile.current">(), shown) << value;
    EXPECT_EQ(t.values.whole<"telemetry.current">(), shown) << value;
    EXPECT_EQ(t.values.whole<"profile.velocity">(), velocity) << value;
  }
  // 40 A is beyond what 16 bits hold in mA and within what they hold in thousandths of 120 A.
  t.values.set_real<"current.limit">(120.0f);
  t.report.motor.current = 40.0f;
  t.tell();
  EXPECT_EQ(t.values.whole<"telemetry.current">(), 32767);
  EXPECT_EQ(t.values.whole<"profile.current">(), 333);
}

// 0x6071 asks, 0x6077 answers: the same number when the motor makes what was asked for.
RC_GTEST_PROP(ProfileReadings, TheTorqueOfTheForceAskedForIsTheTarget, ()) {
  Told t;
  const auto in = [](double low, double high) {
    return static_cast<float>(low * std::pow(high / low, *rc::gen::inRange(0, 1001) / 1000.0));
  };
  const int target = *rc::gen::inRange(-1000, 1001);
  t.values.set_whole<"drive.mode">(2);
  t.values.set_whole<"profile.target_torque">(static_cast<std::uint32_t>(target));
  t.values.set_real<"current.limit">(in(0.1, 120));
  t.values.set_real<"motor.torque_constant">(in(1e-5, 100));
  t.values.set_real<"device.transmission">(in(1e-6, 10));
  t.report.motor.force_made = commanded_force(t.values, 0, true, false);
  t.tell();
  RC_ASSERT(t.values.whole<"profile.torque">() == target);
}

TEST(ProfileReadings, NothingButItsOwnValuesOfItsOwnAxis) {
  Told t;
  t.axis = 1;
  t.report.motor.current = 1.0f;
  t.report.haptic.velocity = 1.0f;
  const ParameterValues before = t.values;
  t.tell();
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const bool own = axis == 1 && (entry_at(entry).group.index == group::profile_actual.index ||
                                   entry_at(entry).group.index == group::telemetry.index);
    if (!own) {
      EXPECT_EQ(t.values.raw(slot), before.raw(slot)) << entry_at(entry).name;
    }
  }
}

TEST(ProfileReadings, FlagsOfBothAxesShareAWordAndTheTickIsItsLowHalf) {
  ParameterValues values;
  publish_telemetry(values, {0x3F, 0x15}, 0x1234ABCD);
  EXPECT_EQ(values.whole<"telemetry.flags">(), 0x153F);
  EXPECT_EQ(values.whole<"telemetry.tick">(), 0xABCD);
  publish_telemetry(values, {0xFFFF'FF00, 0x1FF}, 0xFFFF'0000);
  EXPECT_EQ(values.whole<"telemetry.flags">(), 0xFF00) << "what does not fit is not told";
  EXPECT_EQ(values.whole<"telemetry.tick">(), 0);
}

}  // namespace
}  // namespace kmax::firmware::profile_readings_test
