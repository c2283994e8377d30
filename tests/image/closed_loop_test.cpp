// The image on the virtual board, in the loop with motors, handles and persons.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "drivers/stm32f4/registers/adc.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests::closed_loop_test {

using firmware::Fault;
using virtual_board::BoardTime;

ImageBench::Parameters stiff_walls() {
  ImageBench::Parameters parameters{{"supply.voltage_min", 10.0}, {"link.timeout", 0.0}};
  for (const std::string prefix : {"", "axis1."}) {
    parameters.push_back({prefix + "wall.stiffness", 3000.0});
    parameters.push_back({prefix + "encoder.index", std::string("once_per_turn")});
  }
  return parameters;
}

/// From the event to the next sample at most one tick; from there to MOE = 0 the tick's own time, 12 us.
constexpr double one_tick_and_handling = 1.3;
// The supply is converted beside the currents of both axes, and its code is ready half a tick after them.
constexpr double supply_and_handling = one_tick_and_handling + 0.5;

class ClosedLoop : public testing::Test {
 protected:
  ClosedLoop() {
    bench.start();
    for (std::size_t axis = 0; axis < 2; ++axis) bench.master->arm(axis);
  }

  /// Both handles have reached the wall and are pressed against it.
  void press() {
    bench.board->run_for(1.5);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      ASSERT_TRUE(bench.board->bridge_armed(axis)) << axis << ": " << text_of(bench.fault(axis)).name;
    }
  }

  /// Board time from now until the bridge of the axis is off.
  double ticks_until_off(std::size_t axis) {
    const BoardTime begin = bench.board->now();
    while (bench.board->bridge_armed(axis)) {
      bench.board->run_until(bench.board->now() + ticks(0.02));
      if (bench.board->now() > begin + ticks(1000)) return 1000.0;
    }
    return virtual_board::seconds(bench.board->now() - begin) / tick_s;
  }

  ImageBench bench{stiff_walls(), 2.0};
};

// 3 N/mm on both axes at once, every tick: the handle stays where force and push balance.
TEST_F(ClosedLoop, HoldsTheHandlesAtAStiffWallOnBothAxes) {
  press();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto& drive = bench.world.drive(axis);
    double deepest = 0.0, lowest = 1.0, highest = -1.0;
    for (int i = 0; i < 1000; ++i) {
      bench.board->run_until(bench.board->now() + ticks(10));
      const double depth = -0.02 - drive.handle().position();
      deepest = std::max(deepest, depth);
      lowest = std::min(lowest, drive.handle().position());
      highest = std::max(highest, drive.handle().position());
    }
    EXPECT_GT(deepest, 0.1e-3) << axis << ": pressed in";
    EXPECT_LT(deepest, 1.5e-3) << axis;
    EXPECT_LT(highest - lowest, 0.2e-3) << axis << ": held still";
    // What the wall gives for that depth is what the motor makes.
    EXPECT_NEAR(drive.force(), 3000.0 * (-0.02 - drive.handle().position()), 0.5) << axis;
    EXPECT_TRUE(bench.board->bridge_armed(axis));
    EXPECT_EQ(bench.fault(axis), Fault::none);
  }
}

TEST_F(ClosedLoop, AnEncoderThatComesOffTakesTheForceWithinOneTick) {
  press();
  bench.world.connect_encoder(0, false);
  EXPECT_LE(ticks_until_off(0), one_tick_and_handling);
  EXPECT_TRUE(bench.board->bridge_armed(1)) << "the other axis goes on";
  EXPECT_EQ(bench.fault(0), Fault::encoder);
  EXPECT_EQ(bench.fault(1), Fault::none);
}

TEST_F(ClosedLoop, ASupplyThatFailsTakesTheForceWithinOneTick) {
  press();
  bench.world.supply().disconnect();
  bench.world.supply().set_voltage(7.0);
  EXPECT_LE(ticks_until_off(0), supply_and_handling);
  EXPECT_LE(ticks_until_off(1), supply_and_handling);
  EXPECT_EQ(bench.fault(0), Fault::under_voltage);
  EXPECT_EQ(bench.fault(1), Fault::under_voltage);
}

