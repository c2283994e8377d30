// The force that an axis adds to its wall's: it comes on softly and keeps to the wall's limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "firmware/drive/axis.hpp"

namespace kmax::firmware::axis_compensation_test {
namespace {

class AxisCompensation : public testing::Test {
 protected:
  void prepare(DriveMode mode = DriveMode::haptic) {
    haptic.count_length = 1e-5;
    haptic.wall.kind = control::WallKind::plain;
    haptic.velocity.kind = control::VelocityEstimatorKind::difference;
    MotorControlConfig motor;
    motor.modulation_limit = 0.88f;
    motor.transmission = 0.01f;
    motor.torque_constant = 0.03f;
    setting.haptic = control::HapticLoop<float>::prepare(haptic, 0);
    setting.motor = MotorControl::prepare(motor);
    setting.compensation = control::ForceCompensation<float>::prepare(added);
    setting.supply = SupplyWindow(0.0f, 60.0f);
    setting.generation = 1;
    setting.mode = mode;
  }
  Axis::Output tick(std::int32_t count, bool enable) {
    Axis::Input in{};
    in.count = static_cast<std::uint32_t>(count);
    in.count_valid = true;
    return axis.ISR_tick(setting, in, {.enable = enable}, ++ticks);
  }

  Axis axis;
  AxisSetting setting;
  control::HapticLoopConfig<float> haptic;
  control::ForceCompensationConfig<float> added;
  std::uint32_t ticks = 0;
};

TEST_F(AxisCompensation, ComesOnTopOnlyWhileDrivenInHapticMode) {
  haptic.force.ramp_time = 0.0f;
  added.gravity_constant = -5.0f;  // makes +5 N, bounded
  added.limit = 0.2f;
  prepare();
  EXPECT_EQ(tick(1000, false).force, 0.0f);
  EXPECT_EQ(tick(1000, false).force, 0.0f);
  EXPECT_EQ(tick(1000, true).force, 0.2f);
  EXPECT_NEAR(tick(1000, true).motor.current_reference, 0.2f / 3.0f, 1e-6f);
  EXPECT_EQ(axis.ISR_report().force, 0.2f);
  EXPECT_EQ(axis.ISR_report().haptic.force, 0.0f);
  prepare(DriveMode::excitation);
  tick(1000, false);
  EXPECT_EQ(tick(1000, true).force, 0.0f);
}

TEST_F(AxisCompensation, GoesByTheShaftsAngle) {
  haptic.force.ramp_time = 0.0f;
  haptic.force.limit = 100.0f;
  added.gravity_cosine = 0.5f;
  added.limit = 10.0f;
  prepare();
  for (const std::int32_t count : {0, 1024, 2048, 4096, 8192, -2048, 81920}) {
    for (int i = 0; i < 4; ++i) tick(count, false);
    const double angle = 6.283185307179586 * count / 8192.0;
    const auto out = tick(count, true);
    EXPECT_NEAR(out.force - axis.ISR_haptic().force, -0.5 * std::cos(angle), 2e-3) << count;
  }
}

TEST_F(AxisCompensation, AForceLimitOfZeroLetsNothingPass) {
  haptic.force.limit = 0.0f;
  added.gravity_constant = -5.0f;
  added.limit = 2.0f;
  prepare();
  tick(1000, false);
  for (int i = 0; i < 10'000; ++i) {
    const auto out = tick(1000, true);
    ASSERT_EQ(out.force, 0.0f) << i;
    ASSERT_EQ(out.motor.current_reference, 0.0f) << i;
  }
}

// Deep in the wall both push outwards, or they push against each other.
TEST_F(AxisCompensation, TheSumKeepsToTheForceLimit) {
  for (const float gravity : {-2.0f, 2.0f}) {
    axis = Axis();
    haptic.force.ramp_time = 0.0f;
    haptic.force.limit = 3.3f;
    added.gravity_constant = gravity;
    added.limit = 2.0f;
    prepare();
    tick(0, false);
    EXPECT_NEAR(tick(-200, true).force, std::min(3.3f, 2.0f - gravity), 1e-6f);
    EXPECT_FLOAT_EQ(tick(-100'000, true).force, gravity < 0.0f ? 3.3f : 1.3f);
    EXPECT_LE(axis.ISR_report().force, 3.3f);
  }
}

TEST_F(AxisCompensation, ComesWithTheSoftStartAtEveryHapticRate) {
  for (const std::uint32_t divider : {1U, 40U}) {
    axis = Axis();
    haptic.force.ramp_time = 0.2f;
    haptic.divider = divider;
    added.gravity_constant = -2.0f;
    added.limit = 2.0f;
    prepare();
    for (int armed = 0; armed < 3; ++armed) {
      // Arming comes anywhere between two haptic samples.
      for (int i = 0; i < 57; ++i) tick(1000, false);
      float last = 0.0f;
      for (int i = 0; i < 5000; ++i) {
        const float force = tick(1000, true).force;
        ASSERT_LE(force, 2.0f * static_cast<float>(i + static_cast<int>(divider)) / 4000.0f + 1e-4f) << i;
        ASSERT_GE(force, last);
        last = force;
      }
      EXPECT_EQ(last, 2.0f);
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::axis_compensation_test
