// A bus that fails under an armed axis: the control tick never misses, the axis loses its force, and the link
// is there again without a power cycle.
#include <gtest/gtest.h>

#include <bit>

#include "firmware/board_interface/can_port.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "tests/image/can_bench.hpp"

namespace kmax::tests::can_faults_test {

using firmware::DriveState;
using firmware::Fault;
using firmware::statusword::state_of;
using virtual_board::CanOutcome;

/// Axis 0 armed over CAN, far from its wall, so that it may be armed again wherever the hand has moved it.
class BusFaults : public testing::Test {
 protected:
  BusFaults() : bench({{"axis0.wall.law", std::string("plain")}, {"axis0.wall.position", -1.0}}, 1.0) {
    bench.start();
    state = state_of(static_cast<std::uint16_t>(bench.arm()));
  }

  /// Force is gone, named; no tick was missed.
  void expect_safe(Fault fault) {
    EXPECT_FALSE(bench.board->bridge_armed(0));
    EXPECT_FALSE(bench.board->bridge_armed(1));
    EXPECT_EQ(firmware::text_of(bench.fault(0)).name, firmware::text_of(fault).name);
    expect_no_tick_missed();
  }
  void expect_no_tick_missed() {
    EXPECT_EQ(bench.number("counters.missed_ticks"), 0U);
    EXPECT_EQ(bench.board->resets(), 1U);
  }

  /// A transfer, and the axis can be armed again.
  void expect_link_is_back() {
    bench.port.forget();
    EXPECT_EQ(bench.number(0x1018, 2), 1U);
    bench.write(0x6040, 0, 0x00, 2);
    bench.write(0x6040, 0, 0x80, 2);
    EXPECT_EQ(state_of(static_cast<std::uint16_t>(bench.arm())), DriveState::operation_enabled);
    expect_no_tick_missed();
  }

