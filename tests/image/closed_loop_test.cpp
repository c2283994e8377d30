// The image on the virtual board, in the loop with motors, handles and people.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "tests/image/image_bench.hpp"

namespace kmax::tests::closed_loop_test {

using firmware::Fault;

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

  /// 0x60FD from bit 16 on: what is not standardised.
  unsigned digital_inputs(std::size_t axis) {
    return bench.reading(firmware::entry_of<"profile.digital_inputs">(), axis);
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

// A board of which one axis is populated: either of the two.
TEST(ClosedLoopOfOneAxis, RendersWhileTheOtherAxisIsAbsentAndADriverThatDiesLaterIsAFault) {
  for (const std::size_t there : {0U, 1U}) {
    const std::size_t missing = 1 - there;
    ImageBench bench(stiff_walls(), 2.0);
    bench.world.drives().plant(missing, simulation::Defect::gate_driver_missing);
    bench.start();
    constexpr std::size_t presence = firmware::entry_of<"drive.presence">();
    EXPECT_EQ(bench.reading(presence, there), 0);
    EXPECT_EQ(bench.reading(presence, missing), 1) << "no_answer";
    EXPECT_ANY_THROW(bench.master->arm(missing));
    EXPECT_EQ(bench.reading(firmware::entry_of<"drive.refusal">(), missing),
              static_cast<unsigned>(firmware::Refusal::axis_absent));
    bench.master->arm(there);
    bench.board->run_for(1.5);
    const auto& drive = bench.world.drive(there);
    EXPECT_TRUE(bench.board->bridge_armed(there)) << text_of(bench.fault(there)).name;
    EXPECT_FALSE(bench.board->bridge_armed(missing));
    EXPECT_GT(drive.force(), 0.5);
    EXPECT_NEAR(drive.force(), 3000.0 * (-0.02 - drive.handle().position()), 0.5);
    EXPECT_EQ(bench.fault(missing), Fault::none);
    EXPECT_EQ(bench.number("counters.missed_ticks"), 0U);

    bench.world.drives().plant(there, simulation::Defect::gate_driver_missing);
    bench.board->hold_fault_line(true);
    bench.board->run_for(20e-6);
    bench.board->hold_fault_line(false);
    bench.board->run_for(1.5);
    EXPECT_FALSE(bench.board->bridge_armed(there));
    EXPECT_EQ(bench.fault(there), Fault::gate_driver);
    EXPECT_EQ(bench.reading(presence, there), 0) << "it has answered";
    EXPECT_FALSE(bench.board->healthy());
  }
}

TEST(ClosedLoopOfOneAxis, ADriverThatPullsTheFaultLineIsNamedBesideOneThatIsNotFitted) {
  for (const std::size_t there : {0U, 1U}) {
    ImageBench bench(stiff_walls(), 2.0);
    bench.world.drives().plant(1 - there, simulation::Defect::gate_driver_missing);
    auto& driver = bench.board->gate_driver(there);
    driver.set_condition(drivers::Drv8301Fault::over_temperature, true, bench.board->now());
    bench.board->run_for(1.0);
    EXPECT_ANY_THROW(bench.master->arm(there));
    EXPECT_EQ(bench.reading(firmware::entry_of<"drive.refusal">(), there),
              static_cast<unsigned>(firmware::Refusal::gate_driver_fault));
    EXPECT_EQ(bench.reading(firmware::entry_of<"drive.gate_driver_faults">(), there) & 128U, 128U);
    EXPECT_EQ(bench.reading(firmware::entry_of<"drive.gate_driver_faults">(), 1 - there), 4096U);
    driver.set_condition(drivers::Drv8301Fault::over_temperature, false, bench.board->now());
    bench.start();
    EXPECT_EQ(bench.reading(firmware::entry_of<"drive.presence">(), 1 - there), 1) << "no_answer";
  }
}

// DRV8301: it does not start while a phase is above 8.5 V. The reset after a fault is such a start.
TEST(ClosedLoopOfOneAxis, AGateDriverThatIsResetWhileItsMotorIsTurnedFastStartsWhenItStands) {
  ImageBench bench({}, 0.0, "gimbal_b");
  bench.start();
  simulation::MotorDrive& drive = bench.world.drive(0);
  drive.hold(false);
  drive.push(20.0 * 1.6, 20.0);
  bench.board->run_for(0.1);
  bench.board->hold_fault_line(true);
  bench.board->run_for(20e-6);
  bench.board->hold_fault_line(false);
  bench.board->run_for(0.5);
  EXPECT_FALSE(bench.board->healthy());
  EXPECT_EQ(bench.reading(firmware::entry_of<"drive.presence">(), 0), 0) << "it has answered";
  drive.push(0.0, 0.0);
  drive.hold(true);
  bench.board->run_for(0.5);
  EXPECT_TRUE(bench.board->healthy());
}

// Which transistor it was is asked of the drivers before the reset that lets them forget it.
TEST_F(ClosedLoop, AGateDriverThatTripsSaysWhichTransistorItWas) {
  constexpr std::size_t faults = firmware::entry_of<"drive.gate_driver_faults">();
  for (unsigned bit = 0; bit < 6; ++bit) {
    const std::size_t axis = bit % 2;
    bench.board->gate_driver(axis).over_current(static_cast<drivers::Drv8301Fault>(1U << bit),
                                                bench.board->now());
    bench.board->run_for(0.005);
    EXPECT_EQ(bench.fault(axis), Fault::gate_driver);
    EXPECT_EQ(bench.reading(faults, axis), 1U << bit | static_cast<unsigned>(drivers::Drv8301Fault::fault));
    EXPECT_EQ(bench.reading(faults, (axis + 1) % 2), 0U);
    bench.board->run_for(0.3);
    EXPECT_EQ(bench.reading(faults, axis) & 0x3FU, 1U << bit) << "still told after the reset";
  }
}

// nFAULT is pulled by nobody who admits it.
TEST_F(ClosedLoop, InterferenceOnTheFaultLineIsNobodysFault) {
  bench.board->hold_fault_line(true);
  bench.board->run_for(20e-6);
  bench.board->hold_fault_line(false);
  bench.board->run_for(0.005);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    EXPECT_EQ(bench.fault(axis), Fault::gate_driver);
    EXPECT_EQ(bench.reading(firmware::entry_of<"drive.gate_driver_faults">(), axis), 0U);
  }
}

TEST_F(ClosedLoop, TheDigitalInputsShowTheEmergencyStopAndTheGateDriversFaultLine) {
  press();
  EXPECT_EQ(digital_inputs(0) & 3U, 0U);
  bench.board->open_emergency_stop(true);
  bench.board->run_for(0.001);
  EXPECT_EQ(digital_inputs(0) & 3U, 1U);
  bench.board->open_emergency_stop(false);
  bench.board->hold_fault_line(true);
  bench.board->run_for(0.001);
  EXPECT_EQ(digital_inputs(1) & 3U, 2U);
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
      // The patience, 1.7 ms, and a look before and behind it.
      bench.board->run_until(bench.board->now() + ticks(42));
      EXPECT_FALSE(bench.board->bridge_armed(1)) << terminal;
      EXPECT_EQ(bench.fault(1), Fault::phase_open) << terminal;
    }
    EXPECT_TRUE(tried) << terminal;
  }
}

// By 40 degC in 1 s, and some more to follow: without that, each sensor would then be off by 0.8 A, and the
// motors by 2.4 N and 4 N.
TEST_F(ClosedLoop, AForceStaysWhatItIsWhileTheBoardWarmsUp) {
  bench.board->run_for(0.7);
  for (double celsius = 25.0; celsius < 65.0; celsius += 0.4) {
    for (std::size_t axis = 0; axis < 2; ++axis)
      bench.world.drive(axis).current_sensor().set_temperature(celsius);
    bench.board->run_for(0.01);
  }
  bench.board->run_for(0.7);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    ASSERT_TRUE(bench.board->bridge_armed(axis)) << axis << ": " << text_of(bench.fault(axis)).name;
    double off = 0.0;
    constexpr int samples = 200;
    for (int n = 0; n < samples; ++n) {
      bench.board->run_until(bench.board->now() + ticks(10));
      const auto& drive = bench.world.drive(axis);
      off += drive.force() - 3000.0 * (-0.02 - drive.handle().position());
    }
    EXPECT_NEAR(off / samples, 0.0, 0.15) << axis;
  }
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
