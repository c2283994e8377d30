#include "control/current_loop_delay.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "control/current_loop_gains.hpp"

namespace kmax::control::current_loop_delay_test {

constexpr double rate = 20000.0;

/// How far the winding's mean current lies behind a command that grows by one ampere per tick, in ticks,
/// without the half tick of the hold. `decay`: R T/2L.
double lag_behind_a_ramp(double bandwidth, double decay) {
  const double resistance = 0.7, inductance = resistance / (rate * 2.0 * decay);
  const auto gains = CurrentLoopGains<double>::prepare(resistance, inductance, bandwidth, 1.0 / rate);
  const double half = std::exp(-decay), lost = -std::expm1(-decay);
  double current = 0.0, voltage_before = 0.0, integral = 0.0, mean = 0.0, command = 0.0;
  const int ticks = static_cast<int>(60.0 * rate / bandwidth) + 50;
  for (int k = 0; k < ticks; ++k, command += 1.0) {
    const double step = gains.proportional * (command - current);
    const double voltage = step + integral;
    integral += gains.tracking * step;
    // A resistance against an inductance under a constant voltage, twice half a tick.
    const auto half_tick = [&](double applied) {
      const double end = applied / resistance, from = current;
      current = half * from + lost * end;
      return end + (from - end) * lost / decay;  // its mean
    };
    mean = 0.5 * half_tick(voltage_before);
    mean += 0.5 * half_tick(voltage);
    voltage_before = voltage;
  }
  // Of the tick that began with the command before the last increment; the held command's mean is itself.
  return (command - 1.0) - mean;
}

TEST(CurrentLoopDelay, IsNeverShorterThanThatOfTheDiscreteLoop) {
  double least = 1.0, most = 0.0;
  for (double bandwidth = 200.0; bandwidth < 15707.0; bandwidth *= 1.13) {
    for (double decay = 2e-3; decay < 30.0; decay *= 1.5) {
      const double spare = current_loop_delay(bandwidth, rate) * rate - lag_behind_a_ramp(bandwidth, decay);
      EXPECT_GT(spare, 0.0) << bandwidth << " rad/s, R T/2L " << decay;
      least = std::min(least, spare);
      most = std::max(most, spare);
    }
  }
  EXPECT_LT(least, 0.06) << "the constant is no larger than it must be";
  EXPECT_LT(most, 0.75);
}

TEST(CurrentLoopDelay, OneOverTheBandwidthAloneFallsShort) {
  EXPECT_GT(lag_behind_a_ramp(9590.0, 2e-3), rate / 9590.0 + 0.6);
}

TEST(CurrentLoopDelay, KnownNumbers) {
  EXPECT_DOUBLE_EQ(current_loop_delay(4000.0, 20000.0), 282.5e-6);
  EXPECT_FLOAT_EQ(current_loop_delay(1000.0f, 20000.0f), 1032.5e-6f);
}

}  // namespace kmax::control::current_loop_delay_test
