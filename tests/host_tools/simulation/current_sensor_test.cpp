#include "host_tools/simulation/current_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace kmax::simulation::current_sensor_test {

using Channel = CurrentSensor::Channel;

TEST(CurrentSensor, VoltsAtThePinAreMiddleAndOffsetAndGainTimesShuntTimesCurrent) {
  CurrentSensorConfig config{.offset_b = 0.010, .offset_c = -0.020};
  CurrentSensor sensor(config);
  EXPECT_NEAR(sensor.sample(Channel::b, 0.0), 1.660, 1e-15);
  EXPECT_NEAR(sensor.sample(Channel::c, 0.0), 1.630, 1e-15);
  EXPECT_NEAR(sensor.sample(Channel::b, 10.0), 1.660 + 0.2, 1e-15);
  EXPECT_NEAR(sensor.sample(Channel::c, -10.0), 1.630 - 0.2, 1e-15);
  sensor.set_gain(80.0);
  EXPECT_NEAR(sensor.sample(Channel::b, 10.0), 1.660 + 0.4, 1e-15);
  EXPECT_EQ(sensor.gain(), 80.0);
}

TEST(CurrentSensor, ClipsAtTheRails) {
  CurrentSensor sensor;
  EXPECT_EQ(sensor.sample(Channel::b, 83.0), 3.3);
  EXPECT_EQ(sensor.sample(Channel::b, -83.0), 0.0);
  EXPECT_LT(sensor.sample(Channel::b, 82.0), 3.3);
}

TEST(CurrentSensor, ShortedInputsShowTheOffsetAlone) {
  CurrentSensor sensor;
  sensor.short_inputs(Channel::b, true);
  EXPECT_EQ(sensor.sample(Channel::b, 50.0), 1.65);
  EXPECT_GT(sensor.sample(Channel::c, 50.0), 2.0);
  sensor.short_inputs(Channel::b, false);
  EXPECT_GT(sensor.sample(Channel::b, 50.0), 2.0);
}

TEST(CurrentSensor, NoiseHasItsSizeAndGrowsWithTheGain) {
  CurrentSensorConfig config{.noise = 10e-6};
  for (const double gain : {10.0, 80.0}) {
    config.gain = gain;
    CurrentSensor sensor(config, 5);
    double sum = 0.0, squares = 0.0;
    constexpr int samples = 40000;
    for (int n = 0; n < samples; ++n) {
      const double error = sensor.sample(Channel::c, 0.0) - 1.65;
      sum += error;
      squares += error * error;
    }
    EXPECT_NEAR(std::sqrt(squares / samples), gain * 10e-6, 0.02 * gain * 10e-6);
    EXPECT_NEAR(sum / samples, 0.0, 4.0 * gain * 10e-6 / std::sqrt(samples));
  }
}

TEST(CurrentSensor, TheSameSeedGivesTheSameNoiseOnEachChannel) {
  CurrentSensorConfig config{.noise = 10e-6};
  CurrentSensor one(config, 7), two(config, 7), other(config, 8);
  int equal = 0;
  for (int n = 0; n < 100; ++n) {
    const double b = one.sample(Channel::b, 1.0);
    EXPECT_EQ(b, two.sample(Channel::b, 1.0));
    two.sample(Channel::c, 1.0);  // how often one channel is read does not change the other
    equal += b == other.sample(Channel::b, 1.0) ? 1 : 0;
  }
  EXPECT_LT(equal, 3);
  EXPECT_NE(one.sample(Channel::b, 1.0), one.sample(Channel::c, 1.0));
}

TEST(CurrentSensor, AnInvertedChannelReadsTheOtherSignAndKeepsItsOffset) {
  CurrentSensorConfig config{.offset_b = 0.01};
  CurrentSensor sensor(config);
  sensor.invert(Channel::b, true);
  EXPECT_NEAR(sensor.sample(Channel::b, 5.0), 1.65 + 0.01 - 0.1, 1e-12);
  EXPECT_NEAR(sensor.sample(Channel::c, 5.0), 1.65 + 0.1, 1e-12);
  sensor.invert(Channel::b, false);
  EXPECT_NEAR(sensor.sample(Channel::b, 5.0), 1.65 + 0.01 + 0.1, 1e-12);
}

