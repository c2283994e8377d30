// The application on a CAN bus: who commands, and what takes the force away.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "firmware/object_dictionary/special_objects.hpp"
#include "tests/board/canopen_host.hpp"

namespace kmax::board::canopen_edge_bus_test {
namespace {

using firmware::Fault;

class OnCan : public testing::Test, public CanOpenHost {
 protected:
  OnCan() {
    bench.set_up_plain_wall();
    bench.set("wall.law", 0);
    bench.set("link.timeout", 0.5);
  }
};

TEST_F(OnCan, TorqueModeMakesWhatPdosAskForAndNothingWhenDisarmed) {
  nmt(1);
  EXPECT_EQ(write(0x6060, 0, 10, 1), 0U);
  rpdo(0, 700);
  EXPECT_EQ(read(0x6071, 0), 0U) << "a target is not kept for later";
  rpdo(6, 0);
  rpdo(7, 0);
  rpdo(15, 0);
  ASSERT_TRUE(armed());
  rpdo(15, 300, 300.0);
  const double force = bench.force();
  EXPECT_GT(force, 0.01);
  rpdo(15, -300, 5.0);
  EXPECT_NEAR(bench.force(), -force, 1e-3 * force);
  rpdo(15 | 0x100, 300, 5.0);
  EXPECT_EQ(bench.force(), 0.0) << "halt";
  EXPECT_TRUE(armed());
  rpdo(6, 300, 5.0);
  EXPECT_EQ(bench.force(), 0.0);
  rpdo(15, 0);
  EXPECT_EQ(bench.force(), 0.0) << "armed again, and nothing asked for";
}

TEST_F(OnCan, TorqueModeMakesTheNewtonsThatAPdoAsksFor) {
  EXPECT_EQ(write(0x1400, 1, 0x80000201, 4), 0U);
  EXPECT_EQ(write(0x1600, 0, 0, 1), 0U);
  EXPECT_EQ(write(0x1600, 1, 0x60400010, 4), 0U);
  EXPECT_EQ(write(0x1600, 2, 0x20170A20, 4), 0U);
  EXPECT_EQ(write(0x1600, 0, 2, 1), 0U);
  EXPECT_EQ(write(0x1400, 1, 0x201, 4), 0U);
  nmt(1);
  EXPECT_EQ(write(0x6060, 0, 10, 1), 0U);
  const auto ask = [this](std::uint8_t controlword, float newtons, double ms) {
    const auto bits = std::bit_cast<std::uint32_t>(newtons);
    send({.identifier = 0x201,
          .length = 6,
          .data = {controlword, 0, static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8),
                   static_cast<std::uint8_t>(bits >> 16), static_cast<std::uint8_t>(bits >> 24)}},
         ms);
  };
  ask(6, 1.5f, 2.0);
  EXPECT_EQ(read(0x2017, 10), 0U) << "a target is not kept for later";
  ask(7, 0.0f, 2.0);
  ask(15, 0.0f, 2.0);
  ASSERT_TRUE(armed());
  ask(15, 1.5f, 300.0);
  EXPECT_NEAR(bench.force(), 1.5, 1e-3);
  ask(15, -1.5f, 5.0);
  EXPECT_NEAR(bench.force(), -1.5, 1e-3);
  ask(15, 100.0f, 20.0);
  EXPECT_NEAR(bench.force(), 3.3, 1e-3) << "force.limit";
  ask(6, 1.5f, 5.0);
  EXPECT_EQ(bench.force(), 0.0);
}

// The one who commands has gone; a second program reads on.
TEST_F(OnCan, AValueOutOfRangeIsSaidToBeTooHighOrTooLow) {
  constexpr std::uint32_t too_high = 0x0609'0031, too_low = 0x0609'0032;
  EXPECT_EQ(write(0x2000, 4, std::bit_cast<std::uint32_t>(2e6f), 4), too_high);
  EXPECT_EQ(write(0x2000, 4, std::bit_cast<std::uint32_t>(-1.0f), 4), too_low);
  EXPECT_EQ(write(0x2003, 2, 17, 1), too_high);
  EXPECT_EQ(write(0x2003, 2, 0, 1), too_low);
  EXPECT_EQ(write(0x200B, 2, 3, 4), too_low);
  EXPECT_EQ(write(0x200B, 2, 0xFFFF'FFFF, 4), too_high);
}

TEST_F(OnCan, ListensToAllThatItReceives) {
  const auto& settings = bench.application().can().settings();
  const auto begin = settings.identifiers.begin();
  for (const int identifier : {0x000, 0x080, 0x201, 0x301, 0x581, 0x601, 0x701, 0x7E5})
    EXPECT_NE(std::find(begin, begin + settings.identifier_count, identifier),
              begin + settings.identifier_count)
        << identifier;
}

TEST_F(OnCan, ListensToTheNodesThatItWatches) {
  EXPECT_EQ(write(0x1016, 1, 1U << 16 | 100, 4), 0U);
  EXPECT_EQ(write(0x1016, 2, 0x7FU << 16 | 100, 4), 0U);
  EXPECT_EQ(write(0x1016, 3, 5U << 16, 4), 0U) << "without a time it is not watched";
  const auto settings = bench.application().can().settings();
  const auto heard_of = [&settings](int node) {
    const auto begin = settings.identifiers.begin();
    return std::count(begin, begin + settings.identifier_count, 0x700 + node);
  };
  for (int node = 0; node < 0x80; ++node)
    EXPECT_EQ(heard_of(node), node == 1 ? 2 : node == 0x7F ? 1 : 0) << node;
}

TEST_F(OnCan, PdosBeginWithTheNextRoundButOne) {
  heard.clear();
  bench.board().receive_can(std::array{drivers::CanFrame{.identifier = 0, .length = 2, .data = {1, 1}}});
  int ticks = 0;
  for (; heard.empty() && ticks < 1000; ++ticks) run_ms(0.05);
  EXPECT_EQ(ticks, 2 * firmware::Axes::round_ticks);
}

TEST_F(OnCan, ACaptureIsAsLongAsItsSamples) {
  const auto set = [this](std::string_view name, double number) {
    ASSERT_EQ(bench.set(name, number), 0) << name;
  };
  set("capture.channel_1", 1);
  set("capture.channel_2", 3);
  set("capture.samples", 10);
  set("capture.command", 1);
  run_ms(5);
  ASSERT_EQ(bench.get("capture.taken"), 10);
  heard.clear();
  send({.identifier = 0x601, .length = 8, .data = {0x40, 0x21, 0x58, 1}});
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.front().data[0], 0x41);
  EXPECT_EQ(heard.front().data[4], 4 * 10 * 2);
}

TEST_F(OnCan, ReadingKeepsNobodysForceAlive) {
  arm_torque(300);
  ASSERT_TRUE(armed());
  for (int i = 0; i < 30; ++i) {
    read(0x6041, 0);
    run_ms(18);
  }
  EXPECT_EQ(fault(), Fault::link_silent);
  EXPECT_EQ(bench.force(), 0.0);
}

TEST_F(OnCan, NeitherDoPdosThatAreTooShort) {
  nmt(1);
  arm_torque(300);
  for (int i = 0; i < 30; ++i) send({.identifier = 0x201, .length = 1}, 20);
  EXPECT_EQ(fault(), Fault::link_silent);
}

TEST_F(OnCan, WritingIsASignOfLife) {
  arm_torque(300);
  for (std::uint32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(write(0x5801, 2, i, 2), 0U);
    run_ms(18);
  }
  EXPECT_TRUE(armed());
}

TEST_F(OnCan, LeavingOperationalDisarmsAnAxisWhoseTargetNobodyCanChange) {
  nmt(1);
  arm_torque(300);
  ASSERT_TRUE(armed());
  nmt(0x80);
  EXPECT_FALSE(armed());
  EXPECT_EQ(bench.force(), 0.0);
}

TEST_F(OnCan, NmtStopAndBothResetsTakeTheForce) {
  for (const unsigned command : {0x02U, 0x81U, 0x82U}) {
    CanOpenHost host;
    host.bench.set_up_plain_wall();
    host.bench.set("wall.law", 0);
    host.arm_torque(300);
    ASSERT_TRUE(host.armed());
    host.nmt(static_cast<std::uint8_t>(command));
    EXPECT_FALSE(host.armed()) << command;
    EXPECT_EQ(host.bench.force(), 0.0);
  }
}

TEST_F(OnCan, ASynchronousPdoIsNotKeptForLater) {
  EXPECT_EQ(write(0x6060, 0, 10, 1), 0U);
  EXPECT_EQ(write(0x1400, 2, 1, 1), 0U);
  nmt(1);
  command(6);
  command(7);
  rpdo(15, 100, 5000.0);
  send({.identifier = 0x80}, 20);
  EXPECT_FALSE(armed());
  rpdo(7, 0);
  send({.identifier = 0x80}, 5);
  rpdo(15, 100);
  send({.identifier = 0x80}, 20);
  EXPECT_TRUE(armed());
}

TEST_F(OnCan, AWatchedNodeThatIsLostTripsAndMustBeBackFirst) {
  EXPECT_EQ(write(0x1016, 1, 5U << 16 | 100, 4), 0U);
  heartbeat_of(5);
  command(6);
  command(15);
  ASSERT_TRUE(armed());
  run_ms(200);
  EXPECT_EQ(fault(), Fault::heartbeat_lost);
  command(0);
  command(0x80);
  EXPECT_EQ(fault(), Fault::heartbeat_lost) << "the cause remains";
  heartbeat_of(5);
  command(0);
  command(0x80);
  EXPECT_EQ(fault(), Fault::none);
  run_ms(200);
  command(6);
  command(15);
  EXPECT_FALSE(armed());
  EXPECT_EQ(bench.refusal(), Refusal::heartbeat_missing);
}

// CiA 301: 0x8130, of the node that is meant, while it is silent and no longer than it is watched.
TEST_F(OnCan, ANodeThatFallsSilentIsAnErrorUntilItIsBackOrNoLongerWatched) {
  const auto emergency = [this] {
    for (const drivers::CanFrame& frame : heard) {
      if (frame.identifier == 0x081) return frame.data;
    }
    return std::array<std::uint8_t, 8>{0xEE};
  };
  for (const bool comes_back : {true, false}) {
    EXPECT_EQ(write(0x1016, 1, 5U << 16 | 100, 4), 0U);
    heartbeat_of(5);
    EXPECT_EQ(read(0x1001, 0), 0U);
    heard.clear();
    run_ms(200);
    EXPECT_EQ(emergency(), (std::array<std::uint8_t, 8>{0x30, 0x81, 0x11, 0x85}));
    EXPECT_EQ(read(0x1001, 0), 0x11U);
    heard.clear();
    if (comes_back) {
      heartbeat_of(5);
    } else {
      EXPECT_EQ(write(0x1016, 1, 0, 4), 0U);
      run_ms(200);
    }
    EXPECT_EQ(read(0x1001, 0), 0U);
  }
}

TEST(CanopenEdge, TheFaultOfEachAxisIsToldWithItsNumber) {
  for (std::uint8_t axis = 0; axis < firmware::axis_count; ++axis) {
    CanOpenHost host;
    host.bench.set_up_plain_wall(axis);
    host.bench.preset("velocity.limit", 0.01, axis);
    host.bench.device.stand_at(1000, axis);
    host.run_ms(5);
    ASSERT_TRUE(host.bench.arm(axis));
    host.run_ms(1);
    host.heard.clear();
    host.bench.device.stand_at(100'000, axis);
    host.run_ms(5);
    ASSERT_EQ(host.bench.application().fault(axis), Fault::over_speed);
    const auto report = std::find_if(host.heard.begin(), host.heard.end(),
                                     [](const auto& frame) { return frame.identifier == 0x081; });
    ASSERT_NE(report, host.heard.end()) << int{axis};
    const auto& data = report->data;
    EXPECT_EQ(data[0] | data[1] << 8, 0x8480);
    EXPECT_EQ(data[3], axis);
    EXPECT_EQ(std::bit_cast<float>(data[4] | data[5] << 8 | data[6] << 16 | data[7] << 24),
              static_cast<float>(host.bench.get("drive.fault_value", axis)));
  }
}

// The bus' own times are looked at once a millisecond; what has happened to an axis does not wait for that.
TEST(CanopenEdge, AFaultIsSentInTheRoundThatFindsItWheneverItComes) {
  constexpr double round_ms = 0.2;
  for (int offset = 0; offset < 10; ++offset) {
    CanOpenHost host;
    host.bench.set_up_plain_wall();
    host.bench.preset("velocity.limit", 0.01, 0);
    host.bench.device.stand_at(1000, 0);
    host.run_ms(5);
    ASSERT_TRUE(host.bench.arm());
    host.run_ms(1 + 0.1 * offset);
    host.heard.clear();
    host.bench.device.stand_at(100'000, 0);
    for (int i = 0; i < 100 && host.bench.application().fault(0) == Fault::none; ++i) host.run_ms(0.05);
    ASSERT_EQ(host.bench.application().fault(0), Fault::over_speed);
    host.run_ms(round_ms);
    EXPECT_TRUE(std::ranges::any_of(host.heard, [](const auto& frame) { return frame.identifier == 0x081; }))
        << offset;
  }
}

TEST_F(OnCan, AWatchedNodeThatIsLostDoesNotTripWhatSerialHasArmed) {
  EXPECT_EQ(write(0x1016, 1, 5U << 16 | 100, 4), 0U);
  heartbeat_of(5);
  ASSERT_TRUE(bench.arm());
  run_ms(200);
  EXPECT_EQ(bench.get("can.heartbeats_lost"), 1);
  EXPECT_TRUE(armed());
  EXPECT_EQ(fault(), Fault::none);
}

TEST_F(OnCan, AHeldResetBitIsNoEdgeAfterNmtStop) {
  EXPECT_EQ(write(0x1016, 1, 5U << 16 | 100, 4), 0U);
  heartbeat_of(5);
  command(6);
  command(15);
  command(0x8F);
  run_ms(200);
  ASSERT_EQ(fault(), Fault::heartbeat_lost);
  heartbeat_of(5);
  command(0x8F);
  EXPECT_EQ(fault(), Fault::heartbeat_lost);
  nmt(2);
  nmt(0x80);
  command(0x8F);
  EXPECT_EQ(fault(), Fault::heartbeat_lost);
}

TEST(CanopenEdge, NmtStopAndResetTakeTheForceOfEveryAxisAway) {
  for (const std::uint8_t nmt_command : {std::uint8_t{0x02}, std::uint8_t{0x82}}) {
    CanOpenHost host;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      host.bench.set_up_plain_wall(axis);
      host.bench.device.stand_at(1000, axis);
    }
    host.run_ms(5);
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) ASSERT_TRUE(host.bench.arm(axis)) << axis;
    host.nmt(nmt_command);
    host.run_ms(1);
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
      EXPECT_NE(host.bench.state(axis), DriveState::operation_enabled) << axis;
  }
}

TEST_F(OnCan, ResetCommunicationBringsBackWhatWasSaved) {
  EXPECT_EQ(write(0x1017, 0, 50, 2), 0U);
  EXPECT_EQ(write(0x1010, 1, firmware::signature_save, 4), 0U);
  run_ms(500);
  EXPECT_EQ(write(0x1017, 0, 70, 2), 0U);
  nmt(0x82);
  EXPECT_EQ(read(0x1017, 0), 50U);
}

TEST_F(OnCan, SavingTheSameAgainDoesNotWearTheFlash) {
  EXPECT_EQ(write(0x1010, 1, firmware::signature_save, 4), 0U);
  run_ms(500);
  const firmware::Entry& state = firmware::entry_at(firmware::entry_of<"store.state">());
  EXPECT_EQ(read(state.index(), state.object_subindex()), 2U) << "saved, read alone";
  const double sequence = bench.get("store.sequence");
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(write(0x1010, 1, firmware::signature_save, 4), 0U);
    run_ms(50);
    EXPECT_EQ(bench.get("store.state"), 2) << "saved";
  }
  EXPECT_EQ(bench.get("store.sequence"), sequence);
}

TEST_F(OnCan, LssStoresNothingWhileATransactionIsOpen) {
  bench.set("transaction.control", 1);
  send({.identifier = 0x7E5, .length = 8, .data = {4, 1}});
  send({.identifier = 0x7E5, .length = 8, .data = {0x11, 42}});
  heard.clear();
  send({.identifier = 0x7E5, .length = 8, .data = {0x17}});
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.back().data[0], 0x17);
  EXPECT_EQ(heard.back().data[1], 2) << "failed";
  bench.set("transaction.control", 0);
  heard.clear();
  send({.identifier = 0x7E5, .length = 8, .data = {0x17}}, 500);
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.back().data[1], 0);
  EXPECT_EQ(bench.get("node.id"), 42);
  EXPECT_EQ(bench.get("store.state"), 2);
}

