#include "host_tools/simulated_board/simulated_power.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/host_tools/simulated_board/motor_bench.hpp"

namespace kmax::simulated_board::simulated_power_test {

using firmware::Fault;
using firmware::Refusal;
using simulation::Defect;

// The whole loop of each supplied motor, told the truth: the force that the wall asks for arrives, within the
// steps of the converter, and so fast as current.bandwidth says. Also at other places of the turn, where a
// wrong electrical angle would show, and to the other side.
TEST(SimulatedPower, TheForceOfTheWallArrivesThroughEveryMotor) {
  struct Case {
    const char* name;
    double start = 0.0, side = 1.0;
  };
  for (const auto& [name, start, side] :
       {Case{"dc_coreless_a"}, Case{"dc_coreless_b"}, Case{"gimbal_a"}, Case{"gimbal_b"}, Case{"drone"},
        Case{"dc_coreless_a", 0.0, -1.0}, Case{"gimbal_a", 0.0011}, Case{"gimbal_a", 0.0047, -1.0},
        Case{"gimbal_b", 0.03}}) {
    SCOPED_TRACE(testing::Message() << name << " at " << start << " side " << side);
    simulation::Scene scene = identified(name);
    scene.axes[0].start.position = start;
    MotorBench bench(scene);
    bench.drives().plant(0, Defect::motor_blocked);
    bench.prepare_wall(side);
    ASSERT_TRUE(bench.arm()) << firmware::to_string(bench.application().refusal(0));
    bench.run(0.01);
    EXPECT_NEAR(bench.current_force(), 0.0, 0.12);
    for (const double force : {2.0, 0.5, 3.0}) {
      bench.set_wall_force(force);
      bench.run(0.01);
      double sum = 0.0, squares = 0.0;
      constexpr int ticks = 4000;
      for (int n = 0; n < ticks; ++n) {
        bench.tick();
        const double made = side * bench.current_force();
        sum += made;
        squares += made * made;
      }
      const double mean = sum / ticks;
      EXPECT_NEAR(static_cast<double>(bench.report().haptic.force), side * force, 1e-3);
      EXPECT_NEAR(mean, force, 0.015);
      EXPECT_LT(squares / ticks - mean * mean, 0.05 * 0.05) << "ripple";
    }
    EXPECT_TRUE(bench.armed());
  }
}

TEST(SimulatedPower, AStepOfTheForceRisesWithTheBandwidth) {
  for (const char* name : calibration_scenes) {
    MotorBench bench(identified(name));
    bench.drives().plant(0, Defect::motor_blocked);
    bench.set<"current.bandwidth">(2000.0);
    // Without it the drone motor's current crosses the dead time's band slowly: 17 ticks.
    bench.set<"compensation.dead_time">(125e-9);
    bench.prepare_wall();
    ASSERT_TRUE(bench.arm()) << name;
    bench.run(0.01);
    const double begin = bench.current_force();
    bench.set_wall_force(3.0);
    bench.tick();  // the tick that still knows the old settings
    int ticks = 0;
    while (bench.current_force() < begin + 0.632 * (3.0 - begin) && ticks < 1000) bench.tick(), ++ticks;
    // 1 / bandwidth is 10 ticks; sampling, the half tick of the PWM and the mean of the last half tick are
    // two.
    EXPECT_NEAR(ticks, 11, 3) << name;
  }
}

TEST(SimulatedPower, TheSameSceneGivesTheSameBits) {
  const auto record = [](std::uint64_t seed) {
    simulation::Scene scene = identified("gimbal_b");
    scene.seed = seed;
    MotorBench bench(scene);
    bench.prepare_wall();
    EXPECT_TRUE(bench.arm());
    bench.set_wall_force(1.0);
    std::vector<double> forces;
    for (int n = 0; n < 2000; ++n) {
      bench.tick();
      forces.push_back(bench.drive().force());
    }
    return forces;
  };
  const auto first = record(14);
  EXPECT_EQ(first, record(14));
  EXPECT_NE(first, record(15)) << "the noise has another seed";
}

TEST(SimulatedPower, IsReadyWhenTheOffsetsAreMeasured) {
  MotorBench bench(identified("gimbal_a"));
  bench.run(0.07);
  EXPECT_FALSE(bench.arm());
  EXPECT_EQ(bench.application().refusal(0), Refusal::power_stage_not_ready);
  bench.set<"wall.law">(0);
  bench.run(0.01);
  EXPECT_TRUE(bench.arm());
}

simulation::Scene both_axes(std::size_t missing) {
  simulation::Scene scene = open_scene("motor_axes");
  scene.axes[missing].defects.push_back(Defect::gate_driver_missing);
  return scene;
}

// Its converter's pins float, so its offsets would never be accepted; the other axis renders all the same.
TEST(SimulatedPower, AnAxisWhoseGateDriverNeverAnswersIsAbsentAndTheOtherRenders) {
  for (const std::size_t missing : {0U, 1U}) {
    const std::size_t there = 1 - missing;
    MotorBench bench(both_axes(missing));
    bench.set<"wall.law">(0, missing);
    bench.run(0.4);
    EXPECT_FALSE(bench.arm(there));
    EXPECT_EQ(bench.application().refusal(there), Refusal::power_stage_not_ready) << "it is still tried";
    bench.run(0.3);
    EXPECT_FALSE(bench.arm(missing));
    EXPECT_EQ(bench.application().refusal(missing), Refusal::axis_absent);
    if (there == 1) bench.set<"motor.calibrated">(1, there);
    ASSERT_TRUE(bench.arm(there)) << firmware::to_string(bench.application().refusal(there));
    bench.run(1.0);
    EXPECT_TRUE(bench.armed(there));
    EXPECT_GT(bench.report(there).haptic.force, 0.3f) << "the wall";
    EXPECT_EQ(bench.application().fault(missing), Fault::none);
    bench.application().refresh_readings();
    EXPECT_EQ(bench.application().values().whole<"drive.presence">(missing), 1);
    EXPECT_EQ(bench.application().values().whole<"drive.presence">(there), 0);
  }
}

TEST(SimulatedPower, AGateDriverThatFallsSilentLaterIsAFaultOfTheBoard) {
  MotorBench bench(open_scene("motor_axes"));
  bench.run(0.3);
  bench.drives().plant(1, Defect::gate_driver_missing);
  bench.power().set_gate_driver_fault(true);
  bench.power().set_gate_driver_fault(false);
  bench.run(2.0);
  for (const std::size_t axis : {0U, 1U}) {
    EXPECT_FALSE(bench.arm(axis));
    EXPECT_EQ(bench.application().refusal(axis), Refusal::power_stage_not_ready);
  }
}

/// A hand turns the motor of an axis with up to so many m/s at the handle, or holds it.
void turn(MotorBench& bench, double speed, std::size_t axis = 0) {
  bench.drive(axis).hold(speed == 0.0);
  bench.drive(axis).push(20.0 * speed, speed == 0.0 ? 0.0 : 20.0);
}

// DRV8301: it does not start while a phase is above 8.5 V, which a motor that is turned makes.
TEST(SimulatedPower, AGateDriverThatIsResetWhileItsMotorIsTurnedFastStartsWhenItStands) {
  struct Turned {
    double speed, limit;
    bool starts;
  };
  for (const auto& [speed, limit, starts] : {Turned{1.0, 8.5, true}, {1.6, 8.5, false}, {1.6, 0.0, true}}) {
    simulation::Scene scene = identified("gimbal_b");
    scene.axes[0].inverter.start_limit = limit;
    MotorBench bench(scene);
    bench.set<"wall.law">(0);
    bench.run(0.3);
    ASSERT_TRUE(bench.arm());
    bench.disarm();
    turn(bench, speed);
    bench.run(0.1);
    bench.power().set_gate_driver_fault(true);
    bench.run(0.01);
    bench.power().set_gate_driver_fault(false);
    bench.run(0.6);
    bench.clear();
    EXPECT_EQ(bench.arm(), starts) << speed;
    EXPECT_EQ(bench.application().refusal(0), starts ? Refusal::none : Refusal::power_stage_not_ready);
    bench.disarm();
    turn(bench, 0.0);
    bench.run(0.6);
    EXPECT_TRUE(bench.arm()) << firmware::to_string(bench.application().refusal(0));
  }
}

TEST(SimulatedPower, AnAxisThatIsTurnedWhileTheBoardStartsIsNotTakenForAbsent) {
  simulation::Scene scene = open_scene("motor_axes");
  for (simulation::SceneAxis& axis : scene.axes) {
    axis.motion.reset();
    axis.person.reset();
    axis.inverter.start_limit = 1.0;
  }
  MotorBench bench(scene);
  bench.set<"wall.law">(0, 1);
  turn(bench, 2.0, 1);
  bench.run(2.0);
  EXPECT_FALSE(bench.arm(0)) << "the drivers share a line";
  turn(bench, 0.0, 1);
  bench.run(0.6);
  bench.application().refresh_readings();
  EXPECT_EQ(bench.application().values().whole<"drive.presence">(1), 0);
  bench.set<"wall.law">(0, 0);
  EXPECT_TRUE(bench.arm(0)) << firmware::to_string(bench.application().refusal(0));
}

TEST(SimulatedPower, AnAxisIsDeclaredAbsentAndTakenBackWhileNothingIsArmed) {
  MotorBench bench(open_scene("motor_axes"));
  bench.set<"wall.law">(0, 0);
  bench.run(0.3);
  ASSERT_TRUE(bench.arm(0)) << firmware::to_string(bench.application().refusal(0));
  EXPECT_EQ(bench.set<"drive.declared_absent">(1, 0), Refusal::while_armed);
  bench.disarm(0);
  ASSERT_EQ(bench.set<"drive.declared_absent">(1, 0), Refusal::none);
  bench.run(0.3);
  EXPECT_FALSE(bench.arm(0));
  EXPECT_EQ(bench.application().refusal(0), Refusal::axis_absent);
  ASSERT_EQ(bench.set<"drive.declared_absent">(0, 0), Refusal::none);
  bench.run(200e-6);
  EXPECT_FALSE(bench.arm(0));
  EXPECT_EQ(bench.application().refusal(0), Refusal::power_stage_not_ready) << "its driver is written again";
  bench.run(0.3);
  EXPECT_TRUE(bench.arm(0)) << firmware::to_string(bench.application().refusal(0));
}

TEST(SimulatedPower, AnotherGainIsTakenThroughTheWholeSequence) {
  MotorBench bench(identified("drone"));
  bench.set<"wall.law">(0);
  bench.run(0.1);
  EXPECT_EQ(bench.power().gain(), drivers::CurrentSenseGain::x80);
  bench.set<"current.limit">(60.0);
  bench.run(0.01);
  EXPECT_EQ(bench.power().gain(), drivers::CurrentSenseGain::x20);
  EXPECT_FALSE(bench.arm());
  bench.run(0.1);
  EXPECT_EQ(bench.drive().current_sensor().gain(), 20.0);
  EXPECT_TRUE(bench.arm());
}

}  // namespace kmax::simulated_board::simulated_power_test
