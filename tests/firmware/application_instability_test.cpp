// A wall that oscillates under the hand, through the whole firmware: what each instability.action does about
// it, what a host reads of it, and who may change it while armed. The handle's course is given here; people
// whose walls oscillate by themselves are in tests/host_tools/simulated_board/scene_run_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/board/canopen_host.hpp"

namespace kmax::board::application_instability_test {
namespace {

using firmware::Fault;

constexpr double off = 0, warn = 1, soften = 2, trip = 3;
constexpr unsigned unstable_flag = 64, softened_flag = 128;

class Unstable : public testing::Test {
 protected:
  void SetUp() override {
    for (const std::size_t axis : {0U, 1U}) {
      bench.set_up_plain_wall(axis);
      bench.preset("wall.stiffness", 5000, axis);
      bench.device.stand_at(1000, axis);
    }
  }
  void arm(double action, std::size_t axis = 0) {
    bench.preset("instability.action", action, axis);
    ASSERT_TRUE(bench.arm(axis));
  }
  /// In the wall, at 50 Hz, from now on: 1 N and 0.2 mm to either side of 1.5 N and 0.3 mm.
  void swing(std::size_t axis = 0) {
    const std::uint64_t start = bench.device.tick;
    bench.device.script[axis] = [start](std::uint64_t now) {
      return std::lround(-300.0 +
                         200.0 * std::sin(6.283185307 * 50.0 * static_cast<double>(now - start) / 20000.0));
    };
  }
  unsigned flags(std::size_t axis = 0) { return static_cast<unsigned>(bench.get("measured.flags", axis)); }
  bool warning(std::size_t axis = 0) {
    return (static_cast<unsigned>(bench.get("drive.statusword", axis)) & 0x80U) != 0;
  }
  /// Ticks until the force is gone, at most 0.3 s.
  int ticks_of_force() {
    int ticks = 0;
    while (ticks < 6000 && (bench.run_ticks(1), bench.device.last[0].enabled)) ++ticks;
    return ticks;
  }