class LssOnCan : public OnCan {
 protected:
  void lss(const std::array<std::uint8_t, 8>& data) {
    send({.identifier = 0x7E5, .length = 8, .data = data});
  }
  /// Bit rates by their place in CiA 305's table: 0 1000, 2 500, 3 250, 4 125 kbit/s.
  void activate_bit_rate(std::uint8_t place) {
    lss({4, 1});
    lss({0x13, 0, place});
    lss({0x15, 0, 0});
    lss({4, 0});
    run_ms(20);
  }
  std::size_t pdos_in_a_second() {
    heard.clear();
    run_ms(1000);
    return static_cast<std::size_t>(std::count_if(heard.begin(), heard.end(), [](const auto& frame) {
      return frame.identifier > 0x180 && frame.identifier < 0x580;
    }));
  }
};

// 1 M -> 500 k used to keep 4,000 PDOs a second, and nothing else got through.
TEST_F(LssOnCan, PdosGoNoFasterThanANewBitRateAllows) {
  for (std::uint16_t tpdo = 0x1800; tpdo < 0x1804; ++tpdo) EXPECT_EQ(write(tpdo, 5, 1, 2), 0U);
  nmt(1);
  run_ms(20);
  const auto at_1000_kbit = pdos_in_a_second();
  for (const unsigned place : {2, 3, 4, 0}) {
    activate_bit_rate(static_cast<std::uint8_t>(place));
    const auto after_the_change = pdos_in_a_second();
    nmt(0x80);
    nmt(1);
    run_ms(20);
    const auto afresh = pdos_in_a_second();
    EXPECT_NEAR(static_cast<double>(after_the_change), static_cast<double>(afresh), 4.0) << place;
    if (place != 0) {
      EXPECT_LT(afresh, 6 * at_1000_kbit / 10) << place;
    }
  }
}

