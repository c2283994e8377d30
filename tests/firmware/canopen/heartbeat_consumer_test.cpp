#include "firmware/canopen/heartbeat_consumer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace kmax::firmware::canopen::heartbeat_consumer_test {
namespace {

using drivers::CanFrame;
using Bytes = std::vector<std::uint8_t>;
using Entries = std::array<std::uint32_t, watched_node_count>;

constexpr std::uint32_t entry(std::uint32_t node_id, std::uint32_t time_ms) {
  return node_id << 16 | time_ms;
}

CanFrame heartbeat(std::uint8_t node_id, std::uint8_t state = 0x05) {
  return {.identifier = 0x700U + node_id, .length = 1, .data = {state}};
}

HeartbeatConsumer watching(std::uint8_t node_id, std::uint16_t time_ms) {
  HeartbeatConsumer consumer;
  consumer.configure(0, entry(node_id, time_ms));
  return consumer;
}

TEST(HeartbeatConsumer, WatchesFourNodes) {
  EXPECT_EQ(watched_node_count, 4U);
}

TEST(HeartbeatConsumer, ChecksWhatIsWrittenToAnEntry) {
  const Entries entries{entry(5, 100), entry(6, 0), 0, entry(127, 65535)};
  EXPECT_EQ(HeartbeatConsumer::check(2, entry(7, 50), entries), Abort::none);
  EXPECT_EQ(HeartbeatConsumer::check(2, 0, entries), Abort::none);
  EXPECT_EQ(HeartbeatConsumer::check(2, entry(0, 50), entries), Abort::none) << "node 0: unused";
  EXPECT_EQ(HeartbeatConsumer::check(2, entry(5, 50), entries), Abort::incompatible);
  EXPECT_EQ(HeartbeatConsumer::check(2, entry(127, 1), entries), Abort::incompatible);
  EXPECT_EQ(HeartbeatConsumer::check(2, entry(5, 0), entries), Abort::none) << "time 0 watches nothing";
  EXPECT_EQ(HeartbeatConsumer::check(2, entry(6, 50), entries), Abort::none) << "the other one has time 0";
  EXPECT_EQ(HeartbeatConsumer::check(0, entry(5, 50), entries), Abort::none) << "its own place";
  EXPECT_EQ(HeartbeatConsumer::check(2, entry(128, 50), entries), Abort::value_range);
  EXPECT_EQ(HeartbeatConsumer::check(2, entry(255, 50), entries), Abort::value_range);
  EXPECT_EQ(HeartbeatConsumer::check(2, 1U << 24 | entry(7, 50), entries), Abort::value_range);
  EXPECT_EQ(HeartbeatConsumer::check(2, 1U << 31 | entry(7, 50), entries), Abort::value_range);
  EXPECT_EQ(HeartbeatConsumer::check(4, entry(7, 50), entries), Abort::no_subindex);
  EXPECT_EQ(static_cast<std::uint32_t>(Abort::incompatible), 0x06040043U);
  EXPECT_EQ(static_cast<std::uint32_t>(Abort::value_range), 0x06090030U);
}

TEST(HeartbeatConsumer, NothingIsLostBeforeTheFirstHeartbeat) {
  HeartbeatConsumer consumer = watching(5, 1);
  for (std::uint32_t t = 0; t < 1'000'000; t += 500) ASSERT_FALSE(consumer.poll(t));
  EXPECT_EQ(consumer.watch(0), HeartbeatWatch::waiting);
  consumer.receive(heartbeat(5, 0x00), 1'000'000);
  EXPECT_FALSE(consumer.poll(1'100'000)) << "a boot-up message is not a heartbeat";
  consumer.receive(heartbeat(5), 1'200'000);
  EXPECT_EQ(consumer.watch(0), HeartbeatWatch::alive);
  EXPECT_EQ(consumer.poll(1'201'000), 5);
}

TEST(HeartbeatConsumer, LostExactlyAfterItsTimeAndOnce) {
  for (const std::uint16_t time_ms : std::vector<std::uint16_t>{1, 20, 65535}) {
    for (const std::uint32_t start : {0U, 0x7FFF'FFFFU, 0xFFFF'FFFFU, 0U - 500U, 0U - 30'000'000U}) {
      HeartbeatConsumer consumer = watching(5, time_ms);
      EXPECT_FALSE(consumer.receive(heartbeat(5), start));
      const std::uint32_t time_us = time_ms * 1000U;
      for (std::uint32_t t = 0; t < time_us; t += 100'000) ASSERT_FALSE(consumer.poll(start + t));
      EXPECT_FALSE(consumer.poll(start + time_us - 1));
      EXPECT_EQ(consumer.poll(start + time_us), 5);
      EXPECT_TRUE(consumer.any_lost());
      for (std::uint32_t t = 0; t < 200'000'000; t += 99'991)
        ASSERT_FALSE(consumer.poll(start + time_us + t));
      EXPECT_EQ(consumer.counters().lost, 1U);
    }
  }
}

TEST(HeartbeatConsumer, ComesBackWithItsNextHeartbeatAndCanBeLostAgain) {
  HeartbeatConsumer consumer = watching(5, 10);
  consumer.receive(heartbeat(5), 0);
  ASSERT_EQ(consumer.poll(10'000), 5);
  EXPECT_FALSE(consumer.receive(heartbeat(5, 0x00), 11'000)) << "only the boot-up message";
  EXPECT_EQ(consumer.watch(0), HeartbeatWatch::lost);
  EXPECT_EQ(consumer.receive(heartbeat(5, 0x7F), 12'000), 5);
  EXPECT_FALSE(consumer.any_lost());
  EXPECT_FALSE(consumer.receive(heartbeat(5, 0x7F), 13'000)) << "it is back once";
  EXPECT_EQ(consumer.poll(23'000), 5);
}

TEST(HeartbeatConsumer, SeveralAreLostTogether) {
  HeartbeatConsumer consumer;
  for (std::size_t i = 0; i < watched_node_count; ++i) {
    consumer.configure(i, entry(static_cast<std::uint32_t>(10 + i), 10));
    consumer.receive(heartbeat(static_cast<std::uint8_t>(10 + i)), 0);
  }
  EXPECT_FALSE(consumer.receive(heartbeat(14), 0)) << "not watched";
  consumer.receive(heartbeat(12), 5000);
  std::vector<int> lost;
  while (const std::optional<std::uint8_t> node = consumer.poll(10'000)) lost.push_back(*node);
  EXPECT_EQ(lost, (std::vector<int>{10, 11, 13}));
  EXPECT_EQ(consumer.poll(15'000), 12);
}

TEST(HeartbeatConsumer, ARestartedNodeHasOneHeartbeatTimeOnce) {
  HeartbeatConsumer consumer = watching(5, 10);
  consumer.receive(heartbeat(5), 0);
  consumer.receive(heartbeat(5, 0x00), 9000);
  EXPECT_FALSE(consumer.poll(18'999));
  consumer.receive(heartbeat(5, 0x00), 18'000);
  EXPECT_EQ(consumer.poll(19'000), 5) << "starts again and again, and never sends a heartbeat";
  consumer.receive(heartbeat(5), 20'000);
  consumer.receive(heartbeat(5, 0x00), 29'000);
  EXPECT_FALSE(consumer.poll(38'999)) << "heartbeats in between: again a whole time";
  EXPECT_EQ(consumer.poll(39'000), 5);
}

TEST(HeartbeatConsumer, FramesThatAreNoHeartbeatsDoNotKeepANodeAlive) {
  HeartbeatConsumer consumer = watching(5, 10);
  consumer.receive(heartbeat(5), 0);
  for (unsigned state = 1; state < 256; ++state) {
    if (state == 0x04 || state == 0x05 || state == 0x7F) continue;
    consumer.receive(heartbeat(5, static_cast<std::uint8_t>(state)), 9000);
  }
  for (const std::uint8_t length : Bytes{0, 2, 8}) {
    CanFrame frame = heartbeat(5);
    frame.length = length;
    consumer.receive(frame, 9000);
  }
  for (const CanFrame& frame : {CanFrame{.identifier = 0x705, .remote = true, .length = 1, .data = {5}},
                                {.identifier = 0x705, .extended = true, .length = 1, .data = {5}},
                                {.identifier = 0x085, .length = 1, .data = {5}}})
    consumer.receive(frame, 9000);
  EXPECT_EQ(consumer.poll(10'000), 5);
  EXPECT_EQ(consumer.counters().heartbeats, 1U);
}

TEST(HeartbeatConsumer, IdentifiersAtTheEdges) {
  HeartbeatConsumer consumer;
  consumer.configure(0, entry(1, 10));
  consumer.configure(1, entry(127, 10));
  for (const std::uint32_t identifier : {0x700U, 0x780U, 0x7E4U, 0x7FFU}) {
    consumer.receive({.identifier = identifier, .length = 1, .data = {0x05}}, 0);
  }
  EXPECT_EQ(consumer.counters().heartbeats, 0U);
  consumer.receive(heartbeat(1), 0);
  consumer.receive(heartbeat(127), 0);
  EXPECT_EQ(consumer.counters().heartbeats, 2U);
}

TEST(HeartbeatConsumer, UnusedEntriesWatchNothing) {
  HeartbeatConsumer consumer;
  for (const std::uint32_t raw :
       {0U, entry(5, 0), entry(0, 100), entry(128, 100), entry(255, 1), 1U << 24 | entry(5, 1)}) {
    consumer.configure(0, raw);
    EXPECT_EQ(consumer.watch(0), HeartbeatWatch::unused) << raw;
    consumer.receive(heartbeat(5), 0);
    consumer.receive(heartbeat(0), 0);
    EXPECT_FALSE(consumer.poll(1'000'000)) << raw;
  }
  consumer.configure(4, entry(5, 1));
  EXPECT_EQ(consumer.watch(4), HeartbeatWatch::unused);
  EXPECT_EQ(consumer.counters().heartbeats, 0U);
}

TEST(HeartbeatConsumer, WritingAnEntryBeginsAnew) {
  HeartbeatConsumer consumer = watching(5, 10);
  consumer.receive(heartbeat(5), 0);
  EXPECT_FALSE(consumer.configure(0, entry(5, 20))) << "it was not lost";
  EXPECT_FALSE(consumer.poll(50'000));
  consumer.receive(heartbeat(5), 50'000);
  EXPECT_FALSE(consumer.poll(69'999));
  EXPECT_EQ(consumer.poll(70'000), 5);
  EXPECT_EQ(consumer.configure(0, entry(5, 20)), 5) << "its loss is forgotten";
  EXPECT_FALSE(consumer.any_lost());
  EXPECT_FALSE(consumer.receive(heartbeat(5), 80'000)) << "so it is not back";
  EXPECT_EQ(consumer.poll(100'000), 5);
  EXPECT_EQ(consumer.configure(0, entry(6, 20)), 5);
  EXPECT_FALSE(consumer.configure(0, 0));
}

TEST(HeartbeatConsumer, StartingAgainWaitsForTheAliveAndKeepsTheLost) {
  HeartbeatConsumer consumer = watching(5, 10);
  consumer.configure(1, entry(6, 10));
  consumer.receive(heartbeat(5), 0);
  ASSERT_EQ(consumer.poll(10'000), 5);
  consumer.receive(heartbeat(6), 10'000);
  consumer.start();
  EXPECT_EQ(consumer.watch(0), HeartbeatWatch::lost);
  EXPECT_EQ(consumer.watch(1), HeartbeatWatch::waiting);
  EXPECT_EQ(consumer.watch(2), HeartbeatWatch::unused);
  EXPECT_FALSE(consumer.poll(50'000)) << "nothing is lost a second time";
  EXPECT_EQ(consumer.receive(heartbeat(5), 50'000), 5);
  EXPECT_FALSE(consumer.receive(heartbeat(6), 50'000));
  EXPECT_EQ(consumer.poll(60'000), 5);
  EXPECT_EQ(consumer.poll(60'000), 6);
}

}  // namespace
}  // namespace kmax::firmware::canopen::heartbeat_consumer_test