  CanBench bench;
  DriveState state{};
};

// The internal oscillator is right within 1 %, a bus wants 0.5.
TEST(BusClock, WithoutItsCrystalTheNodeStaysOffTheBus) {
  CanBench bench;
  bench.board->chip().peripherals().rcc.set_crystal_works(false);
  bench.board->pull_reset();
  bench.start();
  EXPECT_EQ(bench.number("info.clock_source"), 1U) << "at full speed all the same";
  EXPECT_EQ(bench.number("can.state"), static_cast<unsigned>(firmware::CanState::stopped));
  bench.board->chip().peripherals().rcc.set_crystal_works(true);
  bench.board->pull_reset();
  bench.start();
  EXPECT_EQ(bench.number("can.state"), static_cast<unsigned>(firmware::CanState::active));
}

TEST_F(BusFaults, NobodyAcknowledges) {
  ASSERT_EQ(state, DriveState::operation_enabled);
  bench.ask_for_telemetry();
  bench.nmt(0x01);
  bench.board->run_for(0.01);
  bench.port.node().set_connected(false, bench.board->now());
  bench.board->run_for(1.2);
  expect_safe(Fault::link_silent);
  // Error passive and not bus-off: a node that is alone may not silence itself (ISO 11898-1, fault
  // confinement).
  EXPECT_EQ(bench.number("can.state"), static_cast<std::uint32_t>(firmware::CanState::error_passive));
  EXPECT_EQ(bench.number("can.bus_offs"), 0U);
  EXPECT_GT(bench.number("can.tpdo_held_back"), 1000U);
  bench.port.node().set_connected(true, bench.board->now());
  bench.board->run_for(0.1);
  EXPECT_EQ(bench.number("can.state"), static_cast<std::uint32_t>(firmware::CanState::active));
  expect_link_is_back();
}

TEST_F(BusFaults, BusOffAndBack) {
  ASSERT_EQ(state, DriveState::operation_enabled);
  bench.nmt(0x01);
  bench.board->run_for(0.01);
  // Every frame of this node is destroyed: 32 attempts later it is off the bus.
  bench.board->can_bus().destroy_frames_of(bench.board->chip().peripherals().can1.node());
  bench.board->can_bus().destroy_frames(40);
  bench.board->run_for(0.02);
  expect_safe(Fault::bus_off);
  EXPECT_EQ(bench.number("can.state"), static_cast<std::uint32_t>(firmware::CanState::bus_off));
  EXPECT_EQ(bench.number("can.bus_offs"), 1U);
  bench.board->can_bus().destroy_frames(0);
  bench.port.forget();
  bench.board->run_for(0.3);
  EXPECT_EQ(bench.number("can.node_state"), 127U) << "the error behaviour's default";
  // The axis' fault and the bus-off itself are told when that is possible again.
  bool reported = false;
  while (const auto emergency = bench.next(0x081, 0.001))
    reported = reported || (emergency->frame.data[1] == 0x81);
  EXPECT_TRUE(reported);
  expect_link_is_back();
}

TEST_F(BusFaults, ABabblingNodeTakesTheWholeBus) {
  ASSERT_EQ(state, DriveState::operation_enabled);
  virtual_board::CanHostNode babbler(bench.board->can_bus(), 1'000'000);
  // The most urgent identifier there is, addressed to another node: heard by this one, 20,000 times a second.
  babbler.babble(drivers::CanFrame{.identifier = 0, .length = 2, .data = {1, 99}}, bench.board->now());
  const double busy_before = virtual_board::seconds(bench.board->can_bus().busy_time());
  bench.board->run_for(1.2);
  EXPECT_GT(virtual_board::seconds(bench.board->can_bus().busy_time()) - busy_before, 1.19) << "full load";
  expect_safe(Fault::link_silent);
  babbler.babble(std::nullopt, bench.board->now());
  bench.board->run_for(0.05);
  expect_link_is_back();
}

TEST_F(BusFaults, SegmentsAreLostAndRepeated) {
  std::vector<std::uint8_t> bytes(2000);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 7);
  bench.sdo.download({0x5822, 1}, bytes, true);
  // Destroyed frames are repeated by the controllers; nobody above notices.
  for (const std::uint64_t every : {1, 3, 7}) {
    bench.board->can_bus().destroy_frames_of(nullptr);
    bench.board->can_bus().destroy_frames(every, CanOutcome::crc_error);
    EXPECT_EQ(bench.sdo.upload({0x5822, 1}, bytes.size()), bytes);
  }
  expect_no_tick_missed();
}

TEST_F(BusFaults, TwoNodesHaveOneIdentifier) {
  ASSERT_EQ(state, DriveState::operation_enabled);
  virtual_board::CanHostNode twin(bench.board->can_bus(), 1'000'000);
  bench.port.forget();
  for (int i = 0; i < 20; ++i) {
    twin.send({.identifier = 0x701, .length = 1, .data = {0x05}}, bench.board->now());
    bench.board->run_for(0.01);
  }
  EXPECT_EQ(bench.number("can.identity_conflicts"), 20U);
  const auto reported = bench.next(0x081, 0.1);
  ASSERT_TRUE(reported);
  EXPECT_EQ(reported->frame.data[0] | reported->frame.data[1] << 8, 0x8100);
  // Its answers come beside this node's.
  twin.on_frame([&](const drivers::CanFrame& frame, virtual_board::BoardTime now) {
    if (frame.identifier == 0x601)
      twin.send({.identifier = 0x581, .length = 8, .data = {0x43, 0x18, 0x10, 2, 9, 9, 9, 9}}, now);
  });
  for (int i = 0; i < 50; ++i) {
    bench.port.send({.identifier = 0x601, .length = 8, .data = {0x40, 0x18, 0x10, 2}});
    bench.board->run_for(0.002);
  }
  expect_no_tick_missed();
  twin.on_frame({});
  twin.set_connected(false, bench.board->now());
  bench.board->run_for(1.5);
  EXPECT_FALSE(bench.board->bridge_armed(0)) << "the host is silent";
  expect_link_is_back();
}

