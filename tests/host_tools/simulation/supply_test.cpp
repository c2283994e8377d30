#include "host_tools/simulation/supply.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace kmax::simulation::supply_test {

void run(Supply& supply, double current, double duration, double interval = 25e-6) {
  const int steps = static_cast<int>(std::lround(duration / interval));
  for (int n = 0; n < steps; ++n) {
    supply.draw(current * interval);
    supply.advance(interval);
  }
}

TEST(Supply, SagsByResistanceTimesCurrent) {
  Supply supply({24.0, 0.1, 1e-3});
  EXPECT_EQ(supply.voltage(), 24.0);
  run(supply, 10.0, 2e-3);
  EXPECT_NEAR(supply.voltage(), 23.0, 1e-6);
  EXPECT_NEAR(supply.source_current(), 10.0, 1e-5);
  EXPECT_NEAR(supply.source_charge(), 10.0 * 2e-3 - 1e-3 * 1.0, 1e-7);
}

TEST(Supply, OneLongIntervalIsManyShortOnes) {
  for (const double current : {8.0, -3.0}) {
    Supply one({24.0, 0.5, 1e-4}), many({24.0, 0.5, 1e-4});
    one.set_brake(0.5);
    many.set_brake(0.5);
    one.draw(current * 1e-3);
    one.advance(1e-3);
    run(many, current, 1e-3, 1e-6);
    EXPECT_NEAR(one.voltage(), many.voltage(), 1e-10) << current;
    EXPECT_NEAR(one.source_charge(), many.source_charge(), 1e-13) << current;
  }
}

TEST(Supply, BrakingMotorsPumpItUpUnlessItAbsorbs) {
  Supply bench({24.0, 0.05, 1e-3});
  run(bench, -5.0, 1e-3);
  EXPECT_NEAR(bench.voltage(), 24.0 + 5.0 * 1e-3 / 1e-3, 1e-9);
  EXPECT_EQ(bench.source_current(), 0.0);
  SupplyConfig config{24.0, 0.05, 1e-3};
  config.absorbs = true;
  Supply battery(config);
  run(battery, -5.0, 1e-3);
  EXPECT_NEAR(battery.voltage(), 24.25, 1e-6);
  EXPECT_NEAR(battery.source_current(), -5.0, 1e-4);
  // Where it falls back to the source, it stays.
  run(bench, 5.0, 1e-2);
  EXPECT_NEAR(bench.voltage(), 23.75, 1e-6);
}

TEST(Supply, TheBrakeResistorPullsItDown) {
  Supply supply({24.0, 0.05, 1e-3, 2.0});
  run(supply, -5.0, 1e-3);
  ASSERT_NEAR(supply.voltage(), 29.0, 1e-9);
  supply.set_brake(1.0);
  supply.disconnect();
  run(supply, 0.0, 1e-3);
  EXPECT_NEAR(supply.voltage(), 29.0 * std::exp(-0.5), 1e-9);
  EXPECT_NEAR(supply.brake_energy(), 0.5 * 1e-3 * (29.0 * 29.0 - supply.voltage() * supply.voltage()), 1e-8);
  supply.connect();
  run(supply, 0.0, 1e-2);
  EXPECT_NEAR(supply.voltage(), 24.0 * 2.0 / 2.05, 1e-6);
}

TEST(Supply, DisconnectedItRunsEmptyAndNotBelow) {
  Supply supply({24.0, 0.05, 1e-3});
  supply.disconnect();
  run(supply, 10.0, 1e-3);
  EXPECT_NEAR(supply.voltage(), 14.0, 1e-9);
  EXPECT_EQ(supply.source_charge(), 0.0);
  run(supply, 10.0, 2e-3);
  EXPECT_EQ(supply.voltage(), 0.0);
  supply.connect();
  run(supply, 0.0, 1e-2);
  EXPECT_NEAR(supply.voltage(), 24.0, 1e-6);
}

TEST(Supply, AShortCircuitEmptiesItAndStaysFinite) {
  Supply supply({24.0, 0.1, 1e-3});
  run(supply, 1000.0, 1e-2);
  EXPECT_EQ(supply.voltage(), 0.0);
  EXPECT_NEAR(supply.source_current(), 240.0, 1e-9);
}

TEST(Supply, EnergyIsKept) {
  Supply supply({24.0, 0.2, 1e-3});
  double heat = 0.0, out = 0.0;
  for (int n = 0; n < 40000; ++n) {
    const double current = n < 10000 ? 20.0 : n < 20000 ? -10.0 : 5.0;
    supply.set_brake(n < 15000 ? 0.0 : 0.8);
    const double source = supply.source_current(), voltage = supply.voltage();
    supply.draw(current * 1e-7);
    supply.advance(1e-7);
    heat += 0.2 * 0.5 * (source * source + supply.source_current() * supply.source_current()) * 1e-7;
    out += current * 0.5 * (voltage + supply.voltage()) * 1e-7;
  }
  const double stored = 0.5e-3 * (supply.voltage() * supply.voltage() - 24.0 * 24.0);
  EXPECT_NEAR(24.0 * supply.source_charge(), heat + out + stored + supply.brake_energy(), 1e-6);
  EXPECT_GT(supply.brake_energy(), 0.01);
}

TEST(Supply, TheDividerSaturatesTheConverter) {
  Supply supply({24.0, 0.05, 1e-3});
  EXPECT_NEAR(supply.pin_voltage(), 24.0 / 11.0, 1e-15);
  supply.set_voltage(40.0);
  EXPECT_EQ(supply.pin_voltage(), 3.3);
  EXPECT_EQ(supply.voltage(), 40.0);
}

TEST(Supply, RefusesWhatIsNotAllowed) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  Supply supply;
  EXPECT_THROW(supply.draw(nan), std::invalid_argument);
  EXPECT_THROW(supply.advance(0.0), std::invalid_argument);
  EXPECT_THROW(supply.advance(nan), std::invalid_argument);
  EXPECT_THROW(supply.set_brake(1.5), std::invalid_argument);
  EXPECT_THROW(supply.set_brake(nan), std::invalid_argument);
  EXPECT_THROW(supply.set_voltage(-1.0), std::invalid_argument);
  EXPECT_THROW(supply.set_source(nan), std::invalid_argument);
  EXPECT_THROW(Supply(SupplyConfig{24.0, 0.0}), std::invalid_argument);
  EXPECT_EQ(supply.voltage(), 24.0);
}

}  // namespace kmax::simulation::supply_test
