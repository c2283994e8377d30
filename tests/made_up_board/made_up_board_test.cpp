#include "tests/made_up_board/made_up_board.hpp"

#include <gtest/gtest.h>

#include "tests/board/canopen_host.hpp"

namespace kmax::board::made_up_board_test {

using firmware::AxisOutput;
using firmware::DriveState;
using firmware::Fault;

class MadeUpBoard : public testing::Test, public CanOpenHostWith<MadeUpDevice> {
 protected:
  MadeUpBoard() {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      bench.set_up_plain_wall(axis);
      bench.device.stand_at(1000, axis);
    }
    bench.run_ms(100);
  }
  void arm_all() {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) ASSERT_TRUE(bench.arm(axis)) << axis;
  }
  /// N that the current of the axis' motor makes on its handle.
  double made(std::size_t axis) {
    return bench.device.power.hardware().currents[axis] * bench.get("motor.torque_constant", axis) /
           bench.get("device.transmission", axis);
  }
};

TEST_F(MadeUpBoard, ThreeAxesRenderWallsOfTheirOwn) {
  arm_all();
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    bench.device.stand_at(-200 * (static_cast<int>(axis) + 1), axis);
  bench.run_ms(50);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const double asked = 0.2 * static_cast<double>(axis + 1);  // 1000 N/m
    EXPECT_NEAR(static_cast<double>(bench.force(axis)), asked, 1e-5) << axis;
    EXPECT_NEAR(made(axis), asked, 0.02) << axis;
    EXPECT_FALSE(bench.device.power.hardware().bridge(axis).leg_a_enabled()) << "a brushed motor";
  }
}

TEST_F(MadeUpBoard, ATripOfTheThirdAxisTakesItsForceAlone) {
  arm_all();
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) bench.device.stand_at(-300, axis);
  bench.run_ms(20);
  bench.device.power.hardware().bridge(2).disarm();  // and nobody says why
  bench.run_ms(20);
  EXPECT_EQ(bench.application().fault(2), Fault::power_stage);
  EXPECT_EQ(bench.force(2), 0.0f);
  EXPECT_EQ(made(2), 0.0);
  for (const std::size_t axis : {0, 1}) {
    EXPECT_EQ(bench.state(axis), DriveState::operation_enabled) << axis;
    EXPECT_NEAR(made(axis), 0.3, 0.02) << axis;
  }
  bench.device.stand_at(1000, 2);
  bench.clear_fault(2);
  EXPECT_TRUE(bench.arm(2)) << "and comes back";
}

TEST_F(MadeUpBoard, AnAxisThatAsksForTheAs5047pThatThisBoardLacksIsNotArmed) {
  ASSERT_EQ(bench.set("encoder.kind", 1, 1), 0);
  bench.run_ms(20);
  EXPECT_FALSE(bench.arm(1));
  EXPECT_EQ(bench.application().refusal(1), firmware::Refusal::encoder_invalid);
  EXPECT_TRUE(bench.arm(0));
  EXPECT_TRUE(bench.arm(2));
  bench.disarm(0);
  bench.disarm(2);
  EXPECT_EQ(bench.set("encoder.kind", 0, 1), 0);
  bench.run_ms(20);
  EXPECT_TRUE(bench.arm(1)) << "its lines are there";
}

TEST_F(MadeUpBoard, ParametersOfTheThirdAxisAreReachedOverBothBuses) {
  const auto stiffness = [](double number) {
    return std::bit_cast<std::uint32_t>(static_cast<float>(number));
  };
  const firmware::Entry& entry = firmware::entry_at(firmware::entry_named("wall.stiffness"));
  const auto index_of_axis = [&entry](std::size_t axis) {
    return static_cast<std::uint16_t>(entry.group.index + axis * firmware::axis_index_offset);
  };
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const double number = 100.0 * static_cast<double>(axis + 1);
    EXPECT_EQ(bench.set("wall.stiffness", number, axis), 0);
    EXPECT_EQ(read(index_of_axis(axis), entry.subindex), stiffness(number))
        << "set over Modbus, read over CAN";
    EXPECT_EQ(write(index_of_axis(axis), entry.subindex, stiffness(number + 7.0), 4), 0U);
  }
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    EXPECT_EQ(bench.get("wall.stiffness", axis), 100.0 * static_cast<double>(axis + 1) + 7.0) << "and back";
}

