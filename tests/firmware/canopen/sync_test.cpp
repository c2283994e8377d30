#include "firmware/canopen/sync.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>
#include <vector>

namespace kmax::firmware::canopen::sync_test {
namespace {

constexpr std::uint32_t makes = cob_id::generates | 0x80;

/// A SYNC, and a clock in 64 bits of which it sees 32.
struct SyncBench {
  explicit SyncBench(const Sync::Settings& settings, std::uint64_t start_us = 0xFFFF'0000U,
                     std::uint32_t bit_rate = 1'000'000)
      : now_us(start_us) {
    sync.configure(settings, bit_rate, clock());
    sync.start(clock());
  }
  std::uint32_t clock() const { return static_cast<std::uint32_t>(now_us); }
  bool step(std::uint64_t us) {
    now_us += us;
    return sync.poll(clock());
  }
  /// What went, by its time since the start; everything is sent at once.
  std::vector<std::uint64_t> run(std::uint64_t us, std::uint64_t poll_us = 200) {
    std::vector<std::uint64_t> times;
    for (const std::uint64_t start = now_us; now_us < start + us;) {
      drivers::CanFrame frame;
      const bool due = step(poll_us);
      EXPECT_EQ(sync.next_frame(frame), due);
      if (!due) continue;
      times.push_back(now_us - start);
      sent.push_back(frame);
    }
    return times;
  }

