#include "host_tools/bench/winding_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace kmax::bench::winding_model_test {

// The definition's equation in steps of 25 ns, over 100 ticks of a wave.
TEST(WindingModel, FollowsTheEquationAlsoInTheDeadTimesBand) {
  for (const double inductance : {40e-6, 0.4e-3, 4e-3}) {
    for (const double volts : {0.1, 0.3, 3.0}) {
      WindingParameters p;
      p.resistance = 2.0;
      p.inductance = inductance;
      p.dead_time_voltage = 0.12;
      p.dead_time_band = 0.12 / (2.0 * 20e3 * inductance);
      p.offset_voltage = 0.02;
      std::vector<double> voltage;
      for (int k = 0; k < 100; ++k) voltage.push_back((k / 8) % 2 == 0 ? volts : -volts);
      std::vector<double> current(voltage.size());
      p.first_current = 0.05;
      simulate_winding(p, {voltage, {}, 0.0, 50e-6}, current);
      double i = p.first_current, worst = 0.0;
      for (std::size_t k = 1; k + 1 < voltage.size(); ++k) {
        for (int n = 0; n < 2000; ++n) {
          const double v = voltage[n < 1000 ? k - 1 : k];
          const double dead = p.dead_time_voltage * std::clamp(i / p.dead_time_band, -1.0, 1.0);
          i += 25e-9 / inductance * (v - dead - p.offset_voltage - p.resistance * i);
        }
        worst = std::max(worst, std::abs(i - current[k + 1]));
      }
      // In a half tick in which the current changes its sign, dead time acts by the mean instead of the
      // moment.
      const double ticks = inductance / 2.0 / 50e-6;
      EXPECT_LT(worst, 0.06 * std::min(1.0, 1.0 / ticks) + 0.002 * volts) << inductance << " " << volts;
    }
  }
}

TEST(WindingModel, MotionIntegratesTheCurrentAndDiesOut) {
  WindingParameters p;
  p.resistance = 1.0;
  p.inductance = 1e-5;
  p.motion_rate = 50.0;
  p.first_current = 1.0;
  const std::vector<double> voltage(2000, 1.0);
  std::vector<double> current(voltage.size());
  simulate_winding(p, {voltage, {}, 0.0, 50e-6}, current);
  // R-L with e' = 50 i - e / decay: e settles at 50 decay i, so i = 1 / (1 + 50 decay).
  EXPECT_NEAR(current.back(), 1.0 / (1.0 + 50.0 * motion_decay), 1e-3);
}

TEST(WindingModel, NothingToSimulateIsNoAccess) {
  std::vector<double> current;
  simulate_winding({}, {}, current);
  std::vector<double> one{7.0};
  simulate_winding({}, {one, {}, 0.0, 50e-6}, current);
  EXPECT_TRUE(current.empty());
}

}  // namespace kmax::bench::winding_model_test
