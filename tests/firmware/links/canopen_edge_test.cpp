// What the edge takes from its queue, by the application behind it.
#include "firmware/links/canopen_edge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "firmware/application.hpp"

namespace kmax::firmware::canopen_edge_test {
namespace {

TEST(CanopenEdge, OfAFloodAPollTakesSixteenFrames) {
  Application application(BoardIdentity{});
  CanReadings readings;
  readings.state = CanState::active;
  application.can().set_readings(readings);
  const auto poll = [&application](std::uint32_t now_us) {
    application.poll(now_us);
    drivers::CanFrame sent;
    while (application.can().next_frame(sent)) {
    }
  };
  poll(0);
  const Entry& entry = entry_at(entry_of<"capture.samples">());
  for (std::uint8_t number = 1; number <= 40; ++number) {
    application.can().ISR_frame(
        {.identifier = 0x601,
         .length = 8,
         .data = {0x23, static_cast<std::uint8_t>(entry.index()),
                  static_cast<std::uint8_t>(entry.index() >> 8), entry.object_subindex(), number, 0, 0, 0}});
  }
  for (const int taken : {16, 32, 40, 40}) {
    poll(50);
    EXPECT_EQ(application.values().whole<"capture.samples">(), taken);
  }
}

// An application whose clock is set at will, without ticks.
class EdgeAlone : public testing::Test {
 protected:
  EdgeAlone() {
    controller.state = CanState::active;
    poll();
  }
  void poll(std::uint32_t us = 0) {
    now_us += us;
    application.can().set_readings(controller);
    application.poll(now_us);
    drivers::CanFrame sent;
    while (application.can().next_frame(sent)) heard.push_back(sent);
  }
  void hear(std::uint32_t identifier, const std::array<std::uint8_t, 8>& data, std::uint8_t length = 8) {
    application.can().ISR_frame({.identifier = identifier, .length = length, .data = data});
    poll();
  }
  void write_cob_id(std::uint16_t index, std::uint8_t subindex, std::uint16_t identifier) {
    hear(0x601, {0x23, static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(index >> 8), subindex,
                 static_cast<std::uint8_t>(identifier), static_cast<std::uint8_t>(identifier >> 8), 0, 0});
  }
  template <FixedName name>
  std::uint32_t reading() {
    application.refresh_readings();
    return static_cast<std::uint32_t>(application.values().whole<name>());
  }
  std::size_t heard_of(std::uint32_t identifier) const {
    return static_cast<std::size_t>(std::count_if(
        heard.begin(), heard.end(), [&](const auto& frame) { return frame.identifier == identifier; }));
  }

  Application application{BoardIdentity{}};
  CanReadings controller;
  std::uint32_t now_us = 0;
  std::vector<drivers::CanFrame> heard;
};

TEST_F(EdgeAlone, WhatTheControllerSaysCanBeRead) {
  controller = {.state = CanState::error_passive,
                .transmit_errors = 130,
                .receive_errors = 7,
                .received = 1001,
                .sent = 1002,
                .overruns = 3,
                .bus_offs = 4,
                .discarded = 5};
  poll();
  EXPECT_EQ(reading<"can.state">(), 4U);
  EXPECT_EQ(reading<"can.transmit_errors">(), 130U);
  EXPECT_EQ(reading<"can.receive_errors">(), 7U);
  EXPECT_EQ(reading<"can.received">(), 1001U);
  EXPECT_EQ(reading<"can.sent">(), 1002U);
  EXPECT_EQ(reading<"can.overruns">(), 3U);
  EXPECT_EQ(reading<"can.bus_offs">(), 4U);
  EXPECT_EQ(reading<"can.discarded">(), 5U);
  EXPECT_EQ(reading<"can.bit_rate_in_use">(), 1'000'000U);
  EXPECT_EQ(reading<"can.node_in_use">(), 1U);
}

TEST_F(EdgeAlone, TheNodesStateIsThatOfNmt) {
  EXPECT_EQ(reading<"can.node_state">(), 127U);
  hear(0, {1, 1}, 2);
  EXPECT_EQ(reading<"can.node_state">(), 5U);
  hear(0, {2, 1}, 2);
  EXPECT_EQ(reading<"can.node_state">(), 4U);
}

// Both servers' transfers, of which each has failed another number of times.
TEST_F(EdgeAlone, CountsTheAbortsOfBothServers) {
  write_cob_id(0x1201, 1, 0x6A1);
  write_cob_id(0x1201, 2, 0x6B1);
  ASSERT_EQ(reading<"can.sdo_aborts">(), 0U);
  const std::array<std::uint8_t, 8> reads_what_is_not_there{0x40, 0xFF, 0x5F, 0};
  hear(0x601, reads_what_is_not_there);
  for (int i = 0; i < 3; ++i) hear(0x6A1, reads_what_is_not_there);
  EXPECT_EQ(reading<"can.sdo_aborts">(), 4U);
  EXPECT_EQ(reading<"can.sdo_timeouts">(), 0U);
  const std::array<std::uint8_t, 8> begins_to_read_the_name{0x40, 0x08, 0x10, 0};
  hear(0x601, begins_to_read_the_name);
  for (int i = 0; i < 2; ++i) {
    hear(0x6A1, begins_to_read_the_name);
    for (int second = 0; second < 10; ++second) poll(1'000'000);
  }
  EXPECT_EQ(reading<"can.sdo_timeouts">(), 3U);
  EXPECT_EQ(reading<"can.sdo_aborts">(), 7U);
}

TEST_F(EdgeAlone, FramesThatFindTheQueueFullAreCountedAndToldInAnEmergency) {
  for (int i = 0; i < 70; ++i)
    application.can().ISR_frame({.identifier = 0x601, .length = 8, .data = {0x80}});
  poll();
  EXPECT_EQ(reading<"can.queue_overflows">(), 70U - 64U);
  EXPECT_GE(heard_of(0x081), 1U);
}

TEST_F(EdgeAlone, AControllerThatLosesFramesIsToldInAnEmergency) {
  poll(10'000);
  ASSERT_EQ(heard_of(0x081), 0U);
  ++controller.overruns;
  poll(10'000);
  EXPECT_EQ(heard_of(0x081), 1U);
}

// Regular PDOs go with the rounds of ticks; where no ticks come a round is a millisecond.
TEST_F(EdgeAlone, WithoutTicksARoundIsAMillisecond) {
  poll(1'000);
  hear(0, {1, 1}, 2);
  std::vector<std::uint32_t> sent_us;
  while (now_us < 30'000) {
    heard.clear();
    poll(1);
    if (heard_of(0x181) != 0) sent_us.push_back(now_us);
  }
  EXPECT_EQ(sent_us, (std::vector<std::uint32_t>{2'000, 12'000, 22'000}));
}

TEST_F(EdgeAlone, ARestartIsWantedWhenAHostAsksAndNothingIsSentAnyMore) {
  EXPECT_FALSE(application.can().restart_wanted());
  hear(0, {0x81, 2}, 2);
  EXPECT_FALSE(application.can().restart_wanted()) << "another node";
  hear(0, {0x81, 1}, 2);
  EXPECT_TRUE(application.can().restart_wanted());
  heard.clear();
  for (int i = 0; i < 100; ++i) poll(100'000);
  EXPECT_TRUE(heard.empty());
}

}  // namespace
}  // namespace kmax::firmware::canopen_edge_test