// An independent integration of the two low-passes, and the figures of the header.
TEST(CurrentSensor, SettlesAsItsTwoLowPassesDo) {
  for (const double gain : {10.0, 20.0, 40.0, 40.528, 80.0}) {
    const CurrentSensor sensor({.gain = gain});
    const double amplifier = 0.03e-6 * gain / std::log(100.0);
    EXPECT_EQ(sensor.left_after(0.17e-6), 1.0);
    double filtered = 0.0, shown = 0.0;
    constexpr double step = 1e-10;
    for (int n = 1; n <= 30'000; ++n) {
      const double before = filtered;
      filtered += (1.0 - filtered) * (1.0 - std::exp(-step / 0.264e-6));
      shown += (0.5 * (before + filtered) - shown) * (1.0 - std::exp(-step / amplifier));
      if (n % 1000 == 0) {
        ASSERT_NEAR(sensor.left_after(0.178e-6 + n * step), 1.0 - shown, 1e-3) << gain << " " << n;
      }
    }
  }
  const CurrentSensor finest({.gain = 80.0});
  const double dead = 0.125e-6;
  EXPECT_NEAR(finest.left_after(1.5e-6 - dead), 0.20, 0.01);
  EXPECT_NEAR(finest.left_after(2.5e-6 - dead), 0.03, 0.002);
  EXPECT_NEAR(finest.left_after(3.75e-6 - dead), 0.003, 0.0005);
  EXPECT_EQ(CurrentSensor({.filter = 0.0, .settling = 0.0}).left_after(-1e-6), 0.0) << "at once";
  EXPECT_NEAR(CurrentSensor({.filter = 0.0, .settling = 0.03e-6, .delay = 0.0}).left_after(1.2e-6), 0.01,
              1e-9);
}

TEST(CurrentSensor, DriftDrivenOffsetAndGainErrorAreReferredToTheInput) {
  CurrentSensor sensor({.gain = 80.0,
                        .drift_b = 10e-6,
                        .drift_c = -20e-6,
                        .driven_b = 1e-4,
                        .driven_c = -2e-4,
                        .gain_error_b = 0.05,
                        .gain_error_c = -0.01});
  EXPECT_NEAR(sensor.sample(Channel::b, 10.0), 1.65 + 0.4 * 1.05, 1e-12);
  EXPECT_NEAR(sensor.sample(Channel::c, 10.0), 1.65 + 0.4 * 0.99, 1e-12);
  sensor.set_temperature(75.0);
  EXPECT_NEAR(sensor.sample(Channel::b, 0.0), 1.65 + 80 * 500e-6, 1e-12);
  EXPECT_NEAR(sensor.sample(Channel::c, 0.0), 1.65 - 80 * 1000e-6, 1e-12);
  sensor.set_driven(true);
  EXPECT_NEAR(sensor.sample(Channel::b, 0.0), 1.65 + 80 * 600e-6, 1e-12);
  EXPECT_NEAR(sensor.sample(Channel::c, 0.0), 1.65 - 80 * 1200e-6, 1e-12);
}

TEST(CurrentSensor, TheHalvesOfThePeriodHaveNoiseOfTheirOwn) {
  CurrentSensor one({.noise = 10e-6}, 7), two({.noise = 10e-6}, 7);
  for (int n = 0; n < 100; ++n) {
    EXPECT_EQ(one.sample(Channel::b, 0.0), two.sample(Channel::b, 0.0));
    EXPECT_NE(one.sample(Channel::b, 0.0, CurrentSensor::Half::high_sides), two.sample(Channel::b, 0.0));
    static_cast<void>(one.sample(Channel::b, 0.0));
  }
}

TEST(CurrentSensor, RefusesWhatIsNotANumberOrNoSensor) {
  CurrentSensor sensor;
  EXPECT_THROW(sensor.sample(Channel::b, std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  EXPECT_THROW(sensor.set_gain(0.0), std::invalid_argument);
  EXPECT_EQ(sensor.gain(), 40.0);
  for (const CurrentSensorConfig& config :
       {CurrentSensorConfig{.shunt = 0.0}, CurrentSensorConfig{.noise = -1e-6}})
    EXPECT_THROW(CurrentSensor{config}, std::invalid_argument);
}

}  // namespace kmax::simulation::current_sensor_test
