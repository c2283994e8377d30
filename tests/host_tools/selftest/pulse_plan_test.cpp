#include "host_tools/selftest/pulse.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace kmax::selftest::pulse_plan_test {

/// m: largest span of a free handle without friction whose current follows the square wave at once.
double span(const AxisFacts& facts, const Pulse& pulse, double current) {
  double velocity = 0.0, position = 0.0, lowest = 0.0, highest = 0.0;
  for (std::uint32_t k = 0; k < pulse.duration; ++k) {
    const double ramp = pulse.ramp == 0 ? 1.0 : std::min(1.0, static_cast<double>(k) / pulse.ramp);
    const double sign = k / pulse.half_period % 2 == 0 ? 1.0 : -1.0;
    const double acceleration = sign * ramp * current * facts.free_acceleration();
    position += velocity * facts.tick + 0.5 * acceleration * facts.tick * facts.tick;
    velocity += acceleration * facts.tick;
    lowest = std::min(lowest, position);
    highest = std::max(highest, position);
  }
  return highest - lowest;
}

TEST(PulsePlan, StaysWithinTheDisplacementForAllMotors) {
  for (const double mass : {0.02, 0.2, 1.0}) {
    for (const double transmission : {0.003, 0.01, 0.05}) {
      for (const double current : {0.1, 1.0, 20.0}) {
        AxisFacts facts;
        facts.mass = mass;
        facts.transmission = transmission;
        const Pulse pulse = plan_pulse(facts, current, 0.1e-3, 24.0);
        EXPECT_LE(span(facts, pulse, pulse.voltage / facts.resistance), 0.101e-3);
        EXPECT_GE(pulse.half_period, 5U);
        EXPECT_LE(pulse.voltage, 0.4 * 24.0);
        const Pulse swing = plan_swing(facts, current, 0.25e-3, 24.0);
        // The ramp lets it drift a little.
        EXPECT_LE(span(facts, swing, swing.voltage / facts.resistance), 2.0 * 0.25e-3);
        EXPECT_GE(swing.half_period, 10U);
      }
    }
  }
}

TEST(PulsePlan, ASwingEndsAlmostAtRest) {
  AxisFacts facts;
  const Pulse swing = plan_swing(facts, 1.0, 0.25e-3, 24.0);
  EXPECT_EQ(swing.duration % swing.half_period, swing.half_period - swing.half_period / 2);
}

}  // namespace kmax::selftest::pulse_plan_test
