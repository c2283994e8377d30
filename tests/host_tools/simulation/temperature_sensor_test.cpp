#include "host_tools/simulation/temperature_sensor.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "board/odrive_v3/description.hpp"

namespace kmax::simulation::temperature_sensor_test {

// Shares of the reference published for the ODrive v3.6 circuit.
TEST(TemperatureSensor, PinFollowsTheThermistor) {
  TemperatureSensor sensor{board::odrive_v3::description.thermistor};
  const struct {
    double celsius, share;
  } points[] = {{25.0, 0.248}, {50.0, 0.446}, {80.0, 0.665}, {100.0, 0.770}, {120.0, 0.842}};
  for (const auto& point : points) {
    sensor.set_temperature(point.celsius);
    EXPECT_NEAR(sensor.pin_voltage() / 3.3, point.share, 0.001) << point.celsius;
  }
}

TEST(TemperatureSensor, BrokenWiresAreRails) {
  TemperatureSensor sensor{board::odrive_v3::description.thermistor};
  sensor.set_wiring(TemperatureSensor::Wiring::open);
  EXPECT_EQ(sensor.pin_voltage(), 0.0);
  sensor.set_wiring(TemperatureSensor::Wiring::shorted);
  EXPECT_EQ(sensor.pin_voltage(), 3.3);
  sensor.set_wiring(TemperatureSensor::Wiring::intact);
  EXPECT_NEAR(sensor.pin_voltage(), 3.3 * 3300.0 / 13300.0, 1e-12);
}

TEST(TemperatureSensor, RefusesWhatIsNoTemperature) {
  TemperatureSensor sensor{board::odrive_v3::description.thermistor};
  EXPECT_THROW(sensor.set_temperature(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  EXPECT_THROW(sensor.set_temperature(-273.15), std::invalid_argument);
  EXPECT_EQ(sensor.temperature(), 25.0);
}

}  // namespace kmax::simulation::temperature_sensor_test
