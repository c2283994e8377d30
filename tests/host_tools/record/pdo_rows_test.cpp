#include "host_tools/record/pdo_rows.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <vector>

namespace kmax::record::pdo_rows_test {

using drivers::CanFrame;
using std::chrono::microseconds;
using std::chrono::nanoseconds;

constexpr std::uint32_t period = 20;

PdoPlan plan_at(std::uint32_t tick) {
  return {.node = 3,
          .identifiers = {0x183, 0x283, 0x383, 0x483},
          .period_ticks = period,
          .count_lengths = {1e-5, 2e-5},
          .tick = tick};
}

CanFrame frame_of(std::uint32_t identifier, std::uint32_t low, std::uint32_t high) {
  CanFrame frame{.identifier = identifier, .length = 8};
  for (unsigned i = 0; i < 4; ++i) {
    frame.data[i] = static_cast<std::uint8_t>(low >> (8 * i));
    frame.data[4 + i] = static_cast<std::uint8_t>(high >> (8 * i));
  }
  return frame;
}

/// Values from which the moment can be told again.
std::vector<CanFrame> frames_of(std::uint64_t tick) {
  const auto moment = static_cast<std::uint32_t>(tick / period);
  const auto real = [&](float factor) {
    return std::bit_cast<std::uint32_t>(static_cast<float>(moment % 1000) * factor);
  };
  const std::uint32_t currents = (0x10000U - 250U) << 16 | 1500U;
  return {frame_of(0x183, moment, real(1)), frame_of(0x283, 0U - moment, real(2)),
          frame_of(0x383, real(3), real(4)),
          frame_of(0x483, currents, static_cast<std::uint32_t>(tick & 0xFFFF) << 16 | 0x1211U)};
}

void expect_of_one_moment(const Row& row) {
  const auto moment = static_cast<std::uint32_t>(row.tick / period);
  const auto part = static_cast<float>(moment % 1000);
  EXPECT_DOUBLE_EQ(row.axes[0].position, moment * 1e-5);
  EXPECT_DOUBLE_EQ(row.axes[1].position, moment * -2e-5);
  EXPECT_EQ(row.axes[0].force, part);
  EXPECT_EQ(row.axes[1].force, 2 * part);
  EXPECT_EQ(row.axes[0].velocity, 3 * part);
  EXPECT_EQ(row.axes[1].velocity, 4 * part);
  EXPECT_EQ(row.axes[0].tick, row.tick);
  EXPECT_EQ(row.axes[1].tick, row.tick);
}

nanoseconds time_of(std::uint64_t tick) {
  return std::chrono::hours(400000) + microseconds(50) * static_cast<std::int64_t>(tick);
}

class PdoRowsTest : public testing::Test {
 protected:
  void send(std::uint64_t tick, const std::vector<std::size_t>& parts = {0, 1, 2, 3}) {
    const auto frames = frames_of(tick);
    for (const std::size_t part : parts) {
      if (const auto row =
              rows.take(frames[part], time_of(tick) + microseconds(130) * static_cast<int>(part))) {
        expect_of_one_moment(*row);
        got.push_back(row->tick);
      }
    }
  }