TEST_F(MadeUpBoard, ALawOverAllPositionsRunsInTheWholeFirmware) {
  using Law = firmware::DeviceLaw<firmware::axis_count>;
  arm_all();
  constexpr int before_the_stop = Law::stop - 2 * 1000;
  bench.device.stand_at(before_the_stop, 1);
  bench.run_ms(20);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) EXPECT_EQ(bench.force(axis), 0.0f) << axis;
  bench.device.stand_at(before_the_stop + 500, 1);
  bench.run_ms(20);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    EXPECT_NEAR(bench.force(axis), -0.5f, 0.001f) << axis << ": the stop that all share";
    EXPECT_NEAR(made(axis), -0.5, 0.02) << axis;
  }
  bench.disarm(1);
  bench.run_ms(20);
  EXPECT_EQ(bench.force(1), 0.0f);
  EXPECT_NEAR(bench.force(2), -0.5f, 0.001f) << "a position counts whether its axis is driven or not";
}

TEST_F(MadeUpBoard, AParameterOfTheLawReachesItFromBothBuses) {
  using Law = firmware::DeviceLaw<firmware::axis_count>;
  bench.device.stand_at(Law::stop - 2 * 1000 + 500, 1);
  bench.run_ms(20);
  const auto expect_all = [this](float newtons) {
    arm_all();
    bench.run_ms(20);
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      EXPECT_NEAR(bench.force(axis), newtons, 1e-5f) << axis;
      bench.disarm(axis);
    }
    bench.run_ms(20);
  };
  expect_all(-0.5f);
  EXPECT_EQ(bench.set("wall.stiffness", 2000, 0), 0);
  expect_all(-1.0f);
  EXPECT_EQ(bench.set("wall.stiffness", 500, 1), 0) << "another axis' wall";
  expect_all(-1.0f);
  const firmware::Entry& entry = firmware::entry_at(firmware::entry_named("wall.stiffness"));
  EXPECT_EQ(write(entry.group.index, entry.subindex, std::bit_cast<std::uint32_t>(400.0f), 4), 0U);
  expect_all(-0.2f);
}

TEST_F(MadeUpBoard, WhoArmsAnAxisThatTheLawCouplesToAnothersIsRefused) {
  ASSERT_TRUE(bench.arm(1)) << "over the serial line";
  command(6);
  command(15);
  EXPECT_EQ(bench.application().refusal(0), firmware::Refusal::other_commander) << "over CAN";
  EXPECT_FALSE(armed());
  bench.disarm(1);
  bench.run_ms(20);
  command(6);
  command(15);
  EXPECT_TRUE(armed());
}

TEST_F(MadeUpBoard, TicksOfAllThreeAreCountedAndMissed) {
  auto& drives = bench.device.power.drives();
  bench.run_ticks(1);
  EXPECT_TRUE(drives.all_have_ticked());
  EXPECT_FALSE(drives.all_have_ticked()) << "nobody has ticked since";
  EXPECT_FALSE(drives.ISR_ticks_have_stopped());
  arm_all();
  EXPECT_FALSE(drives.ISR_ticks_have_stopped());
  EXPECT_TRUE(drives.all_have_ticked());
  for (int silent = 0; silent < 2; ++silent) {
    for (const std::size_t axis : {0, 1}) bench.device.drive(axis, bench.device.last[axis]);
    EXPECT_EQ(drives.ISR_ticks_have_stopped(), silent == 1) << "the third alone stands still";
  }
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    EXPECT_FALSE(bench.device.power.hardware().bridge(axis).armed());
  EXPECT_FALSE(drives.all_have_ticked());
}

// The ticks one after the other as a chip's interrupts come, without anything else of a board.
TEST(MadeUpTicks, RoundsOfThreeTicksAreTheMainLoopsRhythm) {
  firmware::Application application{{.board_name = "made_up"}};
  Power<MadeUpHardware> power{MadeUpHardware::supply_ratio};
  power.take_parameters(application);
  int due = 0;
  constexpr int ticks = 4000;
  for (int tick = 0; tick < ticks; ++tick) {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
      power.ISR_tick(axis, application.ISR_axes());
    power.hardware().advance(50e-6);
    if (!power.drives().main_loop_due()) continue;
    ++due;
    application.set_readings(power.readings());
    application.poll(static_cast<std::uint32_t>(tick) * 50);
    power.poll(application, static_cast<std::uint32_t>(tick) * 50);
  }
  EXPECT_NEAR(due, ticks / static_cast<int>(firmware::Axes::round_ticks), 1);
  EXPECT_TRUE(power.ready());
  EXPECT_EQ(power.condition(), Fault::none);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    EXPECT_EQ(application.ISR_report(axis).tick, application.ISR_report(0).tick);
    EXPECT_GE(application.ISR_report(axis).tick, static_cast<std::uint32_t>(ticks - 1));
    EXPECT_EQ(application.ISR_report(axis).condition, Fault::none);
  }
}

