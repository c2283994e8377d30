// The running trace as a host reads it.
#include <gtest/gtest.h>

#include <bit>
#include <vector>

#include "tests/board/bench.hpp"

namespace kmax::board::application_trace_test {
namespace {

struct Record {
  std::uint32_t tick;
  std::int32_t count;
  float force, magnetic_coefficient;
};

class TraceOfABoard : public testing::Test {
 protected:
  void SetUp() override {
    bench.set_up_plain_wall();
    bench.device.stand_at(1000);
    bench.run_ticks(20);
  }
  std::vector<Record> records(std::uint32_t from, std::uint32_t to) {
    std::vector<Record> out;
    for (std::uint32_t r = from; r < to; ++r) {
      const Words w = bench.read(4, static_cast<std::uint16_t>(0x4000 + 8 * (r % 512)), 8);
      if (w.size() != 8) {
        ADD_FAILURE() << r;
        break;
      }
      const auto at = [&](std::size_t i) { return std::uint32_t{w[i]} << 16 | w[i + 1]; };
      out.push_back({at(0), static_cast<std::int32_t>(at(2)), std::bit_cast<float>(at(4)),
                     std::bit_cast<float>(at(6))});
    }
    return out;
  }
  std::uint32_t next() { return static_cast<std::uint32_t>(bench.get("trace.next")); }
  Bench bench;
};

TEST_F(TraceOfABoard, IsSilentUntilAskedFor) {
  bench.run_ms(50);
  EXPECT_EQ(next(), 0u);
}

TEST_F(TraceOfABoard, RecordsEveryNthSampleWithWhatTheTickComputed) {
  bench.set("wall.law", 2);  // magnetic, 2 N
  ASSERT_TRUE(bench.arm());
  bench.device.move(0, -1);
  bench.set("trace.interval", 100);
  bench.run_ms(100);
  bench.set("trace.interval", 0);
  const std::uint32_t end = next();
  ASSERT_GT(end, 15u);
  const auto all = records(0, end);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i > 0) {
      EXPECT_EQ(all[i].tick - all[i - 1].tick, 100u);
      EXPECT_EQ(all[i].count - all[i - 1].count, -100);
    }
    const float force = static_cast<float>(-all[i].count) * 1e-6f * 1000.0f + 2.0f;
    EXPECT_NEAR(all[i].force, force > 3.3f ? 3.3f : force, 1e-5f);
    EXPECT_EQ(all[i].magnetic_coefficient, 2.0f);
  }
  bench.run_ms(100);
  EXPECT_EQ(next(), end) << "stopped";
}

TEST_F(TraceOfABoard, IntervalCountsHapticSamplesNotTicks) {
  bench.preset("haptic.rate", 500);
  bench.set("trace.interval", 2);
  bench.run_ms(50);
  const auto all = records(0, 5);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_EQ(all[i].tick - all[i - 1].tick, 80u);
}

TEST_F(TraceOfABoard, WindowKeepsTheLast512AndTheTicksShowTheLoss) {
  bench.device.move(0, 1);
  bench.set("trace.interval", 1);
  bench.run_ticks(3000);
  bench.set("trace.interval", 0);
  const std::uint32_t end = next();
  ASSERT_GT(end, 3000u);
  const auto kept = records(end - 512, end);
  for (std::size_t i = 1; i < kept.size(); ++i) {
    ASSERT_EQ(kept[i].tick - kept[i - 1].tick, 1u) << i;
    ASSERT_EQ(kept[i].count - kept[i - 1].count, 1) << i;
  }
  const auto lost = records(end - 513, end - 512);
  EXPECT_NE(lost[0].tick + 1, kept[0].tick) << "overwritten";
}

TEST_F(TraceOfABoard, AShorterIntervalTakesEffectAtOnceNotAfterTheOldOne) {
  bench.set("trace.interval", 60000);
  bench.run_ms(10);
  ASSERT_EQ(next(), 1u);
  bench.set("trace.interval", 10);
  bench.run_ms(10);
  EXPECT_GT(next(), 15u);
}

TEST_F(TraceOfABoard, OtherAxisCanBeTraced) {
  bench.device.stand_at(4321, 1);
  bench.set("trace.axis", 1);
  bench.set("trace.interval", 20);
  bench.run_ms(10);
  bench.set("trace.interval", 0);
  const std::uint32_t end = next();
  ASSERT_GT(end, 0u);
  for (const Record& record : records(0, end)) EXPECT_EQ(record.count, 4321);
  EXPECT_EQ(bench.set("trace.axis", 2), 3);
}

TEST_F(TraceOfABoard, WindowReadsWholeAtItsEdgesAndNotBeyond) {
  EXPECT_EQ(bench.read(4, 0x4000, 125).size(), 125u);
  EXPECT_EQ(bench.read(4, 0x4F83, 125).size(), 125u);
  EXPECT_TRUE(bench.read(4, 0x4F84, 125).empty());
  EXPECT_TRUE(bench.read(4, 0x3FFF, 2).empty());
  EXPECT_TRUE(bench.read(4, 0x4FFF, 2).empty()) << "the capture window follows, but no read covers both";
  EXPECT_TRUE(bench.read(3, 0x4000, 1).empty()) << "input registers only";
}

}  // namespace
}  // namespace kmax::board::application_trace_test
