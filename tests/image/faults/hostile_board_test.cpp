// The image on a board as unfriendly as a real one: parts that break, interference on lines without a filter,
// a select behind a filter. What is real must still be found, and in time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "board/odrive_v3/voltage_variant.hpp"
#include "firmware/parameters/refusal.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests::hostile_board_test {

using firmware::Fault;
using firmware::Refusal;
using simulation::SpikesConfig;
using virtual_board::BoardTime;
using virtual_board::seconds;
using virtual_board::units_per_microsecond;

constexpr std::size_t axes = firmware::axis_count;

/// Both axes in mode torque, each held by a person.
class Bench : public ImageBench {
 public:
  explicit Bench(const std::optional<SpikesConfig>& spikes = {}, const Parameters& parameters = {})
      : ImageBench(scene_with(spikes, parameters)) {
    start();
    for (std::size_t axis = 0; axis < axes; ++axis) write("drive.mode", axis, 2);
  }
  /// Clears what there is, and drives both axes with 2.5 N against the hands.
  void drive() {
    for (std::size_t axis = 0; axis < axes; ++axis) {
      for (const unsigned word : {0x00, 0x80, 0x06, 0x07, 0x0F}) write("drive.controlword", axis, word);
      write_real("profile.target_force", axis, 2.5f);
    }
  }
  /// The cause is gone: clears until all is well.
  void recover() {
    for (int tries = 0; tries < 60 && !board->healthy(); ++tries) {
      for (std::size_t axis = 0; axis < axes; ++axis)
        for (const unsigned word : {0x00, 0x80, 0x00}) write("drive.controlword", axis, word);
      board->run_for(0.01);
    }
    ASSERT_TRUE(board->healthy());
  }
  bool gates_off() const { return !board->gates_active(0) && !board->gates_active(1); }
  /// s until the gates are off; more than `longest`: they are not.
  double until_gates_are_off(double longest) {
    const BoardTime begin = board->now();
    while (!gates_off() && seconds(board->now() - begin) <= longest) board->run_until(board->now() + 20);
    return seconds(board->now() - begin);
  }
  /// Of the next `duration`, in which no gate may be active again once they are off.
  bool gates_stay_off(double duration) {
    const BoardTime end = board->now() + static_cast<BoardTime>(duration * 336e6);
    while (board->now() < end) {
      if (!gates_off()) return false;
      board->run_until(board->now() + units_per_microsecond);
    }
    return true;
  }

 private:
  static simulation::Scene scene_with(const std::optional<SpikesConfig>& spikes,
                                      const Parameters& parameters) {
    Parameters all{{"link.timeout", 0.0}, {"velocity.limit", 10.0}, {"axis1.velocity.limit", 10.0}};
    for (const std::string prefix : {"", "axis1."}) {
      all.push_back({prefix + "wall.law", std::string("none")});
      all.push_back({prefix + "encoder.index", std::string("once_per_turn")});
    }
    all.insert(all.end(), parameters.begin(), parameters.end());
    simulation::Scene scene = with(simulated_board::open_scene("motor_axes"), all, 1.0);
    scene.spikes = spikes;
    return scene;
  }
};

SpikesConfig only(bool SpikesConfig::*line, double width, double rate, bool at_samples = false) {
  SpikesConfig spikes{.width = width, .rate = rate, .at_samples = at_samples};
  spikes.index = spikes.emergency_stop = spikes.fault_line = spikes.encoder = false;
  spikes.*line = true;
  return spikes;
}

TEST(HostilePartRatings, ALimitThatWasStoredAboveTheBoardsPartsDoesNotLetThemBreak) {
  const auto ceiling =
      static_cast<double>(board::odrive_v3::supply_ceiling(board::odrive_v3::VoltageVariant::v24));
  Bench bench({}, {{"supply.voltage_max", 100.0}});
  bench.drive();
  bench.board->run_for(0.05);
  ASSERT_FALSE(bench.gates_off());
  // As a motor that brakes does: 20 A into 1 mF.
  double volts = 24.0;
  while (!bench.gates_off() && volts < 35.0) {
    bench.world.supply().set_voltage(volts += 1.0 / 4.0);
    bench.board->run_for(tick_s / 4.0);
  }
  EXPECT_LT(volts, ceiling + 2.0) << "they break at 28.75 V";
  bench.board->run_for(0.01);
  EXPECT_EQ(bench.fault(0), Fault::over_voltage);
  EXPECT_EQ(bench.fault(1), Fault::over_voltage);
  EXPECT_EQ(std::bit_cast<float>(bench.number("supply.ceiling")), static_cast<float>(ceiling));
  EXPECT_EQ(bench.number("store.migrated_defaulted"), 1U);
  EXPECT_THROW(bench.write_real("supply.voltage_max", 0, 28.0f), std::runtime_error);
  bench.write_real("supply.voltage_max", 0, static_cast<float>(ceiling));
}

