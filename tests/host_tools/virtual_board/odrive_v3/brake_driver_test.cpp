#include "host_tools/virtual_board/odrive_v3/brake_driver.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kmax::virtual_board::brake_driver_test {

BoardTime us(double duration) {
  return static_cast<BoardTime>(duration * static_cast<double>(units_per_microsecond));
}
/// `on` of every `period`, in us, for 20 ms.
BrakeDriver after(double on, double period, const BootstrapConfig& config = {}) {
  BrakeDriver driver(config);
  BoardTime now = 1000;
  for (double t = 0.0; t < 20'000.0; t += period) {
    driver.drive(true, true, now);
    driver.advance(now + us(on));
    driver.drive(false, true, now + us(on));
    now += us(period);
  }
  return driver;
}

TEST(BrakeDriver, TheCapacitorLastsForShortPulsesAlone) {
  const BrakeDriver pulsed = after(44.0, 50.0);
  EXPECT_EQ(pulsed.drop_outs(), 0U);
  // I t / C at 0.2 mA and 9.8 V over 10 kohm, and the gate took its share.
  EXPECT_NEAR(pulsed.lowest(), 10.3 / 1.05 - 44e-6 * (0.2e-3 + 9.8 / 10e3) / 100e-9, 0.03);
  EXPECT_NEAR(pulsed.longest_on(), 44e-6, 0.1e-6);
  const BrakeDriver long_ones = after(950.0, 1000.0);
  EXPECT_GT(long_ones.drop_outs(), 19U);
  EXPECT_LT(long_ones.lowest(), 6.21);
}

TEST(BrakeDriver, LastsLongWithoutTheGuessedResistor) {
  BootstrapConfig config;
  config.gate_resistance = 1e9;
  const BrakeDriver driver = after(950.0, 1000.0, config);
  EXPECT_EQ(driver.drop_outs(), 0U);
  EXPECT_NEAR(driver.lowest(), 10.3 / 1.05 - 1.9, 0.05);
}

TEST(BrakeDriver, ComesBackWhenTheCapacitorHasRecovered) {
  BrakeDriver driver;
  driver.drive(true, true, 0);
  EXPECT_TRUE(driver.on());
  const BoardTime starved = driver.next_event();
  EXPECT_TRUE(driver.advance(starved));
  EXPECT_FALSE(driver.on());
  EXPECT_NEAR(driver.lowest(), 6.2, 0.01);
  EXPECT_TRUE(driver.advance(driver.next_event()));
  EXPECT_TRUE(driver.on()) << "at 6.6 V, as its input still says";
  driver.drive(true, false, starved + us(1.0));
  EXPECT_FALSE(driver.on()) << "without supply";
}

}  // namespace kmax::virtual_board::brake_driver_test