TEST_F(BusFaults, AFloodOfWritesDoesNotStarveTheMainLoop) {
  ASSERT_EQ(state, DriveState::operation_enabled);
  bench.port.node().on_frame({});
  // Each of them changes a parameter and so the settings of the tick. They are no signs of life of whoever
  // commands, so some of those are in between.
  for (std::uint32_t i = 0; i < 12'000; ++i) {
    if (i % 500 == 0)
      bench.port.send({.identifier = 0x601, .length = 8, .data = {0x2B, 0x01, 0x58, 2, 0, 0, 0, 0}});
    const auto value = std::bit_cast<std::uint32_t>(i % 2 == 0 ? 2.4f : 2.5f);
    bench.port.send({.identifier = 0x601,
                     .length = 8,
                     .data = {0x23, 0x00, 0x20, 8, static_cast<std::uint8_t>(value),
                              static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value >> 16),
                              static_cast<std::uint8_t>(value >> 24)}});
  }
  bench.board->run_for(1.6);
  EXPECT_TRUE(bench.board->bridge_armed(0)) << firmware::text_of(bench.fault(0)).name;
  expect_no_tick_missed();
}

TEST_F(BusFaults, ParametersInPdosAtAKilohertzDoNotStarveTheMainLoop) {
  ASSERT_EQ(state, DriveState::operation_enabled);
  bench.write(0x6040, 0, 0x00, 2);  // receive PDOs and their mapping change only while disarmed
  bench.write(0x1402, 1, 0x80000401, 4);
  bench.write(0x1602, 0, 0, 1);
  bench.write(0x1602, 1, 0x20000820, 4);
  bench.write(0x1602, 2, 0x28000820, 4);
  bench.write(0x1602, 0, 2, 1);
  bench.write(0x1402, 1, 0x401, 4);
  bench.nmt(0x01);
  ASSERT_EQ(state_of(static_cast<std::uint16_t>(bench.arm())), DriveState::operation_enabled);
  for (int i = 0; i < 1000; ++i) {
    if (i % 200 == 0) bench.write(0x5801, 2, 0, 2);  // settings are no sign of life
    bench.port.send({.identifier = 0x401,
                     .length = 8,
                     .data = {0, static_cast<std::uint8_t>(i % 2 * 0x80), 0x1A, 0x40, 0,
                              static_cast<std::uint8_t>(i % 2 * 0x80), 0x1A, 0x40}});
    bench.board->run_for(1e-3);
  }
  EXPECT_TRUE(bench.board->bridge_armed(0)) << firmware::text_of(bench.fault(0)).name;
  expect_no_tick_missed();
}

// Initialization waits for the end of the frame on the bus, which at 125 kbit/s lasts a millisecond.
TEST_F(BusFaults, ANewBitRateOnABusyBusIsTakenOverInTheEnd) {
  const auto set_rate = [&](std::uint32_t rate) {
    bench.master->write_holding(
        firmware::register_address(firmware::entry_of<"can.bit_rate">(), 0),
        std::array{static_cast<std::uint16_t>(rate >> 16), static_cast<std::uint16_t>(rate)});
  };
  const auto follow = [&](std::uint32_t rate) {
    bench.port.node().set_bit_time(virtual_board::units_per_second / rate, bench.board->now());
  };
  set_rate(125'000);
  bench.nmt(0x82);
  bench.board->run_for(0.00015);
  follow(125'000);
  bench.board->run_for(3.0);
  EXPECT_EQ(bench.number("can.state"), static_cast<std::uint32_t>(firmware::CanState::active));
  virtual_board::CanHostNode other(bench.board->can_bus(), 125'000);
  set_rate(1'000'000);
  for (int i = 0; i < 40; ++i)
    other.send({.identifier = 0x1FFFFFFF, .extended = true, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}},
               bench.board->now());
  bench.nmt(0x82);
  bench.board->run_for(0.2);
  other.set_connected(false, bench.board->now());
  follow(1'000'000);
  bench.board->run_for(3.0);
  EXPECT_EQ(bench.number("can.state"), static_cast<std::uint32_t>(firmware::CanState::active));
  expect_link_is_back();
}

}  // namespace kmax::tests::can_faults_test
