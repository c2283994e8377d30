// Two hosts on one bus, each at an SDO server of its own: their transfers, transactions and axes.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "tests/board/canopen_host.hpp"

namespace kmax::board::second_server_test {
namespace {

using firmware::Fault;
using firmware::canopen::SdoChannel;
using Eight = std::array<std::uint8_t, 8>;

constexpr SdoChannel first = SdoChannel::predefined(1), second{0x6A1, 0x6B1};
constexpr std::uint32_t while_armed = 0x0800'0022, another_owner = 0x0800'0021;

class TwoServers : public testing::Test, public CanOpenHost {
 protected:
  TwoServers() {
    bench.set_up_plain_wall();
    bench.device.stand_at(1000);
    bench.preset("link.timeout", 0.5);
    run_ms(5);
    EXPECT_EQ(write(0x1201, 1, second.request, 4), 0U);
    EXPECT_EQ(write(0x1201, 2, second.response, 4), 0U);
  }
  std::uint32_t write_by(SdoChannel by, std::uint16_t index, std::uint8_t subindex, std::uint32_t value,
                         unsigned bytes) {
    server = by;
    return write(index, subindex, value, bytes);
  }
  std::uint32_t read_by(SdoChannel by, std::uint16_t index, std::uint8_t subindex) {
    server = by;
    return read(index, subindex);
  }
  Eight ask(SdoChannel by, const Eight& request) {
    server = by;
    return transfer(request);
  }
  std::uint32_t stiffness_by(SdoChannel by, float value) {
    return write_by(by, 0x2000, 4, std::bit_cast<std::uint32_t>(value), 4);
  }
  void arm_by(SdoChannel by) {
    for (const std::uint32_t word : {0U, 6U, 15U}) EXPECT_EQ(write_by(by, 0x6040, 0, word, 2), 0U);
    run_ms(2);
    ASSERT_TRUE(armed());
  }
  std::size_t answers_by(SdoChannel by) const {
    return static_cast<std::size_t>(std::count_if(
        heard.begin(), heard.end(), [&](const auto& frame) { return frame.identifier == by.response; }));
  }
};

TEST(SecondServer, IsNotThereUntilBothOfItsIdentifiersAreSet) {
  CanOpenHost host;
  EXPECT_EQ(host.read(0x1200, 0), 2U);
  EXPECT_EQ(host.read(0x1200, 1), 0x601U);
  EXPECT_EQ(host.read(0x1200, 2), 0x581U);
  EXPECT_EQ(host.read(0x1201, 0), 2U);
  EXPECT_EQ(host.read(0x1201, 1), 0x8000'0000U);
  const auto answered = [&host] {
    host.heard.clear();
    host.send({.identifier = second.request, .length = 8, .data = {0x40, 0x00, 0x10}});
    return !host.heard.empty();
  };
  EXPECT_FALSE(answered());
  EXPECT_EQ(host.write(0x1201, 1, second.request, 4), 0U);
  EXPECT_FALSE(answered());
  EXPECT_EQ(host.write(0x1201, 2, second.response, 4), 0U);
  EXPECT_TRUE(answered());
  EXPECT_EQ(host.write(0x1201, 2, 0x8000'0000, 4), 0U);
  EXPECT_FALSE(answered());
}

// A segmented download each, step by step in turn.
TEST_F(TwoServers, EachHasATransferOfItsOwn) {
  const Eight initiate{0x21, 0x22, 0x58, 1, 14};
  EXPECT_EQ(ask(first, initiate)[0], 0x60);
  EXPECT_EQ(ask(second, initiate)[0], 0x60);
  EXPECT_EQ(ask(first, {0x00, 1, 2, 3, 4, 5, 6, 7})[0], 0x20);
  EXPECT_EQ(ask(second, {0x00, 11, 12, 13, 14, 15, 16, 17})[0], 0x20);
  EXPECT_EQ(read_by(second, 0x6041, 0) & 0x4F, 0x40U) << "which ended its own, and nobody else's";
  EXPECT_EQ(ask(first, {0x11, 8, 9, 10, 11, 12, 13, 14})[0], 0x30);
  const Eight refused = ask(second, {0x11, 18});
  EXPECT_EQ(refused[0], 0x80);
  EXPECT_EQ(ask(second, {0x40, 0x22, 0x58, 1})[4], 14) << "bytes";
  EXPECT_EQ(ask(second, {0x60}), (Eight{0x00, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(ask(second, {0x70}), (Eight{0x11, 8, 9, 10, 11, 12, 13, 14}));
}

TEST_F(TwoServers, WhatTheOtherOneChangesMeanwhileIsNotReadInPieces) {
  const auto fill = [this](SdoChannel by, std::uint8_t with) {
    EXPECT_EQ(ask(by, {0x21, 0x22, 0x58, 1, 210})[0], 0x60);
    for (int i = 0; i < 30; ++i)
      ask(by, {static_cast<std::uint8_t>((i % 2) << 4 | (i == 29 ? 1 : 0)), with, with, with, with, with,
               with, with});
  };
  fill(first, 1);
  EXPECT_EQ(ask(second, {0x40, 0x22, 0x58, 1})[4], 210);
  EXPECT_EQ(ask(second, {0x60})[1], 1);
  fill(first, 2);
  Eight answer{};
  for (int i = 1; i < 30 && answer[0] != 0x80; ++i)
    answer = ask(second, {static_cast<std::uint8_t>(0x60 | (i % 2) << 4)});
  EXPECT_EQ(answer, (Eight{0x80, 0x22, 0x58, 1, 0x22, 0, 0, 0x08}));
}

// A block upload has frames to send whenever there is room for one.
TEST_F(TwoServers, ABlockOfTheOneDoesNotKeepTheOtherWaiting) {
  EXPECT_EQ(ask(first, {0xA4, 0x20, 0x58, 1, 127})[0] & 0xE0, 0xC0);
  heard.clear();
  bench.board().receive_can(
      std::array{drivers::CanFrame{.identifier = second.request, .length = 8, .data = {0x40, 0x00, 0x10}},
                 drivers::CanFrame{.identifier = first.request, .length = 8, .data = {0xA3}}});
  run_ms(1);
  const auto answer = std::find_if(heard.begin(), heard.end(),
                                   [](const auto& frame) { return frame.identifier == second.response; });
  ASSERT_NE(answer, heard.end());
  EXPECT_LE(answer - heard.begin(), 2);
  EXPECT_GT(answers_by(first), 5U);
}

// A transfer under way is ended on the channel before; the first request on the other one comes right behind
// it.
TEST_F(TwoServers, OneThatChangesItsChannelHearsTheFirstRequestOnTheOther) {
  SdoChannel now = second;
  const auto ask_without_a_pause = [this](SdoChannel by, const Eight& request) {
    heard.clear();
    send({.identifier = by.request, .length = 8, .data = request}, 0.2);
    const auto answer = std::ranges::find(heard, by.response, &drivers::CanFrame::identifier);
    return answer != heard.end() ? answer->data : Eight{};
  };
  for (int turn = 0; turn < 10; ++turn) {
    const SdoChannel other{now == second ? std::uint16_t{0x6A2} : second.request, now.response};
    const Eight begun = ask(now, {0x40, 0x08, 0x10, 0});
    ASSERT_EQ(begun[0], 0x41) << "segmented";
    for (const std::uint32_t request : {0x8000'0000U, std::uint32_t{other.request}})
      EXPECT_EQ(write_by(first, 0x1201, 1, request, 4), 0U);
    Eight segment{};
    for (int i = 0; i < 10 && (segment[0] & 1U) == 0; ++i)
      segment = ask_without_a_pause(now, {static_cast<std::uint8_t>(i % 2 == 0 ? 0x60 : 0x70)});
    ASSERT_EQ(segment[0] & 0xE1U, 1U) << "the last";
    EXPECT_EQ(ask_without_a_pause(other, {0x40, 0x18, 0x10, 1})[0], 0x43) << turn;
    now = other;
    run_ms(0.1);
  }
}

TEST_F(TwoServers, ATransactionBelongsToTheOneThatBeganIt) {
  EXPECT_EQ(write_by(second, 0x5810, 1, 1, 2), 0U);
  EXPECT_EQ(stiffness_by(second, 700), 0U);
  EXPECT_EQ(stiffness_by(first, 800), another_owner);
  EXPECT_EQ(write_by(first, 0x5810, 1, 2, 2), another_owner);
  EXPECT_EQ(write_by(first, 0x5810, 1, 0, 2), another_owner);
  EXPECT_EQ(bench.get("wall.stiffness"), 1000.0);
  EXPECT_EQ(write_by(second, 0x5810, 1, 2, 2), 0U);
  EXPECT_EQ(bench.get("wall.stiffness"), 700.0);
  EXPECT_EQ(stiffness_by(first, 800), 0U);
}

TEST_F(TwoServers, AResetOfTheCommunicationEndsATransactionOfEither) {
  for (const SdoChannel by : {first, second}) {
    EXPECT_EQ(write_by(by, 0x5810, 1, 1, 2), 0U);
    nmt(0x82);
    EXPECT_EQ(bench.set("wall.damping", 1), 0) << "open still";
    server = first;
    EXPECT_EQ(write(0x1201, 1, second.request, 4), 0U);
    EXPECT_EQ(write(0x1201, 2, second.response, 4), 0U);
  }
}

TEST_F(TwoServers, AnAxisBelongsToTheOneThatArmedIt) {
  arm_by(second);
  EXPECT_EQ(stiffness_by(first, 900), while_armed);
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::other_commander));
  EXPECT_EQ(stiffness_by(second, 900), 0U);
  EXPECT_EQ(write_by(first, 0x6040, 0, 15, 2), while_armed);
  EXPECT_EQ(write_by(first, 0x2005, 1, std::bit_cast<std::uint32_t>(1.0f), 4), 0U) << "force.limit, lower";
  EXPECT_EQ(write_by(first, 0x6040, 0, 6, 2), 0U);
  EXPECT_FALSE(armed()) << "anybody disarms";
}

TEST_F(TwoServers, OnlyTheCommandersSignsOfLifeCount) {
  for (const SdoChannel by : {first, second}) {
    arm_by(by);
    for (int i = 0; i < 20; ++i) {
      EXPECT_EQ(write_by(by, 0x5801, 2, 0, 2), 0U);
      run_ms(98);
    }
    EXPECT_TRUE(armed());
    for (int i = 0; i < 8; ++i) {
      EXPECT_EQ(write_by(by == first ? second : first, 0x5801, 2, 0, 2), 0U);
      run_ms(98);
    }
    EXPECT_EQ(fault(), Fault::link_silent);
    EXPECT_EQ(write_by(by, 0x6040, 0, 0, 2), 0U);
    EXPECT_EQ(write_by(by, 0x6040, 0, 0x80, 2), 0U);
  }
}

// A PDO does not say who sends it.
TEST_F(TwoServers, APdoIsTheCommanders) {
  EXPECT_EQ(write_by(second, 0x6060, 0, 10, 1), 0U);
  nmt(1);
  arm_by(second);
  for (int i = 0; i < 20; ++i) rpdo(15, 300, 100);
  ASSERT_TRUE(armed());
  EXPECT_GT(bench.force(), 0.01);
  EXPECT_EQ(write_by(first, 0x6071, 0, 0, 2), while_armed);
  rpdo(6, 0);
  EXPECT_FALSE(armed());
  EXPECT_EQ(write_by(second, 0x6040, 0, 7, 2), 0U);
  rpdo(15, 300, 20);
  ASSERT_TRUE(armed());
  EXPECT_EQ(write_by(second, 0x6071, 0, 0, 2), while_armed) << "a PDO that arms is the first one's";
  EXPECT_EQ(write_by(first, 0x6071, 0, 0, 2), 0U);
}

TEST_F(TwoServers, TheBusTakesTheForceFromEither) {
  for (const SdoChannel by : {first, second}) {
    arm_by(by);
    nmt(2);
    EXPECT_FALSE(armed());
    nmt(0x80);
    EXPECT_EQ(write_by(by, 0x1016, 1, 5U << 16 | 100, 4), 0U);
    heartbeat_of(5);
    arm_by(by);
    run_ms(150);
    EXPECT_EQ(fault(), Fault::heartbeat_lost);
    EXPECT_EQ(write_by(by, 0x6040, 0, 0, 2), 0U);
    EXPECT_EQ(write_by(by, 0x6040, 0, 15, 2), 0U);
    EXPECT_FALSE(armed());
    heartbeat_of(5);
    EXPECT_EQ(write_by(by, 0x6040, 0, 0x80, 2), 0U);
    EXPECT_EQ(write_by(by, 0x1016, 1, 0, 4), 0U);
    arm_by(by);
    bench.board().connect_can(false);
    run_ms(20);
    EXPECT_EQ(fault(), Fault::bus_off);
    bench.board().connect_can(true);
    run_ms(20);
    EXPECT_EQ(write_by(by, 0x6040, 0, 0, 2), 0U);
    EXPECT_EQ(write_by(by, 0x6040, 0, 0x80, 2), 0U);
  }
}

TEST_F(TwoServers, TheSecondIsSilentWhileTheNodeIsStopped) {
  nmt(2);
  heard.clear();
  for (const SdoChannel by : {first, second})
    send({.identifier = by.request, .length = 8, .data = {0x40, 0x00, 0x10}});
  EXPECT_TRUE(heard.empty());
  nmt(0x80);
  EXPECT_EQ(read_by(second, 0x1000, 0), read_by(first, 0x1000, 0));
}

TEST_F(TwoServers, OneThatSwitchesItselfOffIsAnsweredFirst) {
  EXPECT_EQ(write_by(second, 0x1201, 1, 0x8000'0000, 4), 0U);
  heard.clear();
  send({.identifier = second.request, .length = 8, .data = {0x40, 0x00, 0x10}});
  EXPECT_TRUE(heard.empty());
}

TEST_F(TwoServers, NobodyTakesTheSecondAwayFromWhomItArmed) {
  arm_by(second);
  EXPECT_EQ(write_by(first, 0x1201, 1, 0x8000'0000, 4), while_armed);
  EXPECT_EQ(write_by(first, 0x1201, 2, 0x8000'0000, 4), while_armed);
  EXPECT_EQ(read_by(second, 0x1201, 1), second.request);
}

TEST_F(TwoServers, ItsAbortsAndTimeOutsAreCountedToo) {
  const double aborts = bench.get("can.sdo_aborts"), timeouts = bench.get("can.sdo_timeouts");
  EXPECT_EQ(write_by(second, 0x1000, 0, 0, 4), 0x0601'0002U);
  EXPECT_EQ(ask(second, {0x21, 0x22, 0x58, 1, 14})[0], 0x60);
  run_ms(1100);
  EXPECT_EQ(bench.get("can.sdo_aborts") - aborts, 2.0);
  EXPECT_EQ(bench.get("can.sdo_timeouts") - timeouts, 1.0);
}

}  // namespace
}  // namespace kmax::board::second_server_test
