// What an axis does beside rendering its wall: excitation, references to an index, the watch over its motion,
// and the record of its trips.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "firmware/drive/axis.hpp"
#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware::axis_excitation_test {
namespace {

constexpr double count_length = 1e-5;  // m
constexpr float transmission = 0.01f;  // m/rad

std::uint32_t at(std::int32_t count) {
  return static_cast<std::uint32_t>(count);
}

AxisSetting setting_of(DriveMode mode) {
  control::HapticLoopConfig<float> haptic;
  haptic.count_length = count_length;
  haptic.force.ramp_time = 0.0f;
  haptic.force.limit = 100.0f;
  haptic.wall.kind = control::WallKind::plain;
  haptic.velocity.kind = control::VelocityEstimatorKind::difference;
  MotorControlConfig motor;
  motor.modulation_limit = 0.88f;
  motor.transmission = transmission;
  motor.torque_constant = 0.03f;
  AxisSetting setting;
  setting.haptic = control::HapticLoop<float>::prepare(haptic, 0);
  setting.motor = MotorControl::prepare(motor);
  setting.supply = SupplyWindow(0.0f, 60.0f);
  setting.generation = 1;
  setting.mode = mode;
  return setting;
}

ExcitationConfig excitation_of(ExcitationKind kind) {
  ExcitationConfig config = excitation_configuration({}, 0);
  config.kind = kind;
  config.bias = 1.0f;
  config.ramp = 0.0f;
  config.travel = 0.001f;  // 100 counts
  config.count_length = count_length;
  return config;
}

class AxisExcitationTest : public testing::Test {
 protected:
  void excite(const ExcitationConfig& config) {
    setting = setting_of(DriveMode::excitation);
    excitation = config;
    setting.excitation = Excitation::prepare(config);
  }
  void begin() {
    ++excitation.run;
    setting.excitation = Excitation::prepare(excitation);
  }
  Axis::Input input(std::int32_t count) const {
    Axis::Input in{};
    in.count = at(count);
    in.count_valid = true;
    in.motor = measured;
    in.reference_generation = reference_generation;
    in.referenced = reference_generation != 0;
    return in;
  }
  Axis::Output tick(std::int32_t count, bool enable) {
    return axis.ISR_tick(setting, input(count), {.enable = enable}, ++ticks);
  }
  Fault fault() const { return axis.ISR_report().fault; }

