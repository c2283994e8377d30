// Whose an armed axis is: whose silence takes the force away, and who may command it. Through the whole
// firmware, on both links.
#include <gtest/gtest.h>

#include <array>
#include <functional>

#include "firmware/modbus/crc.hpp"
#include "tests/board/canopen_host.hpp"

namespace kmax::board::commander_test {
namespace {

using firmware::Fault;

constexpr std::uint16_t wall = 0x2000, link_settings = 0x5801, drive_mode = 0x2016;
/// By which a master arms.
constexpr std::array<std::uint16_t, 3> master_words = {0x00, 0x06, 0x0F};

class Commander : public testing::Test, public CanOpenHost {
 protected:
  Commander() {
    bench.set_up_plain_wall();
    bench.device.stand_at(1000);
    bench.preset("link.timeout", 0.5);
    run_ms(5);
  }
  void arm_over_can(std::uint16_t number = 0) {
    if (number != 0) {
      EXPECT_EQ(write(drive_mode, 2, number, 2), 0U);
    }
    command(0);
    command(6);
    command(15);
    run_ms(2);
    ASSERT_TRUE(armed());
  }
  /// Seconds that the axis stays armed while this happens ten times a second; at most 3.
  double armed_while(const std::function<void()>& happens) {
    const auto begin = bench.device.tick;
    for (int i = 0; i < 30 && armed(); ++i) {
      const auto next = bench.device.tick + 2000;
      happens();
      while (armed() && bench.device.tick < next) run_ms(1);
    }
    return static_cast<double>(bench.device.tick - begin) / 20000.0;
  }
  void expect_silence(double seconds) {
    EXPECT_EQ(fault(), Fault::link_silent);
    EXPECT_GE(seconds, 0.45);
    EXPECT_LE(seconds, 0.6);
  }
  std::uint32_t write_stiffness(float value) {
    return write(wall, 4, std::bit_cast<std::uint32_t>(value), 4);
  }
  std::uint32_t sign_of_life(std::uint16_t number) { return write(link_settings, 2, number, 2); }
};

TEST_F(Commander, ADeadOneIsNotReplacedByAToolThatSetsAndReads) {
  arm_over_can();
  float stiffness = 1000;
  expect_silence(armed_while([&] {
    EXPECT_EQ(write_stiffness(stiffness -= 1), 0U);
    EXPECT_EQ(read(0x6041, 0) & 0x6FU, 0x27U);
  }));
}

TEST_F(Commander, ADeadOneIsNotReplacedByTheOtherLink) {
  arm_over_can();
  expect_silence(armed_while([&] {
    bench.get("measured.position");
    bench.set("link.sign_of_life", 0);
    bench.command(0x06, 1);
  }));
}

TEST_F(Commander, OnTheSerialLineNobodyOnTheBusReplacesIt) {
  ASSERT_TRUE(bench.arm());
  expect_silence(armed_while([&] {
    EXPECT_EQ(sign_of_life(1), 0U);
    write_stiffness(900);
  }));
}

TEST_F(Commander, WhatCommandsOverCanKeepsTheAxisArmed) {
  arm_over_can();
  EXPECT_GE(armed_while([&] { EXPECT_EQ(sign_of_life(0), 0U); }), 2.9);
  EXPECT_GE(armed_while([&] { command(15); }), 2.9);
  EXPECT_GE(armed_while([&] { EXPECT_EQ(write(0x6071, 0, 0, 2), 0U); }), 2.9);
}

TEST_F(Commander, WithANumberOnlyThatNumberKeepsTheAxisArmed) {
  for (const bool by_others : {true, false}) {
    arm_over_can(4711);
    if (by_others) {
      expect_silence(armed_while([&] {
        EXPECT_EQ(sign_of_life(0), 0U);
        EXPECT_EQ(sign_of_life(4712), 0U);
        command(15);
        EXPECT_EQ(write(0x6071, 0, 0, 2), 0U);
        EXPECT_EQ(write(drive_mode, 2, 4712, 2), 0U) << "the next one's";
        bench.set("link.sign_of_life", 4711);  // over the other link
      }));
      bench.clear_fault();
    } else {
      EXPECT_GE(armed_while([&] { EXPECT_EQ(sign_of_life(4711), 0U); }), 2.9);
    }
  }
}

TEST_F(Commander, TheNumberIsForOneArmingAndGoneWithTheAttempt) {
  arm_over_can(4711);
  command(6);
  run_ms(2);
  EXPECT_EQ(read(drive_mode, 2), 0U);
  bench.device.stand_at(-1000);  // inside the wall
  run_ms(5);
  EXPECT_EQ(write(drive_mode, 2, 4711, 2), 0U);
  command(15);
  run_ms(5);
  ASSERT_FALSE(armed());
  EXPECT_EQ(read(drive_mode, 2), 0U);
}

TEST_F(Commander, AnotherLinkCanDisarmAndNoMore) {
  EXPECT_EQ(write(0x6060, 0, 10, 1), 0U);
  arm_over_can();
  EXPECT_EQ(bench.command(0x0F), 4);
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::other_commander));
  EXPECT_EQ(bench.get("refusal.register"), firmware::address_of("drive.controlword"));
  EXPECT_EQ(bench.command(0x10F), 4) << "halted or not";
  EXPECT_EQ(bench.set("profile.target_torque", 100), 4);
  EXPECT_EQ(bench.set("profile.target_force", 1), 4);
  run_ms(5);
  EXPECT_EQ(bench.force(), 0.0f);
  expect_silence(armed_while([&] { bench.command(0x0F); }));
  bench.clear_fault();
  arm_over_can();
  EXPECT_EQ(bench.command(0x06), 0);
  run_ms(2);
  EXPECT_FALSE(armed());
  EXPECT_TRUE(bench.arm()) << "and then it is the other one's to arm";
  EXPECT_NE(write(0x6071, 0, 100, 2), 0U);
}

