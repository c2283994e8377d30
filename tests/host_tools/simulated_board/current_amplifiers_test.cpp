#include "host_tools/simulated_board/simulated_power.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <variant>

#include "tests/host_tools/simulated_board/motor_bench.hpp"

namespace kmax::simulated_board::current_amplifiers_test {

using firmware::Fault;
using simulation::Defect;

/// A blocked motor at a gain of 80 whose wall asks for `force`, N.
struct SenseBench : MotorBench {
  explicit SenseBench(const simulation::CurrentSensorConfig& sensor, double force = 2.0,
                      double resistance = 2.3, const char* name = "dc_coreless_a")
      : MotorBench(scene_of(sensor, resistance, name)) {
    drives().plant(0, Defect::motor_blocked);
    set<"current.limit">(5.0);
    set<"force.limit">(20.0);
    prepare_wall(force < 0.0 ? -1.0 : 1.0);
    EXPECT_EQ(power().gain(), drivers::CurrentSenseGain::x80);
    EXPECT_TRUE(arm()) << firmware::to_string(application().refusal(0));
    set_wall_force(std::abs(force));
    run(0.05);
  }
  void heat(double from, double to, double rate) {
    constexpr double step = 0.01;
    const int steps = static_cast<int>(std::lround((to - from) / (rate * step)));
    for (int n = 1; n <= steps; ++n) {
      drive().current_sensor().set_temperature(from + n * rate * step);
      run(step);
    }
  }
  double current() { return drive().currents()[simulation::terminal_b]; }
  /// A, what the firmware measures, less what makes the force; the mean of 0.1 s.
  double error() {
    const double newton_per_ampere =
        static_cast<double>(application().values().real<"motor.torque_constant">(0)) /
        drive().encoder().config().transmission;
    double sum = 0.0;
    for (int n = 0; n < 2000; ++n) {
      tick();
      sum += static_cast<double>(report().motor.current) - current_force() / newton_per_ampere;
    }
    return sum / 2000;
  }

