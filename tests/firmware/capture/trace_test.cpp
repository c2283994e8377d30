#include "firmware/capture/trace.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

namespace kmax::firmware::trace_test {
namespace {

TraceRecord record_at(const Trace& trace, std::uint32_t number) {
  const auto first = static_cast<std::uint16_t>(0x4000 + 8 * (number % 512));
  std::uint32_t fields[4];
  for (std::uint16_t i = 0; i < 4; ++i) {
    const auto high = static_cast<std::uint16_t>(first + 2 * i);
    fields[i] =
        std::uint32_t{trace.word_at(high)} << 16 | trace.word_at(static_cast<std::uint16_t>(high + 1));
  }
  TraceRecord record;
  std::memcpy(&record.tick, &fields[0], 4);
  std::memcpy(&record.count, &fields[1], 4);
  std::memcpy(&record.force, &fields[2], 4);
  std::memcpy(&record.magnetic_coefficient, &fields[3], 4);
  return record;
}

TEST(Trace, WindowIsWhereTheProtocolSaysAndNowhereElse) {
  EXPECT_FALSE(Trace::contains(0x3FFF));
  EXPECT_TRUE(Trace::contains(0x4000));
  EXPECT_TRUE(Trace::contains(0x4FFF));
  EXPECT_FALSE(Trace::contains(0x5000));
  EXPECT_FALSE(Trace::contains(0x14000));
}

TEST(Trace, KeepsTheLast512RecordsWithTheirExactBits) {
  Trace trace;
  EXPECT_EQ(trace.next(), 0u);
  const auto made = [](std::uint32_t i) {
    return TraceRecord{0xFFFF0000u + i,
                       std::numeric_limits<std::int32_t>::min() + static_cast<std::int32_t>(i),
                       -1.1f * static_cast<float>(i), 0.1f * static_cast<float>(i)};
  };
  for (std::uint32_t i = 0; i < 2000; ++i) {
    trace.ISR_push(made(i));
    EXPECT_EQ(trace.next(), i + 1);
  }
  for (std::uint32_t i = 2000 - 512; i < 2000; ++i) {
    const TraceRecord read = record_at(trace, i), expected = made(i);
    EXPECT_EQ(std::memcmp(&read, &expected, sizeof read), 0) << i;
  }
  // What has been overwritten shows in the ticks.
  EXPECT_NE(record_at(trace, 1487).tick, made(1487).tick);
}

}  // namespace
}  // namespace kmax::firmware::trace_test