  Axis axis;
  AxisSetting setting = setting_of(DriveMode::haptic);
  ExcitationConfig excitation;
  MotorControl::Measured measured{true, 24.0f, 0.0f, 0.0f};
  std::uint32_t ticks = 0, reference_generation = 0;
};

TEST_F(AxisExcitationTest, NoWallForceButItsVoltageAndTheEstimatesGoOn) {
  excite(excitation_of(ExcitationKind::voltage));
  tick(-5000, false);
  tick(-5000, true);
  begin();
  const auto out = axis.ISR_tick(setting, input(-4990), {true, 5.0f, 5.0f}, ++ticks);  // deep inside
  EXPECT_TRUE(out.enabled);
  EXPECT_EQ(out.force, 0.0f);
  EXPECT_EQ(axis.ISR_background_force(setting), 0.0f);
  EXPECT_EQ(out.motor.voltage, 1.0f);
  EXPECT_GT(out.motor.duty_b, 0.5f);
  const auto report = axis.ISR_report();
  EXPECT_EQ(report.haptic.force, 0.0f);
  EXPECT_EQ(report.haptic.position, -4990);
  EXPECT_NEAR(report.haptic.velocity, 2.0f, 1e-3f);
  EXPECT_TRUE(report.haptic.inside);
  EXPECT_TRUE(report.motor.excitation_started);
}

TEST_F(AxisExcitationTest, TravelTripsInBothDirectionsFromWhereItWasArmed) {
  for (const std::int32_t direction : {1, -1}) {
    for (const std::int32_t sign : {1, -1}) {
      excite(excitation_of(ExcitationKind::voltage));
      setting.encoder_direction = direction;
      setting.encoder_offset = 333;
      const std::int32_t start = 40'000;
      tick(0, false);
      for (int i = 0; i < 20; ++i) tick(start, false);  // carried here before it is armed
      ASSERT_TRUE(tick(start, true).enabled);
      for (std::int32_t moved = 1; moved <= 100; ++moved) {
        ASSERT_TRUE(tick(start + sign * moved, true).enabled) << moved;
      }
      const auto out = tick(start + sign * 101, true);
      EXPECT_FALSE(out.enabled);
      EXPECT_EQ(out.motor.duty_b, 0.5f);
      EXPECT_EQ(fault(), Fault::excitation_travel);
      EXPECT_NEAR(axis.ISR_report().fault_value, static_cast<float>(direction * sign) * 0.00101f, 1e-7f);
      EXPECT_FALSE(tick(start, true).enabled) << "back again is not enough";
      tick(start, false);
    }
  }
}

// Each arming measures from where it is.
TEST_F(AxisExcitationTest, TravelIsMeasuredAnewFromEachArming) {
  excite(excitation_of(ExcitationKind::voltage));
  tick(0, false);
  for (std::int32_t step = 0; step < 10; ++step) {
    const std::int32_t start = 90 * step;
    ASSERT_TRUE(tick(start, true).enabled);
    ASSERT_TRUE(tick(start + 90, true).enabled);
    tick(start + 90, false);
  }
}

TEST_F(AxisExcitationTest, TravelIsNotWatchedInHapticMode) {
  setting.excitation = Excitation::prepare(excitation_of(ExcitationKind::voltage));
  tick(0, false);
  for (std::int32_t i = 0; i < 1000; ++i) ASSERT_TRUE(tick(i, true).enabled);
}

// Whatever was left in the parameters: nobody has asked for it this time.
TEST_F(AxisExcitationTest, ArmingAloneStartsNothing) {
  for (const ExcitationKind kind :
       {ExcitationKind::voltage, ExcitationKind::current, ExcitationKind::torque, ExcitationKind::position}) {
    auto config = excitation_of(kind);
    config.bias = 2.0f;
    config.stroke = 0.01f;
    config.run = 7;
    axis = Axis();
    excite(config);
    for (const bool seen_before : {false, true}) {
      for (int i = 0; i < 5; ++i) tick(0, false);
      // Even if it comes with the arming itself.
      if (!seen_before) begin();
      for (int i = 0; i < 40; ++i) {
        const auto out = tick(0, true);
        ASSERT_TRUE(out.enabled);
        ASSERT_EQ(out.force, 0.0f);
        ASSERT_EQ(out.motor.current_reference, 0.0f);
        ASSERT_NEAR(out.motor.duty_b, 0.5f, 1e-6f);
        ASSERT_FALSE(out.motor.excitation_started);
        ASSERT_TRUE(out.motor.excitation_finished);
      }
    }
  }
}

TEST_F(AxisExcitationTest, AnotherRunStartsAndLastsForItsDurationOnly) {
  auto config = excitation_of(ExcitationKind::voltage);
  config.duration = 0.001f;  // 20 ticks
  excite(config);
  tick(0, false);
  for (int armed = 0; armed < 3; ++armed) {
    tick(0, true);
    begin();
    for (int i = 0; i < 40; ++i) {
      const auto out = tick(0, true);
      ASSERT_EQ(out.motor.voltage, i < 20 ? 1.0f : 0.0f) << i;
      ASSERT_EQ(out.motor.excitation_started, i == 0);
      ASSERT_EQ(out.motor.excitation_finished, i >= 20);
      ASSERT_TRUE(out.enabled);
    }
    EXPECT_FALSE(tick(0, false).motor.excitation_finished);
  }
}

// A run that was interrupted by disarming or by a trip does not go on, nor does one asked for meanwhile.
TEST_F(AxisExcitationTest, NothingIsLeftOfARunAfterDisarming) {
  excite(excitation_of(ExcitationKind::voltage));
  tick(0, false);
  tick(0, true);
  begin();
  ASSERT_EQ(tick(0, true).motor.voltage, 1.0f);
  tick(0, false);
  for (int i = 0; i < 10; ++i) ASSERT_EQ(tick(0, true).motor.voltage, 0.0f);
  begin();
  ASSERT_EQ(tick(0, true).motor.voltage, 1.0f);
  axis.ISR_trip(Fault::main_loop, input(-1000));
  tick(0, true);
  begin();
  tick(0, true);
  tick(0, false);
  for (int i = 0; i < 10; ++i) ASSERT_EQ(tick(0, true).motor.voltage, 0.0f);
}

TEST_F(AxisExcitationTest, AnotherKindEndsTheRunAndWaitsForTheNext) {
  excite(excitation_of(ExcitationKind::voltage));
  tick(0, false);
  tick(0, true);
  begin();
  ASSERT_EQ(tick(0, true).motor.voltage, 1.0f);
  excitation.kind = ExcitationKind::torque;
  setting.excitation = Excitation::prepare(excitation);
  auto out = tick(0, true);
  EXPECT_EQ(out.motor.current_reference, 0.0f) << "1 V is not 1 A";
  EXPECT_TRUE(out.motor.excitation_finished);
  begin();
  out = tick(0, true);
  EXPECT_TRUE(out.motor.excitation_started);
  EXPECT_EQ(out.motor.current_reference, 1.0f);
  EXPECT_FLOAT_EQ(out.force, 3.0f);
  excitation.kind = ExcitationKind::off;
  setting.excitation = Excitation::prepare(excitation);
  out = tick(0, true);
  EXPECT_EQ(out.motor.current_reference, 0.0f);
  EXPECT_TRUE(out.motor.excitation_finished);
  EXPECT_TRUE(out.enabled);
}

TEST_F(AxisExcitationTest, PositionKindPullsFromWhereTheHandleWas) {
  auto config = excitation_of(ExcitationKind::position);
  config.stiffness = 1000.0f;
  config.damping = 0.0f;
  config.travel = 1.0f;
  config.force_limit = 2.0f;
  excite(config);
  measured.present = false;
  tick(-20'000, false);
  tick(-20'000, true);
  begin();
  EXPECT_EQ(tick(-20'000, true).force, 0.0f);
  EXPECT_NEAR(tick(-20'010, true).force, 0.1f, 1e-5f);
  EXPECT_NEAR(tick(-22'000, true).force, 2.0f, 1e-5f);
  EXPECT_NEAR(axis.ISR_report().force, 2.0f, 1e-5f);
}

// Torque by an angle that nobody knows could be torque the other way, or none.
TEST_F(AxisExcitationTest, WithoutTheRotorsAngleWhatNeedsItAsksForNothing) {
  MotorControlConfig motor;
  motor.modulation_limit = 0.88f;
  motor.transmission = transmission;
  motor.torque_constant = 0.03f;
  for (const MotorKind motor_kind : {MotorKind::pmsm, MotorKind::dc}) {
    for (const bool commutated : {false, true}) {
      for (const ExcitationKind kind : {ExcitationKind::torque, ExcitationKind::position,
                                        ExcitationKind::current, ExcitationKind::voltage}) {
        auto config = excitation_of(kind);
        config.stroke = 0.01f;
        config.speed = 1.0f;
        axis = Axis();
        excite(config);
        motor.kind = motor_kind;
        setting.motor = MotorControl::prepare(motor);
        setting.commutated = commutated;
        tick(0, false);
        tick(0, true);
        begin();
        auto out = tick(0, true);
        const bool by_rotor = kind == ExcitationKind::torque || kind == ExcitationKind::position;
        const bool asks = !by_rotor || commutated || motor_kind == MotorKind::dc;
        ASSERT_EQ(out.motor.excitation_finished, !asks);
        ASSERT_EQ(out.motor.excitation_started, asks);
        out = tick(0, true);
        ASSERT_EQ(out.motor.current_reference != 0.0f || out.motor.voltage != 0.0f, asks);
        ASSERT_EQ(out.force != 0.0f,
                  asks && (by_rotor || (motor_kind == MotorKind::dc && kind == ExcitationKind::current)));
        setting.commutated = true;
        out = tick(0, true);
        ASSERT_EQ(out.motor.excitation_finished, !asks) << "what did not begin does not begin in its midst";
      }
    }
  }
}

TEST_F(AxisExcitationTest, AConfigurationWithoutMeaningTripsAtTheFirstCount) {
  auto config = excitation_of(ExcitationKind::voltage);
  config.bias = std::numeric_limits<float>::quiet_NaN();
  excite(config);
  tick(0, false);
  EXPECT_EQ(tick(0, true).motor.duty_b, 0.5f);
  EXPECT_FALSE(tick(1, true).enabled);
  EXPECT_EQ(fault(), Fault::excitation_travel);
}

TEST_F(AxisExcitationTest, AllOtherTripsStay) {
  excite(excitation_of(ExcitationKind::voltage));
  setting.supply = SupplyWindow(8.0f, 60.0f);
  tick(0, false);
  tick(0, true);
  measured.current_b = 9.0f;
  measured.current_c = -9.0f;
  EXPECT_FALSE(tick(0, true).enabled);
  EXPECT_EQ(fault(), Fault::over_current);
  measured = {true, 7.0f, 0.0f, 0.0f};
  tick(0, false);
  EXPECT_FALSE(tick(0, true).enabled);
  EXPECT_EQ(fault(), Fault::under_voltage);
}

TEST_F(AxisExcitationTest, ReferringToTheIndexMovesThePositionAndNothingElse) {
  tick(0, false);
  for (std::int32_t i = 0; i < 50; ++i) tick(7 * i, false);
  ASSERT_GT(axis.ISR_report().haptic.velocity, 0.5f);
  reference_generation = 1;
  tick(-1000, false);
  EXPECT_TRUE(axis.ISR_changed());
  auto report = axis.ISR_report();
  EXPECT_EQ(report.haptic.position, -1000);
  EXPECT_EQ(report.haptic.velocity, 0.0f);
  EXPECT_EQ(report.counted, -1000);
  EXPECT_EQ(report.reference_generation, 1u);
  EXPECT_TRUE(report.referenced);
  EXPECT_EQ(report.fault, Fault::none);
  tick(-1007, false);
  EXPECT_EQ(axis.ISR_report().haptic.position, -1007) << "continuous from here on";
  EXPECT_NEAR(axis.ISR_report().haptic.velocity, -1.4f, 1e-3f);
  EXPECT_TRUE(tick(-1007, true).enabled);
}

TEST_F(AxisExcitationTest, ReferringAnewWhileDrivenTrips) {
  for (const DriveMode mode : {DriveMode::haptic, DriveMode::excitation}) {
    setting.mode = mode;
    tick(0, false);
    ASSERT_TRUE(tick(0, true).enabled);
    ++reference_generation;
    const auto out = tick(-1000, true);
    EXPECT_FALSE(out.enabled);
    EXPECT_EQ(out.force, 0.0f);
    EXPECT_EQ(fault(), Fault::encoder);
    tick(-1000, false);
    EXPECT_EQ(axis.ISR_report().haptic.position, -1000) << "what is known now is used";
  }
}

// The new origin comes with a count: an invalid one says nothing.
TEST_F(AxisExcitationTest, AReferenceWaitsForAValidCount) {
  tick(500, false);
  reference_generation = 1;
  Axis::Input in = input(-99);
  in.count_valid = false;
  axis.ISR_tick(setting, in, {}, ++ticks);
  EXPECT_EQ(axis.ISR_report().haptic.position, 500);
  tick(-100, false);
  EXPECT_EQ(axis.ISR_report().haptic.position, -100);
  EXPECT_EQ(axis.ISR_report().haptic.velocity, 0.0f);
}

// The measured current makes 6 N, the handle of 50 g is accelerated by 6 N against or along it.
TEST_F(AxisExcitationTest, AMotionAgainstTheForceMadeTripsInHapticModeIfItIsWatched) {
  struct Case {
    bool watched, against;
    DriveMode mode;
  };
  for (const auto& [watched, against, mode] :
       {Case{true, true, DriveMode::haptic}, Case{true, false, DriveMode::haptic},
        Case{false, true, DriveMode::haptic}, Case{true, true, DriveMode::excitation}}) {
    Axis fresh;
    setting = setting_of(mode);
    auto config = excitation_of(ExcitationKind::torque);
    config.travel = 10.0f;
    config.bias = 0.0f;
    setting.excitation = Excitation::prepare(config);
    control::MotionPlausibilityConfig<float> motion;
    motion.hand_force = 1.0f;
    setting.plausibility = control::MotionPlausibility<float>::prepare(motion, Axis::motion_look * 5e-5f);
    setting.watch_motion = watched;
    const float current = against ? 2.0f : -2.0f;
    measured = {true, 24.0f, current, -current};
    double position = 1e5, velocity = 0.0;
    Fault found = Fault::none;
    fresh.ISR_tick(setting, input(100'000), {}, 1);
    for (std::uint32_t i = 2; i < 2000 && found == Fault::none; ++i) {
      velocity -= 6.0 / 0.05 * 5e-5;
      position += velocity * 5e-5 / count_length;
      fresh.ISR_tick(setting, input(static_cast<std::int32_t>(position)), {.enable = true}, i);
      found = fresh.ISR_report().fault;
    }
    const bool trips = watched && against && mode == DriveMode::haptic;
    EXPECT_EQ(found, trips ? Fault::spin_out : Fault::none);
    // Found by a look: there may be more of it than is allowed, by what comes up between two. The handle
    // gains what 6 N give it and should have lost as much.
    const auto most_a_look = static_cast<float>((6.0 + 6.0) * std::abs(velocity) * Axis::motion_look * 5e-5);
    EXPECT_GE(fresh.ISR_report().fault_value, trips ? 0.02f : 0.0f) << "J";
    EXPECT_LE(fresh.ISR_report().fault_value, trips ? 0.02f + most_a_look : 0.0f) << "J";
  }
}

// What an axis keeps of a trip for whoever asks later.
using AxisRecord = AxisExcitationTest;

TEST_F(AxisRecord, TheRecordKeepsWhatWasWhenItTripped) {
  measured = {true, 23.5f, 0.4f, -0.4f};
  tick(1000, false);
  tick(1000, true);
  tick(-1000, true);  // 10 mm inside: 10 N
  ASSERT_FLOAT_EQ(axis.ISR_report().force, 10.0f);
  measured = {true, 23.0f, 9.0f, -9.0f};
  tick(-1002, true);
  TripRecord record = axis.ISR_report().trip;
  EXPECT_EQ(record.fault, Fault::over_current);
  EXPECT_EQ(record.tick, ticks);
  EXPECT_EQ(record.position, -1002);
  EXPECT_NEAR(record.velocity, -0.4f, 1e-4f);
  EXPECT_NEAR(record.force, 10.02f, 1e-4f);
  EXPECT_FLOAT_EQ(record.current, 9.0f);
  EXPECT_NEAR(record.current_reference, 10.02f / 3.0f, 1e-5f);
  EXPECT_FLOAT_EQ(record.supply, 23.0f);
  EXPECT_FLOAT_EQ(record.value, 9.0f);
  for (int i = 0; i < 5; ++i) tick(-5000, true);
  EXPECT_EQ(axis.ISR_report().trip.position, -1002) << "frozen";
  tick(-5000, false);
  EXPECT_EQ(axis.ISR_report().fault, Fault::none);
}

TEST_F(AxisRecord, ATripFromOutsideRecordsTheLastTickUnderForce) {
  measured = {true, 23.5f, 0.4f, -0.4f};
  tick(1000, false);
  tick(-1000, true);
  tick(-1000, true);
  axis.ISR_trip(Fault::main_loop, input(-1000));
  const std::uint32_t tripped = ticks;
  EXPECT_FALSE(tick(-1500, true).enabled);
  const TripRecord record = axis.ISR_report().trip;
  EXPECT_EQ(record.fault, Fault::main_loop);
  EXPECT_EQ(record.tick, tripped);
  EXPECT_EQ(record.position, -1000);
  EXPECT_FLOAT_EQ(record.force, 10.0f);
  EXPECT_FLOAT_EQ(record.current, 0.4f);
  axis.ISR_trip(Fault::encoder, input(-1000));
  EXPECT_EQ(axis.ISR_report().trip.fault, Fault::main_loop) << "the first one counts";
}

// Filling the report is part of the tick: what nobody reads is not copied.
TEST_F(AxisRecord, IsInTheReportOnlyWhileThereIsAFault) {
  AxisReport report;
  report.trip.tick = 99;
  tick(1000, false);
  tick(1000, true);
  axis.ISR_fill(report);
  EXPECT_EQ(report.trip.tick, 99u);
  measured = {true, 23.0f, 9.0f, -9.0f};
  tick(1000, true);
  axis.ISR_fill(report);
  EXPECT_EQ(report.fault, Fault::over_current);
  EXPECT_EQ(report.trip.fault, Fault::over_current);
  EXPECT_EQ(report.trip.tick, ticks);
  EXPECT_EQ(report.fault_value, 9.0f);
  tick(1000, false);
  report.trip.tick = 99;
  axis.ISR_fill(report);
  EXPECT_EQ(report.fault, Fault::none);
  EXPECT_EQ(report.trip.tick, 99u);
}

// What is copied as words is all of it.
TEST_F(AxisRecord, TheReportIsWhatTheTickMade) {
  measured = {true, 24.0f, 0.4f, -0.4f};
  tick(1000, false);
  const auto out = tick(-1000, true);
  const AxisReport report = axis.ISR_report();
  const auto& haptic = axis.ISR_haptic();
  EXPECT_EQ(report.haptic.force, haptic.force);
  EXPECT_EQ(report.haptic.position, -1000);
  EXPECT_EQ(report.haptic.outside_distance, haptic.outside_distance);
  EXPECT_EQ(report.haptic.velocity, haptic.velocity);
  EXPECT_EQ(report.haptic.magnetic_force, haptic.magnetic_force);
  EXPECT_EQ(report.haptic.magnetic_coefficient, haptic.magnetic_coefficient);
  EXPECT_TRUE(report.haptic.inside);
  EXPECT_TRUE(report.haptic.new_sample);
  EXPECT_EQ(report.motor.current, out.motor.current);
  EXPECT_EQ(report.motor.current_reference, out.motor.current_reference);
  EXPECT_EQ(report.motor.force_made, out.motor.force_made);
  EXPECT_EQ(report.motor.current_square, out.motor.current_square);
  EXPECT_EQ(report.motor.saturated, out.motor.saturated);
  EXPECT_EQ(report.counted, -1000);
  EXPECT_EQ(report.tick, ticks);
  EXPECT_EQ(report.force, out.force);
  EXPECT_TRUE(report.enabled && report.count_valid && !report.referenced);
}

}  // namespace
}  // namespace kmax::firmware::axis_excitation_test