/// Makes no force, and keeps what it was shown.
struct Onlooker {
  static constexpr bool needs_all_positions = true;
  using Positions = firmware::AxesPositions<firmware::axis_count>;
  struct Settings {};
  static Settings settings(const firmware::ParameterValues&) { return {}; }
  static bool couples(const firmware::ParameterValues&, std::size_t, std::size_t) { return false; }
  float ISR_force(const Settings&, std::size_t, const Positions& at) {
    *seen = at;
    return 0.0f;
  }
  void ISR_rendered(const Settings&, std::size_t, const control::HapticLoop<float>::Output&, bool) {}
  Positions* seen;
};

TEST(MadeUpTicks, InTheSlotOfEachAxisALawSeesAllCountersAsTheyAreThen) {
  struct Stage {
    Fault condition() const { return Fault::none; }
  };
  Onlooker::Positions seen;
  Drives<MadeUpHardware> drives{MadeUpHardware::supply_ratio};
  drives.apply({});
  auto& counters = drives.hardware().counters;
  firmware::AxesTick<firmware::axis_count, Onlooker> axes{{}, {}, {&seen}};
  const auto tick = [&](std::size_t axis) { drives.ISR_tick(axis, axes, Stage{}); };
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) tick(axis);
  // More than half a timer's range in all, and a different way in every slot.
  for (int slot = 0; slot < 300; ++slot) {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
      counters[axis] = static_cast<std::uint16_t>(counters[axis] + 100 * (axis + 1));
    tick(static_cast<std::size_t>(slot) % firmware::axis_count);
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      EXPECT_TRUE(seen.valid[axis]);
      EXPECT_EQ(seen.position[axis], 100 * (static_cast<int>(axis) + 1) * (slot + 1)) << axis;
    }
  }
}

/// Drives under a stage whose condition changes with each look.
class Arming : public testing::Test {
 protected:
  struct Stage {
    Fault condition() const { return looks++ < good_looks ? Fault::none : then; }
    int good_looks = 1'000'000;
    Fault then = Fault::emergency_stop;
    mutable int looks = 0;
  };
  void drive(bool enabled) {
    AxisOutput output{};
    output.enabled = enabled;
    drives.ISR_drive(2, output, 24.0f, stage);
  }
  Fault condition() { return drives.ISR_measure(2, stage).condition; }
  MadeUpBridge& bridge() { return drives.hardware().bridge(2); }

  Drives<MadeUpHardware> drives{MadeUpHardware::supply_ratio};
  Stage stage;
};

TEST_F(Arming, ALineInterruptBetweenTheTicksLookAndTheArmingWins) {
  stage.good_looks = 1;
  EXPECT_EQ(condition(), Fault::none);
  drive(true);
  EXPECT_FALSE(bridge().armed());
  EXPECT_EQ(condition(), Fault::emergency_stop) << "found as what it is";
}

TEST_F(Arming, ABridgeThatFellOrWouldNotRiseIsThePowerStages) {
  drive(true);
  EXPECT_TRUE(bridge().armed());
  EXPECT_EQ(condition(), Fault::none);
  bridge().disarm();
  EXPECT_EQ(condition(), Fault::power_stage);
  drive(false);
  EXPECT_EQ(condition(), Fault::none);
  bridge().held_off = true;
  drive(true);
  EXPECT_EQ(condition(), Fault::power_stage);
  bridge().held_off = false;
  drive(false);
  drive(true);
  EXPECT_EQ(condition(), Fault::none);
  EXPECT_TRUE(bridge().armed());
}

TEST_F(Arming, ADutyThatIsNotANumberDisarms) {
  drive(true);
  AxisOutput output{};
  output.enabled = true;
  output.motor.duty_b = std::nanf("");
  drives.ISR_drive(2, output, 24.0f, stage);
  EXPECT_FALSE(bridge().armed());
}

}  // namespace kmax::board::made_up_board_test
