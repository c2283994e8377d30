#include "firmware/canopen/nmt.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace kmax::firmware::canopen::nmt_test {
namespace {

using drivers::CanFrame;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t own_id = 0x11;

CanFrame command(std::uint8_t specifier, std::uint8_t node_id) {
  return {.identifier = 0x000, .length = 2, .data = {specifier, node_id}};
}

CanFrame node_state(std::uint8_t state) {
  return {.identifier = 0x700 + own_id, .length = 1, .data = {state}};
}

std::optional<CanFrame> next(Nmt& nmt, std::uint32_t now_us) {
  CanFrame frame;
  return nmt.next_frame(frame, now_us) ? std::optional(frame) : std::nullopt;
}

Nmt started(std::uint16_t heartbeat_ms = 0, std::uint32_t now_us = 0) {
  Nmt nmt;
  nmt.start(own_id, heartbeat_ms, now_us);
  next(nmt, now_us);
  return nmt;
}

TEST(Nmt, SaysNothingBeforeItIsStarted) {
  Nmt nmt;
  EXPECT_FALSE(next(nmt, 0));
  EXPECT_EQ(nmt.receive(command(0x01, 0)), NmtEvent::none);
  EXPECT_EQ(nmt.state(), NmtState::initialising);
  EXPECT_FALSE(nmt.configured());
}

TEST(Nmt, BootsUpOnceAndIsPreOperationalOnlyThen) {
  Nmt nmt;
  nmt.start(own_id, 0, 0);
  EXPECT_EQ(nmt.state(), NmtState::initialising);
  EXPECT_EQ(nmt.receive(command(0x01, 0)), NmtEvent::none) << "no command before the boot-up message";
  EXPECT_EQ(next(nmt, 0), node_state(0x00));
  EXPECT_EQ(nmt.state(), NmtState::pre_operational);
  EXPECT_FALSE(next(nmt, 0));
}

TEST(Nmt, EveryResetIsFollowedByABootUpMessage) {
  Nmt nmt = started(10);
  for (const std::uint8_t which : Bytes{0x81, 0x82}) {
    for (const NmtState from : {NmtState::operational, NmtState::stopped, NmtState::pre_operational}) {
      nmt.enter(from);
      EXPECT_EQ(nmt.receive(command(which, own_id)),
                which == 0x81 ? NmtEvent::reset_node : NmtEvent::reset_communication);
      EXPECT_EQ(nmt.state(), NmtState::initialising);
      EXPECT_FALSE(next(nmt, 50'000)) << "silent until the owner has reset what is to be reset";
      EXPECT_EQ(nmt.receive(command(which, own_id)), NmtEvent::none);
      nmt.start(own_id, 10, 60'000);
      EXPECT_EQ(next(nmt, 60'000), node_state(0x00));
      EXPECT_EQ(nmt.state(), NmtState::pre_operational);
    }
  }
}

TEST(Nmt, CommandsLeadFromEveryStateToTheirs) {
  struct Row {
    std::uint8_t specifier;
    NmtState state;
    NmtEvent event;
  };
  const Row rows[] = {{0x01, NmtState::operational, NmtEvent::entered_operational},
                      {0x02, NmtState::stopped, NmtEvent::entered_stopped},
                      {0x80, NmtState::pre_operational, NmtEvent::entered_pre_operational}};
  for (const Row& from : rows) {
    for (const Row& to : rows) {
      for (const std::uint8_t address : Bytes{std::uint8_t{0}, own_id}) {
        Nmt nmt = started();
        nmt.enter(from.state);
        ASSERT_EQ(nmt.state(), from.state);
        EXPECT_EQ(nmt.receive(command(to.specifier, address)),
                  from.state == to.state ? NmtEvent::none : to.event);
        EXPECT_EQ(nmt.state(), to.state);
      }
    }
  }
}

TEST(Nmt, EveryOtherCommandAndNodeIsIgnored) {
  Nmt nmt = started();
  for (unsigned specifier = 0; specifier < 256; ++specifier) {
    if (specifier == 1 || specifier == 2 || (specifier >= 0x80 && specifier <= 0x82)) continue;
    EXPECT_EQ(nmt.receive(command(static_cast<std::uint8_t>(specifier), 0)), NmtEvent::none);
  }
  for (unsigned node = 1; node < 256; ++node) {
    if (node == own_id) continue;
    for (const std::uint8_t specifier : Bytes{0x01, 0x02, 0x81, 0x82})
      EXPECT_EQ(nmt.receive(command(specifier, static_cast<std::uint8_t>(node))), NmtEvent::none);
  }
  EXPECT_EQ(nmt.state(), NmtState::pre_operational);
}

TEST(Nmt, FramesThatAreNoCommandsAreIgnored) {
  Nmt nmt = started();
  for (std::uint8_t length = 0; length <= 8; ++length) {
    if (length == 2) continue;
    CanFrame frame = command(0x01, own_id);
    frame.length = length;
    EXPECT_EQ(nmt.receive(frame), NmtEvent::none) << int{length};
  }
  for (const CanFrame& frame : {CanFrame{.extended = true, .length = 2, .data = {0x01, own_id}},
                                {.remote = true, .length = 2, .data = {0x01, own_id}},
                                {.identifier = 0x001, .length = 2, .data = {0x01, own_id}}})
    EXPECT_EQ(nmt.receive(frame), NmtEvent::none);
  EXPECT_EQ(nmt.state(), NmtState::pre_operational);
}

TEST(Nmt, WithoutANodeIdNothingIsSentOrObeyed) {
  for (const std::uint8_t node_id : Bytes{0, 128, 200, 255}) {
    Nmt nmt;
    nmt.start(node_id, 1, 0);
    EXPECT_FALSE(nmt.configured());
    EXPECT_EQ(nmt.node_id(), unconfigured_node_id);
    EXPECT_FALSE(next(nmt, 1'000'000));
    nmt.set_heartbeat(1, 0);
    EXPECT_FALSE(next(nmt, 2'000'000));
    for (const std::uint8_t address : Bytes{std::uint8_t{0}, node_id}) {
      EXPECT_EQ(nmt.receive(command(0x01, address)), NmtEvent::none);
      EXPECT_EQ(nmt.receive(command(0x81, address)), NmtEvent::none);
    }
    EXPECT_EQ(nmt.enter(NmtState::operational), NmtEvent::none);
    EXPECT_EQ(nmt.state(), NmtState::initialising);
    nmt.start(own_id, 0, 0);
    EXPECT_EQ(next(nmt, 0), node_state(0x00)) << "configured by LSS";
  }
}

TEST(Nmt, NodeIdTakenAwayBeforeTheBootUpMessage) {
  Nmt nmt;
  nmt.start(own_id, 10, 0);
  nmt.start(unconfigured_node_id, 10, 0);
  EXPECT_FALSE(next(nmt, 100'000));
}

TEST(Nmt, HeartbeatShowsTheState) {
  Nmt nmt = started(1);
  std::uint32_t now_us = 1000;
  EXPECT_EQ(next(nmt, now_us), node_state(0x7F));
  nmt.receive(command(0x01, 0));
  EXPECT_EQ(next(nmt, now_us += 1000), node_state(0x05));
  nmt.receive(command(0x02, 0));
  EXPECT_EQ(next(nmt, now_us += 1000), node_state(0x04)) << "heartbeats go on in STOPPED";
}

// The times at which heartbeats come out when it is asked every 50 us.
std::vector<std::uint32_t> heartbeats(Nmt& nmt, std::uint32_t start_us, std::uint32_t duration_us,
                                      std::uint32_t step_us = 50) {
  std::vector<std::uint32_t> times;
  for (std::uint32_t t = 0; t <= duration_us; t += step_us) {
    if (next(nmt, start_us + t)) times.push_back(t);
  }
  return times;
}

TEST(Nmt, HeartbeatsKeepTheirTimeAcrossTheWrapOfTheClock) {
  for (const std::uint32_t start : {0U, 0x7FFF'FF00U, 0xFFFF'FFFFU, 0U - 1000U, 0U - 2500U}) {
    Nmt nmt = started(1, start);
    EXPECT_EQ(heartbeats(nmt, start, 4000), (std::vector<std::uint32_t>{1000, 2000, 3000, 4000})) << start;
  }
}

TEST(Nmt, LongestHeartbeatTime) {
  for (const std::uint32_t start : {0U, 0x8000'0000U, 0U - 65'000'000U}) {
    Nmt nmt = started(65535, start);
    EXPECT_EQ(heartbeats(nmt, start, 140'000'000, 5000),
              (std::vector<std::uint32_t>{65'535'000, 131'070'000}));
  }
}

TEST(Nmt, HeartbeatTimeZeroSendsNone) {
  Nmt nmt = started(0);
  EXPECT_TRUE(heartbeats(nmt, 0, 200'000'000, 100'000).empty());
  EXPECT_TRUE(heartbeats(nmt, 0xF000'0000, 0x2000'0000, 100'000).empty());
}

TEST(Nmt, ANewHeartbeatTimeTakesEffectAtOnce) {
  Nmt nmt = started(65535, 0);
  nmt.set_heartbeat(2, 500);
  EXPECT_EQ(heartbeats(nmt, 500, 4000), (std::vector<std::uint32_t>{0, 2000, 4000}));
  nmt.set_heartbeat(0, 5000);
  EXPECT_TRUE(heartbeats(nmt, 5000, 100'000).empty());
  nmt.set_heartbeat(65535, 0xFFFF'FF00);
  EXPECT_EQ(heartbeats(nmt, 0xFFFF'FF00, 2000), (std::vector<std::uint32_t>{0}));
}

TEST(Nmt, HeartbeatTimeSetWhileInitialisingWaitsForTheBootUpMessage) {
  Nmt nmt;
  nmt.start(own_id, 0, 0);
  nmt.set_heartbeat(1, 100);
  EXPECT_EQ(next(nmt, 5000), node_state(0x00));
  EXPECT_EQ(heartbeats(nmt, 5000, 2000), (std::vector<std::uint32_t>{1000, 2000}));
}

TEST(Nmt, HeartbeatsThatGotNoRoomAreLeftOutNotMadeUpFor) {
  Nmt nmt = started(1, 0);
  EXPECT_TRUE(next(nmt, 5300));
  EXPECT_FALSE(next(nmt, 5350));
  EXPECT_TRUE(next(nmt, 6000)) << "the grid stays";
}

TEST(Nmt, TheDevicesOwnChangeOfState) {
  Nmt nmt = started();
  EXPECT_EQ(nmt.enter(NmtState::operational), NmtEvent::entered_operational);
  EXPECT_EQ(nmt.enter(NmtState::operational), NmtEvent::none);
  EXPECT_EQ(nmt.enter(NmtState::initialising), NmtEvent::none);
  EXPECT_EQ(nmt.state(), NmtState::operational);
  EXPECT_EQ(nmt.enter(NmtState::stopped), NmtEvent::entered_stopped);
  EXPECT_EQ(nmt.enter(NmtState::pre_operational), NmtEvent::entered_pre_operational);
}

}  // namespace
}  // namespace kmax::firmware::canopen::nmt_test