  PdoRows rows{plan_at(100'000)};
  std::vector<std::uint64_t> got;
};
using Ticks = std::vector<std::uint64_t>;

TEST_F(PdoRowsTest, ARowHasAllValuesInSiUnits) {
  send(100'000);
  std::optional<Row> row;
  for (const CanFrame& frame : frames_of(100'020)) row = rows.take(frame, time_of(100'020));
  ASSERT_TRUE(row);
  EXPECT_EQ(row->tick, 100'020u);
  expect_of_one_moment(*row);
  EXPECT_FLOAT_EQ(row->axes[0].current, 1.5F);
  EXPECT_FLOAT_EQ(row->axes[1].current, -0.25F);
  EXPECT_EQ(row->axes[0].flags, 0x11);
  EXPECT_EQ(row->axes[1].flags, 0x12);
}

TEST_F(PdoRowsTest, BeginsAfterTheFirstClosingPdo) {
  send(100'000, {2, 3});
  for (std::uint64_t tick = 100'020; tick <= 100'100; tick += period) send(tick);
  EXPECT_EQ(got, (Ticks{100'020, 100'040, 100'060, 100'080, 100'100}));
  EXPECT_EQ(rows.losses().rows, 0u);
}

TEST_F(PdoRowsTest, AnyMissingPdoLosesItsRow) {
  for (std::size_t missing = 0; missing < 3; ++missing) {
    rows = PdoRows(plan_at(100'000));
    got.clear();
    for (std::uint64_t tick = 100'000; tick <= 100'120; tick += period) {
      std::vector<std::size_t> parts;
      for (std::size_t part = 0; part < 4; ++part) {
        if (tick != 100'060 || part != missing) parts.push_back(part);
      }
      send(tick, parts);
    }
    EXPECT_EQ(got, (Ticks{100'020, 100'040, 100'080, 100'100, 100'120})) << missing;
    EXPECT_EQ(rows.losses().rows, 1u);
    EXPECT_EQ(rows.losses().gaps, 1u);
  }
}

// Two moments that look like one: the end of the first and the beginning of the second were lost.
TEST_F(PdoRowsTest, ARowIsNeverMadeOfTwoMoments) {
  for (std::size_t from = 0; from < 4; ++from) {
    for (std::size_t lost = 1; lost <= 40; ++lost) {
      rows = PdoRows(plan_at(100'000));
      got.clear();
      std::size_t number = 0;
      for (std::uint64_t tick = 100'000; tick <= 100'400; tick += period) {
        std::vector<std::size_t> parts;
        for (std::size_t part = 0; part < 4; ++part, ++number) {
          if (number < 20 + from || number >= 20 + from + lost) parts.push_back(part);
        }
        send(tick, parts);
      }
      ASSERT_FALSE(HasFailure()) << from << " " << lost;
      EXPECT_EQ(got.size() + rows.losses().rows, 20u) << from << " " << lost;
    }
  }
}

TEST_F(PdoRowsTest, LossesAtTheEndCount) {
  send(100'000);
  send(100'020);
  send(100'040, {0, 1, 3});
  EXPECT_EQ(rows.losses().rows, 1u);
  EXPECT_EQ(rows.losses().gaps, 1u);
}

TEST_F(PdoRowsTest, TicksGoOnBeyondSixteenAndThirtyTwoBits) {
  rows = PdoRows(plan_at(0xFFFFFF00U));
  const std::uint64_t first = 0xFFFFFF10U / period * period;
  for (std::uint64_t tick = first; tick < first + 200'000; tick += period) send(tick);
  EXPECT_EQ(got.size(), 200'000 / period - 1);
  EXPECT_EQ(got.back(), first + 200'000 - period);
  EXPECT_EQ(rows.losses().rows, 0u);
}

TEST_F(PdoRowsTest, AfterALongGapTheTimeStampsTellTheTick) {
  for (const std::uint64_t gap : {20'000u, 65'520u, 65'580u, 200'000u, 1'000'000u}) {
    rows = PdoRows(plan_at(100'000));
    got.clear();
    send(100'000);
    send(100'020);
    const std::uint64_t after = 100'020 + gap;
    send(after);
    send(after + period);
    EXPECT_EQ(got, (Ticks{100'020, after + period})) << gap;
    EXPECT_EQ(rows.losses().rows, gap / period) << gap;
  }
}

// CLOCK_REALTIME can be set; rows that follow each other are not moved by that.
TEST_F(PdoRowsTest, ASetClockMovesNoRow) {
  send(100'000);
  send(100'020);
  for (const auto jump : {std::chrono::hours(1), std::chrono::hours(-1)}) {
    rows = PdoRows(plan_at(100'000));
    std::optional<Row> row;
    for (const CanFrame& frame : frames_of(100'000)) rows.take(frame, time_of(100'000));
    for (const CanFrame& frame : frames_of(100'020)) row = rows.take(frame, time_of(100'020) + jump);
    ASSERT_TRUE(row);
    EXPECT_EQ(row->tick, 100'020u);
  }
}

TEST_F(PdoRowsTest, ADeviceThatHasJustStartedHasNoNegativeTicks) {
  rows = PdoRows(plan_at(10));
  send(65'500);  // 36 before zero, were it not the beginning
  send(65'520);
  EXPECT_EQ(got, (Ticks{65'520}));
}

TEST_F(PdoRowsTest, OtherFramesAreIgnored) {
  send(100'000);
  auto frames = frames_of(100'020);
  CanFrame remote = frames[0], extended = frames[1], other = frames[2], cut = frames[0];
  remote.remote = true;
  extended.extended = true;
  other.identifier = 0x384;
  cut.length = 7;
  for (const CanFrame& frame : {remote, extended, other, cut})
    EXPECT_FALSE(rows.take(frame, time_of(100'020)));
  EXPECT_EQ(rows.malformed(), 1u);
  EXPECT_FALSE(rows.take(frames[3], time_of(100'020)));  // none of them counted as a part
}

RC_GTEST_PROP(PdoRowsProperty, WhateverIsLostNoRowIsMixedAndAllAreAccountedFor,
              (const std::vector<bool>& kept, std::uint16_t start)) {
  const std::uint64_t first = std::uint64_t{start} * period;
  PdoRows rows(plan_at(static_cast<std::uint32_t>(first)));
  std::uint64_t written = 0, last = 0, first_row = 0;
  std::size_t number = 0;
  const std::uint64_t moments = kept.size() / 4 + 4;
  for (std::uint64_t moment = 0; moment < moments; ++moment) {
    const std::uint64_t tick = first + moment * period;
    for (const CanFrame& frame : frames_of(tick)) {
      // The last two moments are whole, so that losses before them show.
      const bool keep = moment + 3 >= moments || moment < 1 || kept[number];
      if (moment >= 1 && moment + 3 < moments) ++number;
      if (!keep) continue;
      if (const auto row = rows.take(frame, time_of(tick))) {
        RC_ASSERT(row->axes[0].position == static_cast<double>(row->tick / period) * 1e-5);
        RC_ASSERT(row->axes[0].force == static_cast<float>(row->tick / period % 1000));
        RC_ASSERT(row->axes[1].velocity == 4 * static_cast<float>(row->tick / period % 1000));
        if (written == 0) first_row = row->tick;
        RC_ASSERT(row->tick > last || written == 0);
        last = row->tick;
        ++written;
      }
    }
  }
  RC_ASSERT(last == first + (moments - 1) * period);
  RC_ASSERT(written + rows.losses().rows == (last - first_row) / period + 1);
}

}  // namespace kmax::record::pdo_rows_test