TEST_F(LssOnCan, TheBitRateStaysWhileAnAxisIsArmed) {
  const auto rate = [this] { return bench.application().can().settings().bit_rate; };
  arm_torque(0);
  activate_bit_rate(2);
  EXPECT_EQ(rate(), 1'000'000U);
  EXPECT_TRUE(armed());
  command(6);
  activate_bit_rate(2);
  EXPECT_EQ(rate(), 500'000U);
}

// The change comes a second after "activate", and the axis is armed over serial in the meantime.
TEST_F(LssOnCan, AChangeThatHasBegunIsGivenUpWhenAnAxisIsArmed) {
  lss({4, 1});
  lss({0x13, 0, 2});
  lss({0x15, 0xE8, 0x03});
  ASSERT_TRUE(bench.arm());
  for (int i = 0; i < 30 && armed(); ++i) {
    bench.set("link.sign_of_life", i);
    run_ms(100);
  }
  EXPECT_TRUE(armed());
  EXPECT_EQ(bench.application().can().settings().bit_rate, 1'000'000U);
}

TEST_F(OnCan, TheFirstWordOverCanDoesNotTripWhatSerialHasArmed) {
  nmt(1);
  EXPECT_EQ(write(0x5801, 2, 1, 2), 0U);
  run_ms(1500);
  ASSERT_TRUE(bench.arm());
  rpdo(15, 0);
  EXPECT_TRUE(armed());
}

TEST_F(OnCan, ATwinIsToldAndForgotten) {
  heartbeat_of(1);
  EXPECT_EQ(read(0x1001, 0), 0x11U);
  run_ms(6000);
  EXPECT_EQ(read(0x1001, 0), 0U);
}

}  // namespace
}  // namespace kmax::board::canopen_edge_bus_test
