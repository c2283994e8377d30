#include "host_tools/device/fault_log.hpp"

#include <gtest/gtest.h>

#include <map>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/serial/register_link.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::fault_log_test {
namespace {

using firmware::LogEntry;
using firmware::LogEvent;

/// A device whose log is what a test says, some of it torn when it is read.
class Log final : public device::RegisterLink {
 public:
  void put(std::uint32_t number) {
    entries[number % firmware::fault_log_entries] = {
        .number = number, .tick = 7 * number, .event = LogEvent::trip, .code = 0x8130};
  }
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override {
    EXPECT_EQ(count, 32);
    std::vector<std::uint16_t> registers(count);
    const auto entry = entries.find((address - firmware::fault_log_window) / 32U);
    if (entry == entries.end()) return registers;
    const auto words = std::bit_cast<firmware::LogWords>(entry->second);
    for (std::size_t i = 0; i < firmware::fault_log_words; ++i) {
      const std::uint32_t word = i < words.size() ? words[i] : firmware::log_crc(words);
      registers[2 * i] = static_cast<std::uint16_t>(word >> 16);
      registers[2 * i + 1] = static_cast<std::uint16_t>(word);
    }
    if (torn > 0) --torn, registers[6] ^= 1U;
    return registers;
  }
  std::vector<std::uint16_t> read_holding(std::uint16_t /*address*/, std::uint16_t count) override {
    return std::vector<std::uint16_t>(count);
  }
  void write_holding(std::uint16_t /*address*/, std::span<const std::uint16_t> /*values*/) override {}
  std::string description() const override { return "test"; }

  std::map<std::size_t, LogEntry> entries;
  int torn = 0;
};

std::vector<std::uint32_t> numbers(Log& log) {
  std::vector<std::uint32_t> all;
  for (const LogEntry& entry : read_fault_log(log)) all.push_back(entry.number);
  return all;
}

TEST(FaultLogOfDevice, IsReadNewestFirstAlsoWhereNumbersWrap) {
  Log log;
  EXPECT_TRUE(numbers(log).empty());
  for (const std::uint32_t number : {0xFFFF'FFFEU, 0xFFFF'FFFFU, 0U, 1U}) log.put(number);
  EXPECT_EQ(numbers(log), (std::vector<std::uint32_t>{1, 0, 0xFFFF'FFFF, 0xFFFF'FFFE}));
}

TEST(FaultLogOfDevice, WhatIsReplacedMeanwhileIsReadAgain) {
  Log log;
  log.put(5);
  log.torn = 2;
  EXPECT_EQ(numbers(log), std::vector<std::uint32_t>{5});
  log.torn = 3;
  const auto message = host_tools_test::thrown_message<base::DeviceError>([&] { numbers(log); });
  EXPECT_CONTAINS(message, "place 5 of the fault log holds no whole entry in 3 attempts");
  EXPECT_CONTAINS(message, "'kmax faults --clear'");
}

TEST(FaultLogOfDevice, TheTimeIsRightAfterTheTicksHaveWrapped) {
  LogEntry entry{.uptime_s = 100, .tick = 2'001'000, .event = LogEvent::trip};
  EXPECT_DOUBLE_EQ(time_of(entry), 100.05);
  entry.uptime_s = 2 * 214748 + 100;
  EXPECT_NEAR(time_of(entry), 2 * 4294967296.0 / 20000 + 100.05, 1e-6);
  entry.tick = 0xFFFF'FFFF;  // just before the wrap
  entry.uptime_s = 214748;
  EXPECT_NEAR(time_of(entry), 214748.36, 0.01);
}

TEST(FaultLogOfDevice, EachEntryHasAName) {
  LogEntry entry{.event = LogEvent::trip, .code = 0x8130};
  EXPECT_EQ(name_of(entry), "link_silent");
  entry.code = 0x1234;
  EXPECT_EQ(name_of(entry), "error 0x1234");
  entry = {.event = LogEvent::start, .code = 7};
  EXPECT_EQ(name_of(entry), "brown-out");
  EXPECT_EQ(crash_before(entry).count, 0U);
  entry.numbers = {3, 1U | 3U << 16, 0x0800'C123};
  EXPECT_EQ(name_of(entry), "crash of the firmware");
  EXPECT_EQ(crash_before(entry).exception_number, 3);
  EXPECT_EQ(crash_before(entry).program_counter, 0x0800'C123U);
}

}  // namespace
}  // namespace kmax::device::fault_log_test