TEST_F(ClosedLoop, TheGateDriversFaultLineTakesTheForceAtOnce) {
  press();
  bench.board->hold_fault_line(true);
  EXPECT_LE(ticks_until_off(0), 0.1);
  EXPECT_LE(ticks_until_off(1), 0.1);
  bench.board->run_for(0.001);
  EXPECT_EQ(bench.fault(0), Fault::gate_driver);
  EXPECT_EQ(bench.fault(1), Fault::gate_driver);
  EXPECT_FALSE(bench.board->healthy());
}

TEST_F(ClosedLoop, TheEmergencyStopTakesTheForceAtOnce) {
  press();
  bench.board->open_emergency_stop(true);
  EXPECT_LE(ticks_until_off(0), 0.1);
  EXPECT_LE(ticks_until_off(1), 0.1);
  bench.board->run_for(0.001);
  EXPECT_EQ(bench.fault(0), Fault::emergency_stop);
  EXPECT_FALSE(bench.board->healthy());
}

/// What a hand that presses on meets when the link is lost, until the bridge is off.
struct LostLink {
  double fastest = 0.0;  ///< m/s
  double given = 0.0;    ///< J, the largest that the motor has given to the handle since
  double lasted = 0.0;   ///< s
};

std::array<LostLink, 2> lose_link(const std::string& loss) {
  auto parameters = stiff_walls();
  parameters.emplace_back("link.timeout", 0.3);
  parameters.emplace_back("link.loss", loss);
  ImageBench bench{parameters, 2.0};
  bench.start();
  for (std::size_t axis = 0; axis < 2; ++axis) bench.master->arm(axis);
  for (int i = 0; i < 15; ++i) {
    bench.board->run_for(0.1);
    bench.fault(0);  // a sign of life
  }
  std::array<LostLink, 2> seen{};
  std::array<double, 2> work{};
  const double begin = virtual_board::seconds(bench.board->now());
  for (std::size_t axis = 0; axis < 2; ++axis) {
    EXPECT_TRUE(bench.board->bridge_armed(axis));
    EXPECT_GT(bench.world.drive(axis).force(), 1.0) << axis << ": pressed";
  }
  while (virtual_board::seconds(bench.board->now()) < begin + 0.5) {
    bench.board->run_until(bench.board->now() + ticks(1));
    const double now = virtual_board::seconds(bench.board->now()) - begin;
    if (now < 0.305) continue;  // still armed: found within a few polls
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto& drive = bench.world.drive(axis);
      work[axis] += drive.force() * drive.handle().velocity() * tick_s;
      seen[axis].given = std::max(seen[axis].given, work[axis]);
      seen[axis].fastest = std::max(seen[axis].fastest, std::abs(drive.handle().velocity()));
      if (bench.board->bridge_armed(axis)) seen[axis].lasted = now - 0.3;
    }
  }
  for (std::size_t axis = 0; axis < 2; ++axis) EXPECT_EQ(bench.fault(axis), Fault::link_silent) << axis;
  return seen;
}

// Two newtons go on pressing where the wall was.
TEST(ClosedLoopOfALostLink, TheShortedMotorBrakesAndGivesTheHandNothing) {
  const auto limp = lose_link("limp"), damp = lose_link("damp"), ramp = lose_link("ramp");
  for (std::size_t axis = 0; axis < 2; ++axis) {
    std::printf("axis %zu: fastest %.3f limp, %.3f damp, %.3f m/s ramp; given %.1e, %.1e, %.1e J\n", axis,
                limp[axis].fastest, damp[axis].fastest, ramp[axis].fastest, limp[axis].given,
                damp[axis].given, ramp[axis].given);
    EXPECT_LT(limp[axis].lasted, 0.002) << axis;
    EXPECT_GT(damp[axis].lasted, 0.1) << axis << ": as long as the handle moves";
    EXPECT_LT(damp[axis].fastest, 0.6 * limp[axis].fastest) << axis;
    EXPECT_LT(damp[axis].given, 1e-4) << axis;
    EXPECT_NEAR(ramp[axis].lasted, 0.2, 0.02) << axis << ": force.ramp_time";
  }
}

// Legs B and C carry the DC motor of axis 0; the synchronous motor of axis 1 has three.
TEST_F(ClosedLoop, AnOpenPhaseTakesTheForceWithinOneTick) {
  press();
  bench.world.drive(0).open_terminal(1, true);
  EXPECT_LE(ticks_until_off(0), one_tick_and_handling);
  EXPECT_EQ(bench.fault(0), Fault::phase_open);
  EXPECT_TRUE(bench.board->bridge_armed(1));
}