  Sync sync;
  std::uint64_t now_us;
  std::vector<drivers::CanFrame> sent;
};

using Times = std::vector<std::uint64_t>;

TEST(Sync, IsOneWithItsIdentifierAndWhateverLength) {
  Sync sync;
  EXPECT_TRUE(sync.receives({.identifier = 0x080, .length = 0}));
  EXPECT_TRUE(sync.receives({.identifier = 0x080, .length = 8}));
  EXPECT_FALSE(sync.receives({.identifier = 0x081}));
  EXPECT_FALSE(sync.receives({.identifier = 0x080, .extended = true}));
  EXPECT_FALSE(sync.receives({.identifier = 0x080, .remote = true}));
  sync.configure({.cob_id = 0x8000'0085}, 1'000'000, 0);
  EXPECT_EQ(sync.identifier(), 0x085U);
  EXPECT_FALSE(sync.receives({.identifier = 0x080}));
  EXPECT_TRUE(sync.receives({.identifier = 0x085}));
}

TEST(Sync, HasAByteIfItHasACounter) {
  for (const auto& [overflow, length] : {std::pair{0, 0}, {1, 0}, {2, 1}, {240, 1}}) {
    Sync sync;
    sync.configure({.counter_overflow = static_cast<std::uint8_t>(overflow)}, 1'000'000, 0);
    EXPECT_EQ(sync.length(), length) << overflow;
  }
}

TEST(Sync, ChecksWhatIsWritten) {
  for (const std::uint32_t good :
       {0x080U, 0x8000'0080U, 0x4000'0080U, 0xC000'0080U, 0x0FFU, 0x100U, 0x181U, 0x6DFU})
    EXPECT_EQ(Sync::check(good, 0x80), Abort::none) << good;
  for (const std::uint32_t bad : {0x2000'0080U, 0x880U, 0x000U, 0x4000'0000U, 0x001U, 0x07FU, 0x180U, 0x581U,
                                  0x601U, 0x701U, 0x7E5U, 0x7FFU, 0xFFFF'FFFFU})
    EXPECT_EQ(Sync::check(bad, 0x80), Abort::value_range) << bad;
}

// CiA 301, object 0x1005: the identifier stays while the device makes the SYNC.
TEST(Sync, AnotherIdentifierNotWhileItIsMade) {
  EXPECT_EQ(Sync::check(0x81, 0x80), Abort::none);
  EXPECT_EQ(Sync::check(0x4000'0081, 0x80), Abort::none);
  EXPECT_EQ(Sync::check(0x81, 0x4000'0080), Abort::device_state);
  EXPECT_EQ(Sync::check(0x4000'0081, 0x4000'0080), Abort::device_state);
  EXPECT_EQ(Sync::check(0x80, 0x4000'0080), Abort::none);
  EXPECT_EQ(Sync::check(0xC000'0080, 0x4000'0080), Abort::none);
}

TEST(Sync, WhatIsInStepIsWholeMillisecondsFromIt) {
  EXPECT_EQ(Sync().in_step(1234), 1234U);
  for (const std::uint32_t start : {0U, 0xFFFF'F000U}) {
    SyncBench bench({.cob_id = makes, .period_us = 4000}, start);
    for (std::uint32_t us = 0; us <= 6'000; us += 250) {
      const std::uint32_t asked = start + us, answer = bench.sync.in_step(asked);
      EXPECT_EQ(answer, start + (us + 999) / 1000 * 1000) << us;
    }
  }
}

TEST(Sync, NoneIsMadeUnlessBothAreAskedFor) {
  for (const Sync::Settings& settings :
       {Sync::Settings{}, Sync::Settings{.cob_id = makes}, Sync::Settings{.period_us = 1000}}) {
    EXPECT_EQ(SyncBench(settings).run(100'000), Times{});
  }
}

TEST(Sync, TheFirstGoesOnePeriodAfterTheStartAndTheOthersOnThatGrid) {
  SyncBench bench({.cob_id = makes, .period_us = 2000});
  EXPECT_EQ(bench.run(8'000), (Times{2000, 4000, 6000, 8000}));
  EXPECT_EQ(bench.sent[0], (drivers::CanFrame{.identifier = 0x80, .length = 0}));
  SyncBench uneven({.cob_id = makes, .period_us = 1500});
  EXPECT_EQ(uneven.run(6'000), (Times{1600, 3000, 4600, 6000})) << "on the average";
}

TEST(Sync, LateCallsDoNotShiftTheGridAndMakeNoBurst) {
  SyncBench bench({.cob_id = makes, .period_us = 1000});
  EXPECT_TRUE(bench.step(3'700));
  drivers::CanFrame frame;
  EXPECT_TRUE(bench.sync.next_frame(frame));
  EXPECT_FALSE(bench.sync.next_frame(frame));
  EXPECT_EQ(bench.run(2'000, 100), (Times{300, 1300}));
}

TEST(Sync, OneThatCannotLeaveHoldsTheNextOnesBack) {
  SyncBench bench({.cob_id = makes, .period_us = 1000, .counter_overflow = 10});
  EXPECT_TRUE(bench.step(1000));
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(bench.step(1000));
  drivers::CanFrame frame;
  EXPECT_TRUE(bench.sync.next_frame(frame));
  EXPECT_EQ(frame.data[0], 1);
  EXPECT_FALSE(bench.sync.next_frame(frame));
  EXPECT_TRUE(bench.step(1000));
  EXPECT_TRUE(bench.sync.next_frame(frame));
  EXPECT_EQ(frame.data[0], 2) << "of those that went";
}

TEST(Sync, ItsCounterGoesFrom1ToTheOverflow) {
  SyncBench bench({.cob_id = makes, .period_us = 1000, .counter_overflow = 3});
  bench.run(5'000);
  ASSERT_EQ(bench.sent.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(bench.sent[i].length, 1);
    EXPECT_EQ(bench.sent[i].data[0], 1 + i % 3);
  }
  bench.sent.clear();
  bench.sync.start(bench.clock());
  bench.run(1'000);
  ASSERT_EQ(bench.sent.size(), 1U);
  EXPECT_EQ(bench.sent[0].data[0], 1) << "after NMT stop";
}

TEST(Sync, OnASlowBusThePeriodIsStretched) {
  EXPECT_EQ(SyncBench({.cob_id = makes, .period_us = 1000}, 0, 125'000).run(24'000),
            (Times{8000, 16000, 24000}));
  EXPECT_EQ(SyncBench({.cob_id = makes, .period_us = 1}, 0).run(2'000), (Times{1000, 2000}))
      << "a stored one";
}

TEST(Sync, TheSameSettingsGoOnAndAnotherPeriodBeginsAnew) {
  SyncBench bench({.cob_id = makes, .period_us = 2000});
  bench.run(3'000);
  bench.sync.configure({.cob_id = makes, .period_us = 2000}, 1'000'000, bench.clock());
  EXPECT_EQ(bench.run(3'000), (Times{1000, 3000}));
  bench.sync.configure({.cob_id = makes, .period_us = 4000}, 1'000'000, bench.clock());
  EXPECT_EQ(bench.run(8'000), (Times{4000, 8000}));
  EXPECT_TRUE(bench.step(4000));
  bench.sync.configure({.cob_id = 0x80, .period_us = 4000}, 1'000'000, bench.clock());
  drivers::CanFrame frame;
  EXPECT_FALSE(bench.sync.next_frame(frame)) << "nor what waits";
}

RC_GTEST_PROP(Sync, OverAnyPollsThereAreAsManyAsPeriodsAndEachIsOnTheGrid, ()) {
  const auto period = *rc::gen::inRange(1000U, 20'000U);
  SyncBench bench({.cob_id = makes, .period_us = period}, *rc::gen::inRange<std::uint64_t>(0, 0x1'0000'0000));
  const std::uint64_t start = bench.now_us;
  std::uint64_t made = 0;
  for (const std::uint64_t wait :
       *rc::gen::container<std::vector<std::uint64_t>>(rc::gen::inRange<std::uint64_t>(1, 1000))) {
    const std::uint64_t before = (bench.now_us - start) / period;
    drivers::CanFrame frame;
    const bool due = bench.step(wait);
    RC_ASSERT(due == ((bench.now_us - start) / period != before));
    RC_ASSERT(bench.sync.next_frame(frame) == due);
    made += due ? 1 : 0;
  }
  RC_ASSERT(made == (bench.now_us - start) / period);
}

}  // namespace
}  // namespace kmax::firmware::canopen::sync_test