TEST_F(Commander, ABroadcastArmsNoAxisAndCanDisarmAll) {
  const auto controlword = firmware::address_of("drive.controlword");
  const auto high = static_cast<std::uint8_t>(controlword >> 8), low = static_cast<std::uint8_t>(controlword);
  const std::vector<std::uint8_t> requests[] = {{6, high, low, 0, 0x0F},
                                                {16, high, low, 0, 1, 2, 0, 0x0F},
                                                {22, high, low, 0, 0, 0, 0x0F},
                                                {23, high, low, 0, 1, high, low, 0, 1, 2, 0, 0x0F}};
  for (const auto& request : requests) {
    bench.command(0x06);
    bench.board().receive(firmware::modbus::adu(0, request));
    run_ms(10);
    EXPECT_EQ(bench.state(), DriveState::ready_to_switch_on) << int{request[0]};
    EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::armed_by_broadcast)) << int{request[0]};
  }
  ASSERT_TRUE(bench.arm());
  bench.board().receive(firmware::modbus::adu(0, {6, high, low, 0, 0x06}));
  run_ms(10);
  EXPECT_FALSE(armed());
}

// A master that sends 0x0F all the time must not arm again what somebody else has just disarmed.
TEST_F(Commander, AWordThatIsHeldArmsNothingAfterAnotherLinksDisarming) {
  bench.preset("link.timeout", 0);
  nmt(1);
  for (const std::uint16_t word : master_words) rpdo(word, 0);
  ASSERT_TRUE(armed());
  rpdo(0x0F, 0, 5);
  EXPECT_EQ(bench.command(0x06), 0);
  run_ms(2);
  EXPECT_FALSE(armed());
  rpdo(0x0F, 0, 5);
  run_ms(3);
  EXPECT_FALSE(armed());
  rpdo(0x06, 0);
  rpdo(0x0F, 0);
  run_ms(3);
  EXPECT_TRUE(armed()) << "an edge of its own";
}

TEST_F(Commander, ARefusedWordThatIsHeldArmsNothingAfterAnotherLinksWord) {
  bench.preset("link.timeout", 0);
  nmt(1);
  bench.device.stand_at(-1000);  // inside the wall
  run_ms(5);
  for (const std::uint16_t word : master_words) rpdo(word, 0);
  bench.device.stand_at(1000);
  run_ms(5);
  rpdo(0x0F, 0, 5);
  EXPECT_EQ(bench.command(0x07), 0);
  rpdo(0x0F, 0, 5);
  run_ms(3);
  EXPECT_FALSE(armed());
}

// A master that sends 0x0F all the time while another link commands must not be armed by that link's
// disarming.
TEST_F(Commander, AWordThatWasRefusedToAnotherLinkArmsNothingOnceTheCommanderHasDisarmed) {
  bench.preset("link.timeout", 0);
  nmt(1);
  rpdo(0x06, 0);
  ASSERT_TRUE(bench.arm());
  rpdo(0x0F, 0, 5);
  for (const std::uint16_t disarming : {std::uint16_t{0x07}, std::uint16_t{0x06}}) {
    EXPECT_EQ(bench.command(disarming), 0);
    rpdo(0x0F, 0, 5);
    run_ms(3);
    EXPECT_FALSE(armed()) << disarming;
  }
  rpdo(0x06, 0);
  rpdo(0x0F, 0);
  run_ms(3);
  EXPECT_TRUE(armed()) << "an edge of its own";
}

TEST_F(Commander, AnotherLinkMayBeginAHaltAndNotEndIt) {
  bench.preset("link.timeout", 0);
  EXPECT_EQ(write(0x6060, 0, 10, 1), 0U);
  arm_over_can();
  EXPECT_EQ(write(0x6071, 0, 500, 2), 0U);
  run_ms(5);
  const float force = bench.force();
  ASSERT_NE(force, 0.0f);
  command(0x10F);
  run_ms(5);
  ASSERT_EQ(bench.force(), 0.0f);
  EXPECT_EQ(bench.command(0x80), 0);
  const auto controlword = firmware::address_of("drive.controlword");
  bench.board().receive(firmware::modbus::adu(
      0, {6, static_cast<std::uint8_t>(controlword >> 8), static_cast<std::uint8_t>(controlword), 0, 0x80}));
  run_ms(10);
  EXPECT_TRUE(armed());
  EXPECT_EQ(bench.force(), 0.0f);
  command(0x0F);
  run_ms(5);
  EXPECT_EQ(bench.force(), force) << "its commander ends it";
  EXPECT_EQ(bench.command(0x180), 0);
  run_ms(5);
  EXPECT_EQ(bench.force(), 0.0f);
}

