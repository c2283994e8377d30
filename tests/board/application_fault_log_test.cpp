// The fault log through the whole firmware: what trips an axis is in it, once, with the numbers of trip.*, on
// both links, and it outlives a restart.
#include <gtest/gtest.h>

#include <bit>

#include "firmware/command/fault_log.hpp"
#include "firmware/drive/fault.hpp"
#include "tests/board/canopen_host.hpp"

namespace kmax::board::application_fault_log_test {
namespace {

using firmware::Fault;
using firmware::LogEntry;
using firmware::LogEvent;
using firmware::LogWords;

class FaultLogOnBoard : public testing::Test, public CanOpenHost {
 protected:
  FaultLogOnBoard() {
    for (const std::size_t axis : {0U, 1U}) {
      bench.set_up_plain_wall(axis);
      bench.preset("velocity.limit", 0.1, axis);
      bench.device.stand_at(1000, axis);
    }
    run_ms(5);
  }
  /// Over serial; nothing: no entry there.
  LogEntry entry(std::uint32_t number) {
    const auto place = static_cast<std::uint16_t>(number % firmware::fault_log_entries);
    const Words words =
        bench.read(4, static_cast<std::uint16_t>(firmware::fault_log_window + 32 * place), 32);
    LogWords raw{};
    for (std::size_t i = 0; i < raw.size(); ++i)
      raw[i] = std::uint32_t{words.at(2 * i)} << 16 | words.at(2 * i + 1);
    const auto read = std::bit_cast<LogEntry>(raw);
    if (read.event != LogEvent::none) {
      EXPECT_EQ(std::uint32_t{words.at(30)} << 16 | words.at(31), firmware::log_crc(raw));
    }
    return read;
  }
  float number(const LogEntry& entry, firmware::TripNumber which) {
    return std::bit_cast<float>(entry.numbers[static_cast<std::size_t>(which)]);
  }
  void trip_by_speed(std::size_t axis) {
    ASSERT_TRUE(bench.arm(axis));
    run_ms(10);
    bench.device.move(1000, 10, axis);  // 0.2 m/s
    run_ms(10);
    ASSERT_EQ(bench.application().fault(axis), Fault::over_speed);
    bench.device.stand_at(1000, axis);
    run_ms(50);
  }
};

TEST_F(FaultLogOnBoard, HasTheNumbersOfTheTripAndHasItOnce) {
  EXPECT_EQ(bench.get("log.newest"), 0);
  run_ms(2500);
  trip_by_speed(1);
  EXPECT_EQ(bench.get("log.newest"), 1);
  EXPECT_EQ(bench.get("log.start"), 1);
  const LogEntry trip = entry(1);
  EXPECT_EQ(trip.number, 1U);
  EXPECT_EQ(trip.start, 1U);
  EXPECT_EQ(trip.count, 1U);
  EXPECT_EQ(trip.uptime_s, 2U);
  EXPECT_EQ(trip.event, LogEvent::trip);
  EXPECT_EQ(trip.axis, 1U);
  EXPECT_EQ(trip.code, firmware::error_code_of(Fault::over_speed));
  EXPECT_EQ(trip.tick, bench.get("trip.tick", 1));
  using enum firmware::TripNumber;
  EXPECT_GT(number(trip, value), 0.1f);
  EXPECT_EQ(number(trip, bound), 0.1f);
  for (const auto& [which, name] :
       {std::pair(value, "drive.fault_value"), std::pair(bound, "drive.fault_bound"),
        std::pair(position, "trip.position"), std::pair(velocity, "trip.velocity"),
        std::pair(force, "trip.force"), std::pair(current, "trip.current"),
        std::pair(current_reference, "trip.current_reference"), std::pair(supply, "trip.supply"),
        std::pair(temperature, "trip.temperature"),
        std::pair(winding_temperature, "trip.winding_temperature")})
    EXPECT_EQ(number(trip, which), static_cast<float>(bench.get(name, 1))) << name;
  run_ms(100);
  EXPECT_EQ(bench.get("log.newest"), 1) << "a fault that stays";
  bench.clear_fault(1);
  trip_by_speed(1);
  EXPECT_EQ(bench.get("log.newest"), 2) << "the same again";
}

TEST_F(FaultLogOnBoard, WhatHitsBothAxesIsTwoEntries) {
  bench.preset("link.timeout", 0.2);
  ASSERT_TRUE(bench.arm(0));
  ASSERT_TRUE(bench.arm(1));
  run_ms(300);
  ASSERT_EQ(bench.get("log.newest"), 2);
  for (const std::uint32_t number : {1U, 2U}) {
    EXPECT_EQ(entry(number).axis, number - 1);
    EXPECT_EQ(entry(number).code, firmware::error_code_of(Fault::link_silent));
  }
}

TEST_F(FaultLogOnBoard, OutlivesARestartAndIsTheSameOverBothLinks) {
  for (int i = 0; i < 3; ++i) {
    trip_by_speed(0);
    bench.clear_fault(0);
  }
  nmt(0x81);
  run_ms(20);
  EXPECT_EQ(bench.get("log.start"), 2);
  EXPECT_EQ(bench.get("log.newest"), 4);
  EXPECT_EQ(entry(3).code, firmware::error_code_of(Fault::over_speed));
  EXPECT_EQ(entry(4).event, LogEvent::start);
  EXPECT_EQ(entry(4).code, static_cast<unsigned>(firmware::ResetCause::software));
  EXPECT_EQ(entry(5).event, LogEvent::none);
  // By segments of 7 bytes, low byte first.
  const LogWords words = std::bit_cast<LogWords>(entry(3));
  heard.clear();
  send({.identifier = 0x601, .length = 8, .data = {0x40, 0x28, 0x58, 4}});
  std::vector<std::uint8_t> bytes;
  for (std::uint8_t toggle = 0x60; bytes.size() < 64; toggle ^= 0x10) {
    heard.clear();
    send({.identifier = 0x601, .length = 8, .data = {toggle}});
    for (const drivers::CanFrame& frame : heard) {
      if (frame.identifier == 0x581) bytes.insert(bytes.end(), frame.data.begin() + 1, frame.data.end());
    }
    ASSERT_FALSE(bytes.empty());
  }
  for (std::size_t i = 0; i < 4 * words.size(); ++i)
    EXPECT_EQ(bytes[i], static_cast<std::uint8_t>(words[i / 4] >> 8 * (i % 4))) << i;
}

TEST_F(FaultLogOnBoard, IsErasedOnlyDisarmed) {
  trip_by_speed(0);
  bench.clear_fault(0);
  ASSERT_TRUE(bench.arm(1));
  EXPECT_EQ(bench.set("log.command", 1), 4);
  EXPECT_EQ(bench.get("refusal.reason"), static_cast<int>(Refusal::while_armed));
  EXPECT_NE(write(0x5829, 1, 1, 2), 0U);
  EXPECT_EQ(entry(1).event, LogEvent::trip);
  bench.disarm(1);
  EXPECT_EQ(bench.set("log.command", 0), 3);
  EXPECT_EQ(bench.set("log.command", 1), 0);
  EXPECT_EQ(entry(1).event, LogEvent::none);
  EXPECT_EQ(bench.get("log.command"), 0);
  trip_by_speed(0);
  EXPECT_EQ(entry(3).event, LogEvent::trip) << "2 was the erasure";
}

// Neither a value nor another window's: asked for together they are refused, as any gap is.
TEST_F(FaultLogOnBoard, TheWindowEndsBehindTheSixteenthEntry) {
  const std::uint16_t end = firmware::fault_log_window + firmware::fault_log_registers;
  EXPECT_EQ(bench.read(4, end - 1, 1).size(), 1U);
  EXPECT_TRUE(bench.read(4, end, 1).empty());
  EXPECT_TRUE(bench.read(4, end - 1, 2).empty());
  EXPECT_TRUE(bench.read(4, firmware::fault_log_window - 1, 2).empty());
  EXPECT_EQ(bench.read(4, firmware::fault_log_window, 125).size(), 125U);
}

}  // namespace
}  // namespace kmax::board::application_fault_log_test
