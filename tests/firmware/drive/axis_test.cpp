#include "firmware/drive/axis.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware::axis_test {
namespace {

AxisSetting setting_from(const ParameterValues& values, std::uint32_t generation = 1) {
  AxisSetting setting;
  setting.haptic = control::HapticLoop<float>::prepare(haptic_configuration(values, 0), 0);
  setting.encoder_offset = values.whole<"encoder.offset">();
  setting.encoder_direction = values.whole<"encoder.direction">();
  setting.generation = generation;
  return setting;
}

ParameterValues plain_wall() {
  ParameterValues values;
  values.set_real<"device.transmission">(0.15915494309189535f);
  values.set_whole<"encoder.counts_per_turn">(1'000'000);
  values.set_real<"force.ramp_time">(0.0f);
  values.set_real<"velocity.limit">(0.0f);
  return values;
}

class AxisTest : public testing::Test {
 protected:
  Axis::Output tick(std::uint32_t count, bool enable, bool valid = true, float external = 0.0f) {
    return axis.ISR_tick(setting, {count, valid}, {.enable = enable, .from_axes = external}, ++ticks);
  }
  Axis axis;
  AxisSetting setting = setting_from(plain_wall());
  std::uint32_t ticks = 0;
};

constexpr std::uint32_t at(std::int32_t count) {
  return static_cast<std::uint32_t>(count);
}

TEST_F(AxisTest, TripStaysUntilDisabledHasBeenSeen) {
  EXPECT_EQ(tick(at(-1000), true).force, 1.0f);
  EXPECT_EQ(tick(at(-1000), true, false).force, 0.0f);
  EXPECT_EQ(axis.ISR_report().fault, Fault::encoder);
  for (int i = 0; i < 5; ++i) {
    const auto out = tick(at(-1000), true);
    EXPECT_EQ(out.force, 0.0f);
    EXPECT_FALSE(out.enabled);
    EXPECT_EQ(axis.ISR_report().fault, Fault::encoder);
  }
  EXPECT_EQ(tick(at(-1000), false).force, 0.0f);
  EXPECT_EQ(axis.ISR_report().fault, Fault::none);
  EXPECT_EQ(tick(at(-1000), true).force, 1.0f);
}

TEST_F(AxisTest, FirstFaultIsKept) {
  ParameterValues values = plain_wall();
  values.set_real<"velocity.limit">(0.5f);
  values.set_whole<"velocity.estimator">(0);
  setting = setting_from(values);
  tick(at(1000), true);
  tick(at(2000), true);
  EXPECT_EQ(axis.ISR_report().fault, Fault::over_speed);
  EXPECT_NEAR(axis.ISR_report().fault_value, 20.0f, 0.01f);
  tick(at(9000), true, false);
  EXPECT_EQ(axis.ISR_report().fault, Fault::over_speed);
  EXPECT_NEAR(axis.ISR_report().fault_value, 20.0f, 0.01f);
}

TEST_F(AxisTest, ExternalForceIsPartOfWhatIsLimitedAndOnlyWhileEnabled) {
  EXPECT_EQ(tick(at(1000), true, true, 1.5f).force, 1.5f);
  EXPECT_EQ(tick(at(1000), true, true, -100.0f).force, -3.3f);
  EXPECT_EQ(tick(at(1000), false, true, 1.5f).force, 0.0f);
}

TEST_F(AxisTest, ExternalForceThatIsNotANumberTripsAndNeverReachesTheDevice) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::quiet_NaN()}) {
    tick(at(1000), false);
    EXPECT_EQ(tick(at(1000), true, true, bad).force, 0.0f);
    EXPECT_EQ(axis.ISR_report().fault, Fault::not_finite);
    EXPECT_EQ(tick(at(1000), true, true, 1.0f).force, 0.0f);
  }
}

TEST_F(AxisTest, InvalidCountsHoldThePositionAndAreToldInTheReport) {
  tick(at(500), false);
  EXPECT_TRUE(axis.ISR_report().count_valid);
  tick(at(9999), false, false);
  EXPECT_EQ(axis.ISR_report().haptic.position, 500);
  EXPECT_FALSE(axis.ISR_report().count_valid);
  EXPECT_EQ(axis.ISR_report().fault, Fault::none) << "not enabled: nothing to trip";
}

