// Axis::ISR_background_force(): what a simulated person answers to is all of the background force, the
// field's and the interference's F_B, and nothing else.
#include <gtest/gtest.h>

#include "firmware/drive/axis.hpp"
#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware::axis_background_test {
namespace {

constexpr std::uint32_t outside = 1000, inside = static_cast<std::uint32_t>(-1000);  // counts of 1 um

class AxisBackground : public testing::Test {
 protected:
  AxisBackground() {
    values.set_real<"device.transmission">(0.15915494309189535f);  // 1 um per count
    values.set_whole<"encoder.counts_per_turn">(1'000'000);
    values.set_real<"force.ramp_time">(0.0f);
    values.set_real<"velocity.limit">(0.0f);
    values.set_real<"force.limit">(20.0f);
    values.set_whole<"interference.mode">(
        static_cast<std::uint32_t>(control::InterferenceMode::perpendicular));
    values.set_real<"interference.force">(5.0f);
    values.set_real<"interference.background_force">(3.0f);
  }
  void take_over() {
    setting.haptic = control::HapticLoop<float>::prepare(haptic_configuration(values, 0), 0);
    setting.generation = 1;
  }
  Axis::Output tick(std::uint32_t count, bool enable = true) {
    return axis.ISR_tick(setting, {count, true}, {.enable = enable}, ++ticks);
  }
  float background(std::uint32_t count, bool enable = true) {
    tick(count, enable);
    return axis.ISR_background_force(setting);
  }
  /// Samples inside until the background force is there, at most `most`; the one before it has none.
  int onset(int most) {
    for (int sample = 0; sample < most; ++sample)
      if (background(inside) != 0.0f) return sample;
    return most;
  }

  ParameterValues values;
  AxisSetting setting;
  Axis axis;
  std::uint32_t ticks = 0;
};

TEST_F(AxisBackground, PerpendicularIsEverywhereAndWithoutTheInterferenceForce) {
  take_over();
  EXPECT_EQ(tick(outside).force, 3.0f);
  EXPECT_EQ(background(outside), 3.0f);
  EXPECT_NEAR(tick(inside).force, 9.0f, 1e-5f) << "spring, F_I and F_B";
  EXPECT_EQ(background(inside), 3.0f);
  EXPECT_EQ(background(outside), 3.0f);
}

TEST_F(AxisBackground, TheFieldAndTheInterferenceAddUp) {
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::magnetic));
  values.set_real<"wall.magnetic_coefficient">(2.0f);
  values.set_real<"wall.magnetic_length">(0.001f);
  take_over();
  EXPECT_NEAR(background(outside), 3.0f + 0.5f, 1e-5f);
  EXPECT_NEAR(background(inside), 3.0f + 2.0f, 1e-5f);
  EXPECT_EQ(axis.ISR_report().haptic.magnetic_force, 2.0f) << "a reading of its own";
}

TEST_F(AxisBackground, ParallelSetsInAtItsOnsetAndAnewAtEachContact) {
  values.set_whole<"interference.mode">(static_cast<std::uint32_t>(control::InterferenceMode::parallel));
  values.set_real<"interference.onset_time">(0.002f);
  take_over();
  for (int contact = 0; contact < 2; ++contact) {
    EXPECT_EQ(background(outside), 0.0f);
    EXPECT_EQ(onset(100), 40) << "2 ms at 20 kHz";
    EXPECT_EQ(background(inside), 3.0f);
  }
}

TEST_F(AxisBackground, IsHeldBetweenHapticSamplesAsTheForceIs) {
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::magnetic));
  values.set_real<"haptic.rate">(2000.0f);
  take_over();
  const float far = background(outside);
  ASSERT_TRUE(axis.ISR_haptic().new_sample);
  for (int held = 0; held < 9; ++held) EXPECT_EQ(background(inside), far) << held;
  EXPECT_GT(background(inside), far);
}

TEST_F(AxisBackground, PullsInWhenItIsNegative) {
  values.set_real<"interference.background_force">(-3.0f);
  take_over();
  EXPECT_EQ(tick(outside).force, -3.0f);
  EXPECT_EQ(background(outside), -3.0f);
}

TEST_F(AxisBackground, IsThereOnlyWhileTheAxisIsDriven) {
  take_over();
  EXPECT_EQ(background(outside, false), 0.0f);
  EXPECT_EQ(background(outside), 3.0f);
  axis.ISR_tick(setting, {outside, false}, {.enable = true}, ++ticks);
  EXPECT_EQ(axis.ISR_background_force(setting), 0.0f) << "it has tripped";
  EXPECT_EQ(background(outside), 0.0f);
}

TEST_F(AxisBackground, WithoutInterferenceItIsTheFieldAlone) {
  values.set_whole<"interference.mode">(static_cast<std::uint32_t>(control::InterferenceMode::none));
  take_over();
  EXPECT_EQ(background(inside), 0.0f);
  EXPECT_NEAR(tick(inside).force, 1.0f, 1e-5f);
}

}  // namespace
}  // namespace kmax::firmware::axis_background_test