/// Nothing trips, the force stays and the count is right.
void expect_undisturbed(Bench& bench, double duration) {
  bench.drive();
  bench.board->run_for(0.3);
  for (int n = 0; n < static_cast<int>(duration / 0.05); ++n) {
    bench.board->run_for(0.05);
    for (std::size_t axis = 0; axis < axes; ++axis) {
      ASSERT_EQ(bench.fault(axis), Fault::none)
          << axis << " " << firmware::text_of(bench.fault(axis)).name << " after " << bench.board->spikes();
      EXPECT_TRUE(bench.board->bridge_armed(axis));
      EXPECT_NEAR(bench.world.drive(axis).force(), 2.5, 0.5) << axis;
      const auto counted = static_cast<std::int32_t>(bench.master->read_input(
          firmware::register_address(firmware::find_entry("measured.count"), axis), 2)[1]);
      const auto edges = bench.world.drive(axis).encoder().edges();
      EXPECT_LE(std::abs(static_cast<std::int16_t>(counted - static_cast<std::int32_t>(edges))), 8) << axis;
    }
  }
  EXPECT_GT(bench.board->spikes(), 15U);
}

/// Each spike, but what came since the readings were made.
void expect_counted(Bench& bench) {
  const std::uint64_t spikes = bench.board->spikes();
  bench.board->run_for(1e-3);
  const std::uint32_t forgiven = bench.number("counters.interference_forgiven");
  EXPECT_GE(forgiven, spikes);
  EXPECT_LE(forgiven, bench.board->spikes());
}

TEST(HostileLines, ASpikeOnTheIndexWhereTheFirmwareLooksIsNoIndexAndNoLooseCable) {
  Bench bench(only(&SpikesConfig::index, 1e-6, 2000.0, true));
  expect_undisturbed(bench, 1.0);
}

TEST(HostileLines, ASpikeOnTheEmergencyStopTakesMicrosecondsOfForceAndNothingElse) {
  for (const double width : {50e-9, 0.5e-6, 1e-6}) {
    SCOPED_TRACE(width);
    Bench bench(only(&SpikesConfig::emergency_stop, width, 200.0));
    expect_undisturbed(bench, 0.3);
    expect_counted(bench);
  }
}

TEST(HostileLines, ASpikeOnTheFaultLineTakesMicrosecondsOfForceAndNothingElse) {
  for (const double width : {50e-9, 0.5e-6, 1e-6}) {
    SCOPED_TRACE(width);
    Bench bench(only(&SpikesConfig::fault_line, width, 200.0));
    expect_undisturbed(bench, 0.3);
    expect_counted(bench);
  }
}

