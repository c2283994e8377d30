// What an axis keeps of a trip for whoever asks later.
#include <gtest/gtest.h>

#include <cstdint>

#include "firmware/drive/axis.hpp"

namespace kmax::firmware::axis_record_test {
namespace {

class AxisRecord : public testing::Test {
 protected:
  AxisRecord() {
    control::HapticLoopConfig<float> haptic;
    haptic.count_length = 1e-5;
    haptic.force.ramp_time = 0.0f;
    haptic.force.limit = 100.0f;
    haptic.wall.kind = control::WallKind::plain;
    haptic.velocity.kind = control::VelocityEstimatorKind::difference;
    MotorControlConfig motor;
    motor.transmission = 0.01f;
    motor.torque_constant = 0.03f;
    setting.haptic = control::HapticLoop<float>::prepare(haptic, 0);
    setting.motor = MotorControl::prepare(motor);
    setting.supply_voltage_max = 60.0f;
    setting.generation = 1;
  }
  Axis::Output tick(std::int32_t count, bool enable) {
    Axis::Input in{};
    in.count = static_cast<std::uint32_t>(count);
    in.count_valid = true;
    in.motor = measured;
    return axis.ISR_tick(setting, in, enable, {}, ++ticks);
  }
  Axis axis;
  AxisSetting setting;
  MotorControl::Measured measured{true, 24.0f, 0.0f, 0.0f};
  std::uint32_t ticks = 0;
};

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
  axis.ISR_trip(Fault::main_loop);
  const std::uint32_t tripped = ticks;
  EXPECT_FALSE(tick(-1500, true).enabled);
  const TripRecord record = axis.ISR_report().trip;
  EXPECT_EQ(record.fault, Fault::main_loop);
  EXPECT_EQ(record.tick, tripped);
  EXPECT_EQ(record.position, -1000);
  EXPECT_FLOAT_EQ(record.force, 10.0f);
  EXPECT_FLOAT_EQ(record.current, 0.4f);
  axis.ISR_trip(Fault::encoder);
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
}  // namespace kmax::firmware::axis_record_test