TEST_F(Commander, WhatItAsksForAndWhatTheHandFeelsIsChangedByNobodyElse) {
  bench.preset("link.timeout", 0);
  bench.preset("interference.mode", 2);
  bench.preset("interference.onset_time", 3600);
  bench.preset("interference.background_force", -3);
  arm_over_can();
  const std::pair<std::string_view, double> attempts[] = {
      {"excitation.kind", 4},        {"excitation.run", 1},           {"excitation.stiffness", 1e5},
      {"profile.max_torque", 32767}, {"interference.onset_time", 0},  {"wall.adaptive_force_min", 2},
      {"wall.adaptive_gain", 100},   {"wall.stiffness", 500},         {"interference.background_force", 3},
      {"drive.commander", 5},        {"profile.quick_stop_option", 0}};
  for (const auto& [name, number] : attempts) {
    const double before = bench.get(name);
    EXPECT_EQ(bench.set(name, number), 4) << name;
    EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::other_commander)) << name;
    EXPECT_EQ(bench.get(name), before) << name;
  }
  EXPECT_EQ(bench.set("force.limit", 1), 0) << "anybody may tighten what protects";
}

TEST_F(Commander, ANumberIsTheLinksThatWroteIt) {
  EXPECT_EQ(write(drive_mode, 2, 4711, 2), 0U);
  command(0);
  command(6);
  EXPECT_EQ(bench.set("drive.commander", 0), 0);
  command(15);
  run_ms(2);
  ASSERT_TRUE(armed());
  expect_silence(armed_while([&] { EXPECT_EQ(sign_of_life(1), 0U); }));
}

TEST_F(Commander, ASettingInAPdoIsNoSignOfLife) {
  EXPECT_EQ(write(0x1402, 1, 0x80000401, 4), 0U);
  EXPECT_EQ(write(0x1602, 1, std::uint32_t{wall} << 16 | 4U << 8 | 32U, 4), 0U);
  EXPECT_EQ(write(0x1602, 0, 1, 1), 0U);
  EXPECT_EQ(write(0x1402, 1, 0x401, 4), 0U);
  nmt(1);
  arm_over_can();
  const auto raw = std::bit_cast<std::uint32_t>(900.0f);
  expect_silence(armed_while([&] {
    send({.identifier = 0x401,
          .length = 4,
          .data = {static_cast<std::uint8_t>(raw), static_cast<std::uint8_t>(raw >> 8),
                   static_cast<std::uint8_t>(raw >> 16), static_cast<std::uint8_t>(raw >> 24)}});
  }));
  EXPECT_EQ(bench.get("wall.stiffness"), 900.0) << "it was taken all the same";
}

// What keeps an armed axis armed, and brings its commander's targets, stays as it was.
TEST_F(Commander, NobodyChangesWhatItsCommanderIsHeardBy) {
  constexpr std::uint32_t while_armed = 0x0800'0022;
  EXPECT_EQ(write(0x1016, 1, 5U << 16 | 200, 4), 0U);
  heartbeat_of(5);
  arm_over_can();
  heartbeat_of(5);
  EXPECT_EQ(write(0x1016, 1, 0, 4), while_armed);
  EXPECT_EQ(write(0x1016, 2, 9U << 16 | 1000, 4), while_armed);
  EXPECT_EQ(write(0x1400, 1, 0x80000201, 4), while_armed);
  EXPECT_EQ(write(0x1400, 2, 1, 1), while_armed);
  EXPECT_EQ(write(0x1600, 0, 0, 1), while_armed);
  EXPECT_EQ(write(0x1005, 0, 0x81, 4), while_armed);
  EXPECT_EQ(write(0x1800, 5, 10, 2), 0U) << "what it sends harms nobody";
  EXPECT_EQ(bench.set("modbus.unit", 9), 4);
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::while_armed));
  command(6);
  run_ms(2);
  EXPECT_EQ(write(0x1400, 1, 0x80000201, 4), 0U);
}

TEST_F(Commander, OneAxisPushesNoOtherThatAnotherLinkHasArmed) {
  bench.set_up_plain_wall(1);
  bench.preset("interference.mode", 2, 0);
  bench.preset("link.timeout", 0);
  bench.device.stand_at(1000, 1);
  run_ms(5);
  ASSERT_TRUE(bench.arm(1));
  for (const std::uint16_t word : master_words) command(word);
  run_ms(5);
  EXPECT_FALSE(armed());
  EXPECT_EQ(bench.get("refusal.reason"), 0) << "a refusal to arm is the axis' own";
  EXPECT_EQ(bench.get("drive.refusal"), static_cast<int>(Refusal::other_commander));
  EXPECT_TRUE(bench.arm(0)) << "both by one commander";
}

}  // namespace
}  // namespace kmax::board::commander_test