TEST_F(AxisTest, WhatTheCounterHeldBeforeItsFirstValidCountMeansNothing) {
  for (int i = 0; i < 10; ++i) tick(0x7FFFFFFF, false, false);
  EXPECT_EQ(axis.ISR_report().haptic.position, 0);
  tick(0x80000001, false);
  EXPECT_EQ(axis.ISR_report().haptic.position, static_cast<std::int32_t>(0x80000001)) << "as signed, no lap";
  EXPECT_EQ(axis.ISR_report().haptic.velocity, 0.0f) << "the first count is no motion";
  tick(0x80000001, false);
  EXPECT_EQ(axis.ISR_report().haptic.velocity, 0.0f);
}

TEST_F(AxisTest, NewGenerationStartsEstimatorsAfresh) {
  for (int i = 0; i < 50; ++i) tick(at(1000 + 10 * i), false);
  EXPECT_GT(axis.ISR_report().haptic.velocity, 0.1f);
  setting.encoder_offset = 100'000;
  setting.generation = 2;
  tick(at(1500), false);
  EXPECT_EQ(axis.ISR_report().haptic.velocity, 0.0f);
  EXPECT_EQ(axis.ISR_report().haptic.position, 1500 - 100'000);
  EXPECT_EQ(axis.ISR_report().generation, 2u);
}

TEST_F(AxisTest, SamplesAreCountedFromArmingAndKeptAfterwards) {
  for (int i = 0; i < 10; ++i) tick(at(1000), false);
  for (int i = 0; i < 20; ++i) tick(at(i < 5 ? 1000 : -10'000), true);
  EXPECT_EQ(axis.ISR_report().armed_samples, 20u);
  EXPECT_EQ(axis.ISR_report().limited_samples, 15u);
  for (int i = 0; i < 10; ++i) tick(at(-10'000), false);
  EXPECT_EQ(axis.ISR_report().armed_samples, 20u);
  tick(at(1000), true);
  EXPECT_EQ(axis.ISR_report().armed_samples, 1u);
  EXPECT_EQ(axis.ISR_report().limited_samples, 0u);
}

// A new start of the estimators gives the loop's samples other numbers; those since arming stay what they
// are.
TEST_F(AxisTest, ANewStartLosesNoSamplesOfTheArming) {
  setting.haptic.divider = 2;
  for (int i = 0; i < 1001; ++i) tick(at(1000), false);
  for (int i = 0; i < 20; ++i) tick(at(1000), true);
  ASSERT_EQ(axis.ISR_report().armed_samples, 10u);
  // Another origin while armed: it trips, and starts afresh, with a sample at once.
  Axis::Input moved{at(1000), true};
  moved.reference_generation = 1;
  axis.ISR_tick(setting, moved, {.enable = true}, ++ticks);
  ASSERT_EQ(axis.ISR_report().fault, Fault::encoder);
  EXPECT_EQ(axis.ISR_report().armed_samples, 11u);
  // And with new settings in the tick that disarms it.
  setting.generation = 2;
  axis.ISR_tick(setting, moved, {}, ++ticks);
  EXPECT_EQ(axis.ISR_report().armed_samples, 11u);
}

TEST(AxisPosition, OffsetAndDirectionWithoutOverflow) {
  AxisSetting setting;
  setting.encoder_offset = std::numeric_limits<std::int32_t>::min();
  setting.encoder_direction = -1;
  EXPECT_EQ(Axis::position_of(std::int64_t{1} << 40, setting), -(std::int64_t{1} << 40) - 2147483648LL);
  setting.encoder_direction = 1;
  EXPECT_EQ(Axis::position_of(0, setting), 2147483648LL);
}

// What the board finds wrong keeps the axis from driving in the tick that hears of it.
TEST_F(AxisTest, TripsOnTheBoardsConditionAtOnce) {
  for (const Fault condition : {Fault::emergency_stop, Fault::gate_driver, Fault::power_stage}) {
    (void)tick(at(-1000), false);
    ASSERT_TRUE(tick(at(-1000), true).enabled);
    const auto out = axis.ISR_tick(setting, {at(-1000), true, condition}, {.enable = true}, ++ticks);
    EXPECT_FALSE(out.enabled);
    EXPECT_EQ(out.force, 0.0f);
    EXPECT_EQ(axis.ISR_report().fault, condition);
    EXPECT_EQ(axis.ISR_report().condition, condition);
    EXPECT_EQ(axis.ISR_report().fault_value, 0.0f) << "there is no number to it";
  }
}

TEST_F(AxisTest, SupplyOutsideItsBoundsTripsWithTheVoltage) {
  setting.supply = SupplyWindow(8.0f, 26.0f);
  setting.motor = MotorControl::prepare({});
  const auto with_supply = [&](float voltage) {
    return axis.ISR_tick(setting,
                         {.count = at(-1000), .count_valid = true, .motor = {true, voltage, 0.0f, 0.0f}},
                         {.enable = true}, ++ticks);
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::pair<float, Fault> cases[] = {
      {7.9f, Fault::under_voltage}, {26.1f, Fault::over_voltage}, {0.0f, Fault::under_voltage}};
  for (const auto& [voltage, fault] : cases) {
    (void)tick(at(-1000), false);
    ASSERT_TRUE(with_supply(24.0f).enabled);
    EXPECT_FALSE(with_supply(voltage).enabled);
    EXPECT_EQ(axis.ISR_report().fault, fault);
    EXPECT_EQ(axis.ISR_report().fault_value, voltage);
  }
  (void)tick(at(-1000), false);
  EXPECT_FALSE(with_supply(nan).enabled);
}

// The duty of a tick in which the axis trips must never reach the bridge.
TEST_F(AxisTest, ATripOfTheMotorLeavesNoDuty) {
  setting.supply = SupplyWindow(0.0f, 26.0f);
  setting.motor = MotorControl::prepare({});
  const auto out =
      axis.ISR_tick(setting, {.count = at(-1000), .count_valid = true, .motor = {true, 24.0f, 9.0f, -9.0f}},
                    {.enable = true}, ++ticks);
  EXPECT_FALSE(out.enabled);
  EXPECT_EQ(out.motor.duty_b, 0.5f);
  EXPECT_EQ(axis.ISR_report().fault, Fault::over_current);
}

TEST_F(AxisTest, SaysWhenTheMainLoopMustSeeItsReport) {
  (void)tick(at(0), false);
  EXPECT_TRUE(axis.ISR_changed());  // the first setting, the first count
  for (int i = 1; i < 20; ++i) {
    (void)tick(at(i), false);
    EXPECT_FALSE(axis.ISR_changed()) << i;
  }
  (void)tick(at(0), true);
  EXPECT_TRUE(axis.ISR_changed());  // an enable
  (void)tick(at(0), true);
  EXPECT_FALSE(axis.ISR_changed());
  (void)tick(at(0), true, false);
  EXPECT_TRUE(axis.ISR_changed());  // a fault
  (void)tick(at(0), true, false);
  EXPECT_FALSE(axis.ISR_changed());
}

TEST_F(AxisTest, TellsItsCountItsFaultAndWhereAnotherSlotFindsIt) {
  EXPECT_EQ(axis.ISR_fault(), Fault::none);
  EXPECT_FALSE(axis.ISR_follows({0, true})) << "before its first count";
  tick(at(-300), false);
  EXPECT_EQ(axis.ISR_counted(), -300);
  EXPECT_EQ(axis.ISR_position(at(-290), setting), -290);
  setting.encoder_offset = 10;
  EXPECT_EQ(axis.ISR_position(at(-290), setting), -300);
  setting.encoder_direction = -1;
  EXPECT_EQ(axis.ISR_position(at(-290), setting), 300);
  EXPECT_EQ(axis.ISR_counted(), -300) << "a look from there changes nothing";
  Axis::Input input{at(-290), true};
  EXPECT_TRUE(axis.ISR_follows(input));
  input.reference_generation = 1;
  EXPECT_FALSE(axis.ISR_follows(input)) << "of another origin";
  EXPECT_FALSE(axis.ISR_follows({at(-290), false}));
  axis.ISR_trip(Fault::main_loop, {});
  EXPECT_EQ(axis.ISR_fault(), Fault::main_loop);
  axis.ISR_trip(Fault::tick_missed, {});
  EXPECT_EQ(axis.ISR_fault(), Fault::main_loop) << "the first is kept";
}

// However it starts afresh, a loop at 20 kHz goes by the number of the tick: what is slow lies in odd ones.
TEST_F(AxisTest, FoawKeepsToTheEvenTicks) {
  std::int32_t count = 1000;
  for (int start = 0; start < 8; ++start) {
    setting.generation += 1;
    for (int i = 0; i < start; ++i) tick(at(count), false);
    float before = axis.ISR_haptic().velocity;
    std::uint32_t changes = 0;
    for (int i = 0; i < 40; ++i) {
      tick(at(count += 3 * i), false);
      const float velocity = axis.ISR_haptic().velocity;
      // The first is of the fresh start.
      if (velocity != before && i > 0) {
        ASSERT_EQ(ticks % 2, 0u) << start;
        ++changes;
      }
      before = velocity;
    }
    EXPECT_GE(changes, 15u);
    tick(at(count), false);
  }
}

TEST_F(AxisTest, HoldsBetweenTwoSamplesWhereNothingElseCanHappen) {
  ParameterValues values = plain_wall();
  values.set_real<"haptic.rate">(2000.0f);
  setting = setting_from(values);
  const auto sampled = [this](bool enable) {
    do tick(at(1000), enable);
    while (!axis.ISR_haptic().new_sample);
    tick(at(1000), enable);
  };
  for (const bool enable : {false, true}) {
    sampled(enable);
    sampled(enable);
    EXPECT_EQ(axis.ISR_held_ticks(setting, enable), 8u);
    EXPECT_EQ(axis.ISR_held_ticks(setting, !enable), 0u) << "is to be enabled or disabled";
    AxisSetting other = setting;
    ++other.generation;
    EXPECT_EQ(axis.ISR_held_ticks(other, enable), 0u);
    other = setting;
    other.mode = DriveMode::excitation;
    EXPECT_EQ(axis.ISR_held_ticks(other, enable), 0u);
    other = setting;
    other.compensation.limit = 0.1f;
    EXPECT_EQ(axis.ISR_held_ticks(other, enable), 0u);
  }
  const std::uint32_t before = axis.ISR_report().tick;
  axis.ISR_pass_held(5);
  EXPECT_EQ(axis.ISR_held_ticks(setting, true), 3u);
  EXPECT_EQ(axis.ISR_report().tick, before + 5);
  tick(at(1000), true, false);
  EXPECT_EQ(axis.ISR_held_ticks(setting, true), 0u) << "tripped";
}

TEST_F(AxisTest, OneThatIsNotThereHasNoCountAndNothingIsNew) {
  tick(at(-1000), true);
  ASSERT_TRUE(axis.ISR_changed());
  setting.generation = 7;
  axis.ISR_pass(setting, 1234);
  EXPECT_FALSE(axis.ISR_changed());
  EXPECT_FALSE(axis.ISR_follows({at(-1000), true}));
  const AxisReport report = axis.ISR_report();
  EXPECT_EQ(report.tick, 1234u);
  EXPECT_EQ(report.generation, 7u);
  EXPECT_FALSE(report.enabled);
  EXPECT_FALSE(report.count_valid);
  EXPECT_FALSE(report.referenced);
  EXPECT_EQ(report.condition, Fault::none);
}

TEST(AxisSetting, ItsDefaults) {
  const AxisSetting defaults;
  EXPECT_TRUE(defaults.supply.contains(0.0f));
  EXPECT_FALSE(defaults.supply.contains(1e-30f));
  EXPECT_EQ(defaults.encoder_offset, 0);
  EXPECT_EQ(defaults.encoder_direction, 1);
  EXPECT_EQ(defaults.generation, 0u);
  EXPECT_EQ(defaults.mode, DriveMode::haptic);
  EXPECT_FALSE(defaults.watch_motion);
  EXPECT_TRUE(defaults.commutated);
}

TEST(SupplyWindow, HasWhatIsBetweenItsEndsAndNothingIfTheyAreTheWrongWayRound) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const SupplyWindow window(8.0f, 26.0f);
  for (const float inside : {8.0f, 12.0f, 26.0f}) EXPECT_TRUE(window.contains(inside)) << inside;
  for (const float outside : {7.999f, 26.001f, 0.0f, -0.0f, -12.0f, nan, -nan, 1e30f})
    EXPECT_FALSE(window.contains(outside)) << outside;
  EXPECT_TRUE(window.is_below(26.001f));
  EXPECT_FALSE(window.is_below(7.0f));
  EXPECT_FALSE(window.is_below(nan));
  const SupplyWindow from_zero(-0.0f, 26.0f);
  EXPECT_TRUE(from_zero.contains(0.0f));
  EXPECT_FALSE(from_zero.contains(-1.0f));
  for (const SupplyWindow& none : {SupplyWindow(26.0f, 8.0f), SupplyWindow(-1.0f, 8.0f),
                                   SupplyWindow(nan, 8.0f), SupplyWindow(8.0f, nan)}) {
    for (const float voltage : {-1.0f, 0.0f, 8.0f, 12.0f, 26.0f, 1e30f, nan}) {
      EXPECT_FALSE(none.contains(voltage)) << voltage;
      EXPECT_FALSE(none.is_below(voltage)) << voltage;
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::axis_test