// Wherever the rotor stands a phase may carry next to nothing, and then nobody misses it: other places are
// tried.
TEST(ClosedLoopOfEachPhase, AnOpenPhaseOfTheSynchronousMotorIsNamed) {
  for (std::size_t terminal = 0; terminal < 3; ++terminal) {
    bool tried = false;
    for (int place = 0; place < 8 && !tried; ++place) {
      auto parameters = stiff_walls();
      const double wall = -0.02 - 0.0003 * place;
      parameters.push_back({"axis1.wall.position", wall});
      ImageBench bench(parameters, 3.0);
      bench.start();
      bench.master->arm(1);
      bench.board->run_for(1.2);
      ASSERT_TRUE(bench.board->bridge_armed(1));
      if (std::abs(bench.world.drive(1).currents()[terminal]) < 0.35) continue;
      tried = true;
      bench.world.drive(1).open_terminal(terminal, true);
      bench.board->run_until(bench.board->now() + ticks(one_tick_and_handling));
      EXPECT_FALSE(bench.board->bridge_armed(1)) << terminal;
      EXPECT_EQ(bench.fault(1), Fault::phase_open) << terminal;
    }
    EXPECT_TRUE(tried) << terminal;
  }
}

// A fault is not the end: what caused it gone, the host clears it and arms again.
TEST_F(ClosedLoop, ComesBackAfterTheFaultLineHasRisen) {
  press();
  bench.board->hold_fault_line(true);
  bench.board->run_for(0.01);
  bench.board->hold_fault_line(false);
  bench.board->run_for(0.5);
  const auto controlword = firmware::register_address(firmware::entry_of<"drive.controlword">(), 0);
  bench.master->write_register(controlword, 0x80);
  EXPECT_EQ(bench.fault(0), Fault::none);
  bench.board->run_for(3.0);  // the person lets go
  bench.master->arm(0);
  bench.board->run_for(0.01);
  EXPECT_TRUE(bench.board->bridge_armed(0));
}

// The clock security system: NMI, safe state, and a new start from the internal oscillator.
TEST_F(ClosedLoop, ACrystalThatStopsTakesTheForceAtOnce) {
  press();
  const auto resets = bench.board->resets();
  bench.board->rcc().fail_crystal(bench.board->now());
  EXPECT_LE(ticks_until_off(0), 0.5);
  EXPECT_LE(ticks_until_off(1), 0.5);
  bench.board->run_for(0.1);
  EXPECT_EQ(bench.board->resets(), resets + 1);
  EXPECT_FALSE(bench.board->bridge_armed(0));
}

// Nothing but the clock's interrupt can tell that there are no ticks any more.
TEST_F(ClosedLoop, TicksThatStopTakeTheForceWithinThreeMilliseconds) {
  press();
  bench.board->bus().write(drivers::stm32f4::adc_base + drivers::stm32f4::adc_stride + 0x08, 4, 0,
                           bench.board->now());
  bench.board->run_for(0.003);
  EXPECT_FALSE(bench.board->bridge_armed(0));
  EXPECT_FALSE(bench.board->bridge_armed(1));
  bench.board->run_for(0.01);
  EXPECT_EQ(bench.fault(0), Fault::tick_missed);
}

TEST_F(ClosedLoop, ABrokenThermistorIsTooHot) {
  press();
  bench.world.temperature(0).set_wiring(simulation::TemperatureSensor::Wiring::open);
  bench.board->run_for(0.005);
  EXPECT_FALSE(bench.board->bridge_armed(0));
  EXPECT_TRUE(bench.board->bridge_armed(1));
  EXPECT_EQ(bench.fault(0), Fault::over_temperature);
}

// A plug that is off is not forgotten because some parameter has changed.
TEST_F(ClosedLoop, AnEncoderThatCameOffStaysWrong) {
  press();
  bench.world.connect_encoder(0, false);
  bench.board->run_for(0.01);
  ASSERT_EQ(bench.fault(0), Fault::encoder);
  bench.master->write_holding(firmware::register_address(firmware::entry_of<"wall.damping">(), 0),
                              std::array<std::uint16_t, 2>{0x3F80, 0});
  bench.master->write_register(firmware::register_address(firmware::entry_of<"drive.controlword">(), 0),
                               0x80);
  EXPECT_EQ(bench.fault(0), Fault::encoder);
}

}  // namespace kmax::tests::closed_loop_test
