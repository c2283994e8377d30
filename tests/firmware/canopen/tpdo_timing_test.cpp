#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "firmware/canopen/tpdo.hpp"
#include "tests/firmware/canopen/tpdo_bench.hpp"

namespace kmax::firmware::canopen::tpdo_timing_test {
namespace {

constexpr std::uint64_t wrap = std::uint64_t{1} << 32;
constexpr std::uint64_t day = 86'400'000'000;

std::uint16_t communication(unsigned n) {
  return static_cast<std::uint16_t>(0x1800 + n);
}

// Frames on the grid start + k period, each within `late_us` of its time, none left out or twice.
void expect_grid(const std::vector<SentPdo>& sent, std::uint32_t identifier, std::uint64_t start_us,
                 std::uint64_t period_us, std::uint64_t late_us, std::uint64_t end_us) {
  std::uint64_t due = start_us;
  for (const SentPdo& pdo : sent) {
    if (pdo.identifier != identifier) continue;
    ASSERT_GE(pdo.time_us, due);
    ASSERT_LE(pdo.time_us, due + late_us);
    due += period_us;
  }
  EXPECT_GT(due, end_us - period_us);
  EXPECT_LE(due, end_us + period_us);
}

TEST(TpdoTiming, DaysOfJitteredPollsDoNotMoveTheGrid) {
  const std::uint64_t start = wrap - 12'345;
  TpdoBench bench(start);
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 1000), Abort::none);
  ASSERT_EQ(bench.remap(0x1801, {position}, 0x285, 254, 1000), Abort::none);
  ASSERT_EQ(bench.remap(0x1802, {position}, 0x385, 254, 65535), Abort::none);
  ASSERT_EQ(bench.remap(0x1803, {position}, 0x485, 254, 300), Abort::none);
  bench.configure();
  std::minstd_rand random(1);
  std::uniform_int_distribution<std::uint64_t> jitter(1, 100'000);
  bench.step(0);
  while (bench.now_us < start + 2 * day) bench.step(jitter(random));
  expect_grid(bench.sent, 0x185, start, 1'000'000, 100'000, bench.now_us);
  expect_grid(bench.sent, 0x285, start, 1'000'000, 100'000, bench.now_us);
  expect_grid(bench.sent, 0x385, start, 65'535'000, 100'000, bench.now_us);
  expect_grid(bench.sent, 0x485, start, 300'000, 100'000, bench.now_us);
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
  for (std::size_t i = 0; i + 1 < bench.sent.size(); ++i) {
    if (bench.sent[i].identifier != 0x185) continue;
    ASSERT_EQ(bench.sent[i + 1].identifier, 0x285U);
    ASSERT_EQ(bench.sent[i + 1].time_us, bench.sent[i].time_us);
  }
}

TEST(TpdoTiming, EachMillisecondAcrossTheWrap) {
  const std::uint64_t start = wrap - 3'000'000;
  TpdoBench bench(start);
  for (unsigned n = 0; n < 4; ++n)
    ASSERT_EQ(bench.remap(communication(n), {position}, 0x333U + n, 255, 1), Abort::none);
  bench.configure();
  std::minstd_rand random(2);
  std::uniform_int_distribution<std::uint64_t> jitter(20, 300);
  bench.step(0);
  while (bench.now_us < wrap + 3'000'000) bench.step(jitter(random));
  for (unsigned n = 0; n < 4; ++n) expect_grid(bench.sent, 0x333 + n, start, 1000, 300, bench.now_us);
  EXPECT_EQ(static_cast<std::size_t>(bench.source.refreshes), bench.sent.size() / 4);
}

TEST(TpdoTiming, ALatePollSendsOnceCountsTheMissedAndKeepsTheGrid) {
  TpdoBench bench(wrap - 50'000);
  const std::uint64_t start = bench.now_us;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 1), Abort::none);
  bench.configure();
  bench.step(0);
  bench.step(99'900);  // 1 to 99 ms are due
  EXPECT_EQ(bench.sent.size(), 2U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 98U);
  bench.step(99);
  EXPECT_EQ(bench.sent.size(), 2U);
  bench.step(1);
  ASSERT_EQ(bench.sent.size(), 3U);
  EXPECT_EQ(bench.sent[2].time_us, start + 100'000);
  bench.step(1000);
  EXPECT_EQ(bench.sent.size(), 4U);
}

TEST(TpdoTiming, ABusyBusDoesNotMoveTheGrid) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 1), Abort::none);
  bench.configure();
  for (std::uint64_t i = 0; i < 1000; ++i) {
    bench.now_us = 1000 * i;
    bench.tpdos.poll(bench.clock());
    bench.now_us += i % 10 * 99;  // up to 0.9 ms until there is room
    bench.tpdos.poll(bench.clock());
    bench.fetch_all();
    ASSERT_EQ(bench.sent.size(), i + 1);
  }
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
}

TEST(TpdoTiming, TheEventTimeLeavesRoomOnASlowerBus) {
  const std::vector<std::pair<std::uint32_t, std::uint64_t>> least{{1'000'000, 1000}, {800'000, 1250},
                                                                   {500'000, 2000},   {250'000, 4000},
                                                                   {125'000, 8000},   {10'000, 100'000}};
  for (const auto& [bit_rate, period_us] : least) {
    for (const std::uint32_t event_ms : {1U, 3U, 0U}) {
      TpdoBench bench;
      bench.bit_rate = bit_rate;
      ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, event_ms), Abort::none);
      bench.configure();
      while (bench.now_us < 1'000'000) {
        ++bench.source.live[position_slot];
        bench.step(10);
      }
      EXPECT_EQ(bench.sent.size(), 1'000'000 / std::max<std::uint64_t>(period_us, 1000 * event_ms) + 1)
          << bit_rate << ' ' << event_ms;
    }
  }
}

TEST(TpdoTiming, AChangeOfOnePdoLeavesTheOthersAndJoinsTheirGrid) {
  TpdoBench bench(777);
  for (unsigned n = 0; n < 3; ++n)
    ASSERT_EQ(bench.remap(communication(n), {position}, 0x333U + n, 255, 10), Abort::none);
  bench.configure();
  bench.run(33'333, 1);
  bench.sent.clear();
  ASSERT_EQ(bench.write(0x1801, 2, 254), Abort::none);  // its settings: another, the same period
  ASSERT_EQ(bench.write(0x1802, 5, 5), Abort::none);    // half the period
  ASSERT_EQ(bench.remap(0x1803, {position}, 0x336, 255, 20), Abort::none);
  bench.configure();
  const std::uint64_t changed = bench.now_us;
  bench.run(45'000, 1);
  for (unsigned n = 0; n < 4; ++n) {
    const std::uint64_t period = n == 2 ? 5000 : n == 3 ? 20'000 : 10'000;
    std::vector<std::uint64_t> times;
    for (const SentPdo& pdo : bench.sent) {
      if (pdo.identifier == 0x333 + n) times.push_back(pdo.time_us);
    }
    ASSERT_GE(times.size(), 2U) << n;
    EXPECT_EQ((times[0] - 777) % (n == 2 ? 5000 : 10'000), 0U) << n;  // on the grid
    EXPECT_LE(times[0], changed + period) << n;
    for (std::size_t i = 1; i < times.size(); ++i) EXPECT_EQ(times[i] - times[i - 1], period) << n;
  }
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
}

TEST(TpdoTiming, AFastOneThatJoinsASlowOneDoesNotWaitForIt) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 60'000), Abort::none);
  bench.configure();
  bench.run(1'000'300, 100);
  ASSERT_EQ(bench.remap(0x1801, {position}, 0x285, 255, 1), Abort::none);
  bench.configure();
  bench.run(1000, 100);
  ASSERT_EQ(bench.sent.size(), 2U);
  EXPECT_EQ(bench.sent[1].time_us, 1'001'000U);
}

TEST(TpdoTiming, TheSameSettingsAgainDisturbNothing) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 1), Abort::none);
  ASSERT_EQ(bench.remap(0x1801, {position}, 0x285, 3), Abort::none);
  bench.configure();
  for (int i = 0; i < 3000; ++i) {
    bench.configure();
    bench.step(10);
    if (i % 100 == 99) bench.sync();
  }
  EXPECT_EQ(
      std::count_if(bench.sent.begin(), bench.sent.end(), [](auto& p) { return p.identifier == 0x285; }), 10);
  EXPECT_EQ(bench.sent.size(), 10U + 31U);
}

TEST(TpdoTiming, TheInhibitTimeDelaysAndKeepsTheLatestValue) {
  TpdoBench bench(wrap - 12'000);
  const std::uint64_t start = bench.now_us;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 0, 100), Abort::none);  // 10 ms
  bench.configure();
  bench.step(0);
  bench.source.live[position_slot] = 1;
  bench.run(5000, 50);
  EXPECT_EQ(bench.sent.size(), 1U);
  bench.source.live[position_slot] = 2;
  bench.run(4950, 50);
  EXPECT_EQ(bench.sent.size(), 1U);
  bench.step(50);
  ASSERT_EQ(bench.sent.size(), 2U);
  EXPECT_EQ(bench.sent[1].time_us, start + 10'000);
  EXPECT_EQ(bench.sent[1].first_value, 2U);
  bench.source.live[position_slot] = 3;  // and back: nothing has changed when it may go again
  bench.run(5000, 50);
  bench.source.live[position_slot] = 2;
  bench.run(20'000, 50);
  EXPECT_EQ(bench.sent.size(), 2U);
  bench.source.live[position_slot] = 4;
  bench.run(1000, 50);
  EXPECT_EQ(bench.sent.size(), 3U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
}

TEST(TpdoTiming, AnInhibitTimeLongerThanTheEventTimeThinsThemOut) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 1, 25), Abort::none);  // 2.5 ms
  bench.configure();
  bench.run(100'000, 20);
  for (std::size_t i = 1; i < bench.sent.size(); ++i)
    EXPECT_GE(bench.sent[i].time_us - bench.sent[i - 1].time_us, 2500U);
  EXPECT_GE(bench.sent.size(), 39U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);  // as it was asked for
}

TEST(TpdoTiming, ALatePollWithinTheInhibitTimeMissesNothing) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 1, 500), Abort::none);  // 50 ms
  bench.configure();
  bench.step(0);
  bench.step(20'500);
  EXPECT_EQ(bench.sent.size(), 1U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
}

TEST(TpdoTiming, AnInhibitTimeOutlivesAChangeOfTheType) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 0, 100), Abort::none);
  bench.configure();
  bench.step(0);
  ASSERT_EQ(bench.write(0x1800, 2, 254), Abort::none);
  bench.configure();
  bench.run(9900, 100);
  EXPECT_EQ(bench.sent.size(), 1U);
  ASSERT_EQ(bench.write(0x1800, 2, 1), Abort::none);  // with SYNC there is none
  bench.configure();
  bench.sync();
  EXPECT_EQ(bench.sent.size(), 2U);
}

// Changes, polls and room on the bus at any time: the distance is kept, no change is lost for good, and
// nothing goes that is as it was.
RC_GTEST_PROP(TpdoTiming, InhibitAndChangesAtAnyTime, ()) {
  const auto inhibit = *rc::gen::inRange(0U, 100U);
  TpdoBench bench(wrap - *rc::gen::inRange<std::uint64_t>(0, 200'000));
  RC_ASSERT(bench.remap(0x1800, {position}, 0x185, 255, 0, inhibit) == Abort::none);
  bench.configure();
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  for (int i = 0; i < 2000; ++i) {
    bench.now_us += random() % 400;
    if (random() % 16 == 0) bench.source.live[position_slot] = random() % 4;
    bench.tpdos.poll(bench.clock());
    if (random() % 4 != 0) bench.fetch();
  }
  bench.run(20'000, 100);
  RC_ASSERT(bench.sent.back().first_value == bench.source.live[position_slot]);
  for (std::size_t i = 1; i < bench.sent.size(); ++i) {
    RC_ASSERT(bench.sent[i].time_us - bench.sent[i - 1].time_us >= 100U * inhibit);
    RC_ASSERT(bench.sent[i].first_value != bench.sent[i - 1].first_value);
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen::tpdo_timing_test