 private:
  static simulation::Scene scene_of(const simulation::CurrentSensorConfig& sensor, double resistance,
                                    const char* name) {
    simulation::Scene scene = identified(name);
    scene.axes[0].current_sensor = sensor;
    if (auto* brushed = std::get_if<simulation::BrushedDcMotorConfig>(&*scene.axes[0].motor))
      brushed->resistance = resistance;
    return scene;
  }
};

// The DRV8301's amplifiers may be off by 4 mV at their inputs.
TEST(CurrentAmplifiers, AreAcceptedWithinTheirDataSheetAtEveryGain) {
  struct Case {
    double limit, gain;
  };
  for (const auto& [limit, gain] : {Case{5.0, 80.0}, Case{30.0, 40.0}, Case{60.0, 20.0}, Case{120.0, 10.0}}) {
    for (const double millivolt : {3.9, -3.9, 6.0}) {
      SCOPED_TRACE(testing::Message() << millivolt << " mV, gain " << gain);
      simulation::Scene scene = identified("dc_coreless_a");
      scene.axes[0].current_sensor.offset_c = millivolt * 1e-3 * gain;
      MotorBench bench(scene);
      bench.set<"current.limit">(limit);
      bench.set<"wall.law">(0);
      bench.run(0.2);
      EXPECT_EQ(bench.drive().current_sensor().gain(), gain);
      EXPECT_EQ(bench.arm(), std::abs(millivolt) < 4.0);
    }
  }
}

TEST(CurrentAmplifiers, ABoardThatWarmsUpKeepsItsForceAndDoesNotTrip) {
  for (const double c_against_b : {1.0, -1.0}) {
    SenseBench bench({.drift_b = 10e-6, .drift_c = c_against_b * 10e-6});
    bench.heat(25.0, 65.0, 2.0);
    ASSERT_TRUE(bench.armed()) << firmware::text_of(bench.application().fault(0)).name;
    EXPECT_NEAR(bench.error(), 0.0, 0.02) << "a code; the drift alone is 0.8 A";
    EXPECT_NEAR(bench.current_force(), 2.0, 0.06);
  }
  SenseBench synchronous({}, 2.0, 0.0, "gimbal_a");
  synchronous.heat(25.0, 65.0, 2.0);
  ASSERT_TRUE(synchronous.armed());
  EXPECT_NEAR(synchronous.error(), 0.0, 0.02);
}

// All at once, and at the largest current.
TEST(CurrentAmplifiers, TheWorstBoardDoesNotTrip) {
  for (const double sign : {1.0, -1.0}) {
    SenseBench bench({.noise = 5e-6,
                      .offset_b = 0.25,
                      .offset_c = -0.25,
                      .drift_b = 15e-6,
                      .drift_c = 15e-6,
                      .driven_b = sign * 0.1e-3,
                      .driven_c = sign * 0.1e-3,
                      .gain_error_b = 0.03,
                      .gain_error_c = -0.03},
                     sign * 11.5);
    EXPECT_NEAR(bench.current(), sign * 4.9, 0.25);
    bench.heat(25.0, 85.0, 3.0);
    EXPECT_TRUE(bench.armed()) << firmware::text_of(bench.application().fault(0)).name;
    EXPECT_NEAR(bench.error(), 0.0, 0.05);
  }
}

// 0.1 mV are 0.2 A at once when driving begins, and 0.8 N of a small gimbal motor.
TEST(CurrentAmplifiers, TheZeroThatDrivingMovesIsFoundInMilliseconds) {
  for (const double sign : {1.0, -1.0}) {
    SenseBench bench({.driven_b = sign * 0.1e-3, .driven_c = -sign * 0.1e-3});
    EXPECT_NEAR(bench.error(), 0.0, 0.01) << "the mean from 50 to 150 ms behind arming";
    bench.set_wall_force(0.0);
    bench.disarm(0);
    bench.run(0.05);
    ASSERT_TRUE(bench.arm());
    bench.run(0.05);
    EXPECT_NEAR(bench.error(), 0.0, 0.01);
  }
}

// 0.6 mV, 60 codes, are no zero that driving moves, even where the sum's watch takes 17 ms for its verdict.
TEST(CurrentAmplifiers, ASensorThatFailsWhenDrivingBeginsIsNotTakenForAZeroThatMoves) {
  simulation::Scene scene = identified("dc_coreless_a");
  for (const double driven : {0.6e-3, -0.6e-3}) {
    scene.axes[0].current_sensor.driven_c = driven;
    MotorBench bench(scene);
    bench.set<"current.limit">(5.0);
    bench.set<"current.bandwidth">(300.0);
    bench.set<"wall.law">(0);
    bench.run(0.2);
    ASSERT_EQ(bench.drive().current_sensor().gain(), 80.0);
    ASSERT_TRUE(bench.arm());
    bench.run(0.1);
    EXPECT_FALSE(bench.armed());
    EXPECT_EQ(bench.application().fault(0), Fault::current_sum);
  }
}

TEST(CurrentAmplifiers, AnOffsetThatLeavesItsWindowTakesTheForceAway) {
  SenseBench bench({.offset_b = 0.3, .drift_b = 20e-6});
  bench.heat(25.0, 35.0, 5.0);
  EXPECT_TRUE(bench.armed()) << "3.95 mV";
  bench.heat(35.0, 60.0, 5.0);
  EXPECT_FALSE(bench.armed()) << "4.45 mV";
  EXPECT_EQ(bench.application().fault(0), Fault::current_sense);
  bench.clear();
  EXPECT_FALSE(bench.arm()) << "it stays where it is";
  bench.drive().current_sensor().set_temperature(25.0);
  bench.run(0.5);
  bench.clear();
  bench.set_wall_force(0.0);
  EXPECT_TRUE(bench.arm());
}

// 24 V and 4.5 ohm: what the bridge can give is not enough for 5 A.
TEST(CurrentAmplifiers, TheCurrentIsTrueAtTheLargestDuty) {
  for (const double sign : {1.0, -1.0}) {
    SenseBench bench({}, sign * 11.0, 4.5);
    ASSERT_TRUE(bench.armed()) << firmware::text_of(bench.application().fault(0)).name;
    EXPECT_GT(sign * bench.current(), 3.8);
    EXPECT_LT(sign * bench.current(), 4.5) << "by the supply";
    bench.run(1.0);  // until the zero has gone as far as it goes, which settles no better
    EXPECT_NEAR(bench.error() / bench.current(), 0.0, 0.013);
  }
}

}  // namespace kmax::simulated_board::current_amplifiers_test
