#include "board/power/current_sensors.hpp"

#include <gtest/gtest.h>

#include "board/power/sample_hold.hpp"

namespace kmax::board::current_sensors_test {
namespace {

constexpr float shunt = 0.5e-3f;
constexpr auto gain = drivers::CurrentSenseGain::x80;

struct Sample {
  std::uint16_t phase_b = 2048, phase_c = 2048;
  bool valid = true;
};

struct Amperes {
  float b, c;
};

class CurrentSensorsTest : public testing::Test {
 protected:
  Amperes read(const Sample& sample) {
    const SampleHold::Action action = samples.ISR_take(0);
    if (action.calibrate) sensors.ISR_calibrate(sample.valid, sample.phase_b, sample.phase_c);
    return {sensors.ISR_amperes_b(sample.phase_b), sensors.ISR_amperes_c(sample.phase_c)};
  }
  OffsetProgress calibrate(const Sample& sample, int count = 1024) {
    sensors.restart_calibration(gain);
    samples.set_calibrating(true);
    for (int n = 0; n < count; ++n) read(sample);
    samples.set_calibrating(false);
    return sensors.calibration_progress();
  }

  SampleHold samples;
  CurrentSensors sensors{shunt};
};

TEST_F(CurrentSensorsTest, EitherPhaseBeyondTheLinearCodesIsSaturated) {
  EXPECT_TRUE(sensors.ISR_saturated(4095, 2048));
  EXPECT_TRUE(sensors.ISR_saturated(2048, 0));
  EXPECT_FALSE(sensors.ISR_saturated(2048, 2048));
}

TEST_F(CurrentSensorsTest, TheCalibratedOffsetIsZeroCurrent) {
  EXPECT_EQ(calibrate({2100, 2000}, 1023), OffsetProgress::running);
  EXPECT_EQ(calibrate({2100, 2000}), OffsetProgress::accepted);
  EXPECT_NE(read({2100, 2000}).b, 0.0f) << "not before it is taken";
  sensors.take_calibration();
  EXPECT_EQ(read({2100, 2000}).b, 0.0f);
  EXPECT_EQ(read({2100, 2000}).c, 0.0f);
}

TEST_F(CurrentSensorsTest, EitherPhaseOutOfItsWindowIsRefused) {
  const auto off = static_cast<std::uint16_t>(2049 + drivers::offset_window(gain));
  EXPECT_EQ(calibrate({off, 2048}), OffsetProgress::refused);
  EXPECT_EQ(calibrate({2048, off}), OffsetProgress::refused);
}

// A converter that was late while the offsets are measured, and a line that is disturbed meanwhile.
TEST_F(CurrentSensorsTest, ALateSampleIsNoneOfTheCalibrations) {
  sensors.restart_calibration(gain);
  samples.set_calibrating(true);
  for (int n = 0; n < 1023; ++n) read({});
  samples.ISR_invalidate(0);
  read({.phase_b = 4095, .valid = false});
  EXPECT_EQ(sensors.calibration_progress(), OffsetProgress::running);
  read({});
  EXPECT_EQ(sensors.calibration_progress(), OffsetProgress::accepted);
}

TEST_F(CurrentSensorsTest, AnOffsetIsTrackedUntilItLeavesItsWindow) {
  ASSERT_EQ(calibrate({}), OffsetProgress::accepted);
  sensors.take_calibration();
  const auto window = drivers::offset_window(gain);
  for (int n = 0; n < 10'000; ++n)
    ASSERT_TRUE(sensors.track_offsets(static_cast<std::uint16_t>(2048 + window), 2048, gain, false)) << n;
  EXPECT_NEAR(read({static_cast<std::uint16_t>(2048 + window), 2048}).b, 0.0f, 0.02f);
  ASSERT_EQ(calibrate({}), OffsetProgress::accepted);
  sensors.take_calibration();
  int tracked = 0;
  while (sensors.track_offsets(4095, 2048, gain, false)) ASSERT_LT(++tracked, 10'000);
  EXPECT_NEAR(tracked, 16 * window, 16) << "a sixteenth of a code at a time, whatever the code";
}

}  // namespace
TEST(CurrentSensors, OffsetsAreFoundAnewWheneverDrivingBeginsOrEnds) {
  CurrentSensors sensors{shunt};
  sensors.restart_calibration(gain);
  const float code = drivers::CurrentSense{{.shunt_ohm = shunt, .gain = gain}}.ISR_amperes(2049);
  for (int ms = 0; ms < 2000; ++ms) sensors.track_offsets(2048, 2048, gain, false);
  for (const bool driven : {true, false}) {
    const std::uint32_t zero = driven ? 2060 : 2048;
    for (int ms = 0; ms < 60; ++ms) sensors.track_offsets(zero, 2048, gain, driven);
    EXPECT_NEAR(sensors.ISR_amperes_b(2048) / code, driven ? -12.0f + 12.0f / 21.0f : -12.0f / 21.0f, 0.1f)
        << "3 / 63 of 12 codes are left";
  }
}

TEST(CurrentSensors, AStepThatIsNoZerosIsNotTakenInHoweverOftenDrivingBegins) {
  CurrentSensors sensors{shunt};
  sensors.restart_calibration(gain);
  for (int n = 0; n < 10; ++n) {
    for (const bool driven : {true, false}) {
      const std::uint32_t code = driven ? 2108 : 2048;
      for (int ms = 0; ms < 250; ++ms) sensors.track_offsets(2048, code, gain, driven);
      const float taken =
          sensors.offset_c() / drivers::CurrentSense{{.shunt_ohm = shunt, .gain = gain}}.ISR_amperes(2049);
      ASSERT_LE(taken, 16.5f) << n << ", with what was left of the time before";
    }
  }
}

}  // namespace kmax::board::current_sensors_test