  CanOpenHost host;
  Bench& bench = host.bench;
};

TEST_F(Unstable, IsWarnedOfFromTheFactoryAndTheForceIsTheSame) {
  EXPECT_EQ(bench.get("instability.action"), warn);
  ASSERT_TRUE(bench.arm(0));
  arm(off, 1);
  EXPECT_EQ(bench.get("instability.alarms"), 0);
  EXPECT_EQ(bench.get("instability.last_force"), 0);
  EXPECT_FALSE(warning());
  swing(0);
  swing(1);
  bench.device.recording = true;
  bench.run_ms(300);
  bench.device.recording = false;
  EXPECT_EQ(bench.device.forces[0], bench.device.forces[1]);
  EXPECT_EQ(flags(0), 1U | 16U | unstable_flag);
  EXPECT_EQ(static_cast<unsigned>(bench.get("telemetry.flags")), 0x1100U | 1U | 16U | unstable_flag);
  EXPECT_TRUE(warning(0));
  EXPECT_EQ(bench.get("instability.alarms"), 1);
  EXPECT_NEAR(bench.get("instability.last_force"), 1.0, 0.02);
  EXPECT_NEAR(bench.get("instability.last_amplitude"), 2e-4, 4e-6);
  EXPECT_NEAR(bench.get("instability.last_frequency"), 50.0, 1.0);
  EXPECT_EQ(bench.get("instability.softening"), 1);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
  EXPECT_EQ(flags(1), 1U | 16U) << "off";
  EXPECT_FALSE(warning(1));
  EXPECT_EQ(bench.get("instability.alarms", 1), 0);
  // Over, and told until it is armed again.
  bench.device.stand_at(-300);
  bench.run_ms(100);
  EXPECT_EQ(flags(0), 1U | 16U);
  EXPECT_FALSE(warning(0));
  bench.device.stand_at(1000);
  bench.disarm();
  EXPECT_EQ(bench.get("instability.alarms"), 1);
  bench.set("wall.position", 1e-4);
  bench.run_ms(10);
  EXPECT_NEAR(bench.get("instability.last_force"), 1.0, 0.02) << "other settings change nothing in it";
  ASSERT_TRUE(bench.arm(0));
  EXPECT_EQ(bench.get("instability.alarms"), 0);
  EXPECT_EQ(bench.get("instability.last_force"), 0);
}

TEST_F(Unstable, IsSoftenedUntilItIsDisarmed) {
  arm(soften);
  swing();
  bench.run_ms(200);
  EXPECT_EQ(flags(), 1U | 16U | unstable_flag | softened_flag);
  bench.run_ms(300);
  EXPECT_LT(bench.get("instability.softening"), 0.5);
  bench.device.stand_at(-300);
  bench.run_ms(100);
  const double left = bench.get("instability.softening");
  EXPECT_FLOAT_EQ(bench.force(), static_cast<float>(left * 1.5));
  bench.run_ms(1000);
  EXPECT_EQ(bench.get("instability.softening"), left);
  EXPECT_EQ(flags(), 1U | 16U | softened_flag);
  EXPECT_TRUE(warning());
  // No setting that may be changed now brings it back.
  EXPECT_EQ(bench.set("wall.stiffness", 4000), 0);
  EXPECT_EQ(bench.set("instability.force", 0.2), 0);
  EXPECT_EQ(bench.set("instability.action", trip), 0);
  bench.run_ms(10);
  EXPECT_EQ(bench.get("instability.softening"), left);
  EXPECT_FLOAT_EQ(bench.force(), static_cast<float>(left * 1.2));
  bench.device.stand_at(1000);
  bench.disarm();
  EXPECT_EQ(bench.get("instability.softening"), 1);
  EXPECT_FALSE(warning());
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-300);
  bench.run_ms(10);
  EXPECT_FLOAT_EQ(bench.force(), 1.2f);
  EXPECT_EQ(flags(), 1U | 16U);
}

TEST_F(Unstable, TripsInTheTickThatFindsItAndCanBeArmedAgainAtOnce) {
  arm(warn);
  EXPECT_EQ(bench.set("instability.action", trip), 0) << "while armed";
  swing();
  float before = 0.0f;
  int ticks = 0;
  for (; ticks < 6000; ++ticks) {
    bench.run_ticks(1);
    if (!bench.device.last[0].enabled) break;
    before = bench.force();
  }
  ASSERT_LT(ticks, 6000) << "within 0.3 s";
  EXPECT_GT(before, 0.0f);
  EXPECT_EQ(bench.force(), 0.0f);
  EXPECT_EQ(bench.device.last[0].force, 0.0f);
  host.run_ms(5);
  EXPECT_EQ(bench.state(), DriveState::fault);
  EXPECT_EQ(host.fault(), Fault::unstable_wall);
  EXPECT_EQ(bench.get("drive.error_code"), 0xFF07);
  EXPECT_EQ(firmware::fault_by_error_code(0xFF07)->name, "unstable_wall");
  EXPECT_NEAR(bench.get("drive.fault_value"), 1.0, 0.02);
  EXPECT_FLOAT_EQ(static_cast<float>(bench.get("drive.fault_bound")), 0.3f);
  EXPECT_EQ(bench.get("instability.alarms"), 1);
  EXPECT_EQ(static_cast<float>(bench.get("trip.force")), before);
  EXPECT_EQ(flags() & unstable_flag, 0U) << "without force nothing oscillates";
  bool reported = false;
  for (const auto& frame : host.heard)
    reported = reported || (frame.identifier == 0x81 && frame.data[0] == 0x07 && frame.data[1] == 0xFF);
  EXPECT_TRUE(reported) << "an emergency message";
  // Back in free space, nothing stands in the way.
  bench.device.stand_at(1000);
  bench.run_ms(2);
  bench.clear_fault();
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(-300);
  bench.run_ms(100);
  EXPECT_FLOAT_EQ(bench.force(), 1.5f);
}

TEST_F(Unstable, OneAxisTripsAndTheOtherGoesOn) {
  arm(trip, 0);
  arm(trip, 1);
  swing(0);
  bench.device.stand_at(-300, 1);
  EXPECT_LT(ticks_of_force(), 6000);
  bench.run_ms(300);
  EXPECT_EQ(bench.state(1), DriveState::operation_enabled);
  EXPECT_FLOAT_EQ(bench.force(1), 1.5f);
  EXPECT_EQ(bench.get("instability.alarms", 1), 0);
}

TEST_F(Unstable, IsJudgedByTheThresholdsThatAreSet) {
  for (const auto& [name, above, below] :
       {std::tuple{"instability.force", 1.1, 0.9}, std::tuple{"instability.amplitude", 2.2e-4, 1.8e-4}}) {
    bench.preset("instability.force", 0.3);
    bench.preset("instability.amplitude", 8e-5);
    bench.preset(name, above);
    bench.device.stand_at(1000);
    bench.run_ms(5);
    arm(warn);
    swing();
    bench.run_ms(500);
    EXPECT_EQ(bench.get("instability.alarms"), 0) << name;
    EXPECT_EQ(bench.set(name, below), 0) << "tighter, while armed";
    bench.run_ms(300);
    EXPECT_EQ(bench.get("instability.alarms"), 1) << name;
    EXPECT_NE(bench.set(name, above), 0) << "looser, while armed";
    EXPECT_EQ(static_cast<Refusal>(static_cast<int>(bench.get("refusal.reason"))), Refusal::only_tightens);
    bench.device.stand_at(1000);
    bench.disarm();
    EXPECT_EQ(bench.set(name, above), 0) << "disarmed";
  }
}

TEST_F(Unstable, AWallThatAHostMovesUnderTheHandIsNone) {
  // Field and spring of a handle at rest in the wall go up and down as fast as a host can say.
  bench.preset("wall.stiffness_ceiling", 10000);
  arm(trip);
  bench.device.stand_at(-300);
  bench.run_ms(5);
  float least = 1e9f, most = 0.0f;
  for (int n = 0; n < 60; ++n) {
    ASSERT_EQ(bench.set("wall.stiffness", n % 2 == 0 ? 10000 : 1000), 0);
    bench.run_ticks(2);
    least = std::min(least, bench.force());
    most = std::max(most, bench.force());
  }
  EXPECT_GT(most - least, 2.0f);
  EXPECT_EQ(bench.get("instability.alarms"), 0);
  for (const auto& [name, number] :
       {std::pair{"wall.position", 1e-4}, {"wall.side", -1.0}, {"device.transmission", 0.2}})
    EXPECT_NE(bench.set(name, number), 0) << name << " cannot be changed while armed";
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
}

TEST_F(Unstable, IsNotWhatMovesInFreeSpaceOrHardlyOrSlowly) {
  arm(trip);
  const auto move = [this](double around, double amplitude, double frequency) {
    const std::uint64_t start = bench.device.tick;
    bench.device.script[0] = [=](std::uint64_t now) {
      return std::lround(around + amplitude * std::sin(6.283185307 * frequency *
                                                       static_cast<double>(now - start) / 20000.0));
    };
    bench.run_ms(1000);
  };
  move(2000.0, 500.0, 40.0);
  move(-300.0, 50.0, 50.0);
  move(-300.0, 200.0, 8.0);
  EXPECT_EQ(bench.application().fault(0), Fault::none);
  EXPECT_EQ(bench.get("instability.alarms"), 0);
}

TEST_F(Unstable, IsNoMatterOfCommandedForces) {
  bench.preset("instability.action", trip);
  bench.preset("drive.mode", 2);
  ASSERT_TRUE(bench.arm());
  swing();
  for (int n = 0; n < 40; ++n) {
    ASSERT_EQ(bench.set("profile.target_force", n % 2 == 0 ? 2 : -2), 0);
    bench.run_ms(2);
  }
  EXPECT_EQ(bench.get("instability.alarms"), 0);
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
}

}  // namespace
}  // namespace kmax::board::application_instability_test
