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