// Once in most periods is no interference that can be lived with: the current loop would be without samples.
TEST(HostileLines, ALineThatIsDisturbedAllTheTimeIsAFaultByItsOwnName) {
  for (const bool stop : {true, false}) {
    Bench bench(only(stop ? &SpikesConfig::emergency_stop : &SpikesConfig::fault_line, 0.5e-6, 20'000.0));
    bench.drive();
    bench.board->run_for(0.02);
    EXPECT_TRUE(bench.gates_off());
    // Before the second axis was armed, perhaps: the first one's bridge makes spikes, too.
    EXPECT_EQ(bench.fault(0), stop ? Fault::emergency_stop : Fault::gate_driver);
  }
}

TEST(HostileLines, ASpikeOnTheEncoderLinesIsNotCounted) {
  Bench bench(only(&SpikesConfig::encoder, 1e-6, 500.0));
  expect_undisturbed(bench, 0.3);
}

TEST(HostileLines, AllAtOnceAtTheEdges) {
  Bench bench(SpikesConfig{.width = 0.3e-6, .rate = 200.0});
  expect_undisturbed(bench, 0.5);
}

/// Whatever is real among the spikes: in time, for good, and by its name.
TEST(HostileLines, WhatIsRealIsStillFoundInTimeAmongSpikes) {
  std::mt19937_64 random{1};
  Bench bench(SpikesConfig{.width = 0.5e-6, .rate = 200.0, .at_samples = true});
  double slowest = 0.0;
  for (int n = 0; n < 40; ++n) {
    bench.drive();
    bench.board->run_for(0.003);
    bench.board->run_until(bench.board->now() + random() % ticks(20));
    const bool stop = n % 2 == 0;
    stop ? bench.board->open_emergency_stop(true) : bench.board->hold_fault_line(true);
    slowest = std::max(slowest, bench.until_gates_are_off(100e-6));
    EXPECT_TRUE(bench.gates_stay_off(300e-6)) << n;
    bench.board->run_for(0.005);
    for (std::size_t axis = 0; axis < axes; ++axis)
      EXPECT_EQ(bench.fault(axis), stop ? Fault::emergency_stop : Fault::gate_driver) << n;
    stop ? bench.board->open_emergency_stop(false) : bench.board->hold_fault_line(false);
    bench.recover();
  }
  EXPECT_LT(slowest, 2e-6);
  RecordProperty("slowest_us", std::to_string(slowest * 1e6));
}

TEST(HostileLines, AContactThatBouncesWhileItOpensStopsForGood) {
  std::mt19937_64 random{2};
  Bench bench;
  for (int n = 0; n < 20; ++n) {
    bench.drive();
    bench.board->run_for(0.003);
    // Open too shortly to be meant, closed long enough to go on; as often as is forgiven, and more often.
    bool came_back = false;
    const int bounces = 1 + 2 * n;
    for (int bounce = 0; bounce < bounces; ++bounce) {
      bench.board->open_emergency_stop(true);
      bench.board->run_until(bench.board->now() + units_per_microsecond / 5 +
                             random() % (units_per_microsecond / 2));
      bench.board->open_emergency_stop(false);
      bench.board->run_until(bench.board->now() + 4 * units_per_microsecond +
                             random() % (5 * units_per_microsecond));
      came_back = came_back || !bench.gates_off();
    }
    EXPECT_TRUE(came_back) << n;
    // 20 are forgiven, and five more if a millisecond passes meanwhile.
    if (bounces <= 20 || bounces > 25) {
      EXPECT_EQ(bench.gates_off(), bounces > 25) << n;
    }
    bench.board->open_emergency_stop(true);
    EXPECT_LT(bench.until_gates_are_off(100e-6), 2e-6) << n;
    EXPECT_TRUE(bench.gates_stay_off(300e-6)) << n;
    bench.board->open_emergency_stop(false);
    bench.board->run_for(0.005);
    for (std::size_t axis = 0; axis < axes; ++axis) EXPECT_EQ(bench.fault(axis), Fault::emergency_stop) << n;
    bench.recover();
  }
}

TEST(HostileLines, ACableThatComesOffIsFoundWithinThreeTicks) {
  Bench bench(only(&SpikesConfig::index, 0.5e-6, 1000.0, true));
  bench.drive();
  bench.board->run_for(0.5);
  ASSERT_EQ(bench.fault(0), Fault::none);
  for (std::size_t axis = 0; axis < axes; ++axis) {
    bench.world.connect_encoder(axis, false);
    const BoardTime begin = bench.board->now();
    while (bench.board->bridge_armed(axis) && bench.board->now() < begin + ticks(20))
      bench.board->run_until(bench.board->now() + units_per_microsecond);
    EXPECT_LT(seconds(bench.board->now() - begin), 4.5 * tick_s) << axis;
    bench.board->run_for(0.01);
    EXPECT_EQ(bench.fault(axis), Fault::encoder) << axis;
  }
}

TEST(HostileSelect, TheAs5047psFramesAreItsOwnBehindTheFilterToo) {
  // Beside an axis that is there, and one whose ticks are passed over, the shortest there are.
  for (const auto& [filtered, beside] :
       {std::pair{false, "no"}, {true, "no"}, {false, "yes"}, {true, "yes"}}) {
    simulation::Scene scene = simulated_board::open_scene("gimbal_a");
    ASSERT_EQ(scene.axes[0].encoder.kind, simulation::EncoderKind::as5047p);
    scene.axes[0].encoder.select_filtered = filtered;
    scene.parameters.push_back({"axis1.drive.declared_absent", std::string(beside), "test"});
    ImageBench bench(scene);
    bench.start();
    const auto late = bench.board->serial_encoder().late_selects();
    bench.board->run_for(0.1);
    EXPECT_EQ(bench.board->serial_encoder().late_selects(), late) << filtered;
    const auto refusal = [&bench] {
      for (const unsigned word : {0x00, 0x80, 0x06, 0x07, 0x0F}) bench.write("drive.controlword", 0, word);
      const auto why = bench.reading(firmware::entry_of<"drive.refusal">(), 0);
      bench.write("drive.controlword", 0, 0x06);
      return static_cast<Refusal>(why);
    };
    EXPECT_NE(refusal(), Refusal::encoder_invalid) << filtered;
    // Whoever talks to the gate drivers meanwhile meets no encoder on the bus, and it is back after that.
    bench.write_real("current.limit", 0, 20.0f);
    bench.board->run_for(0.2);
    bench.start();
    EXPECT_NE(refusal(), Refusal::encoder_invalid) << filtered;
    EXPECT_EQ(bench.board->serial_encoder().late_selects(), late) << filtered;
  }
}

}  // namespace kmax::tests::hostile_board_test
