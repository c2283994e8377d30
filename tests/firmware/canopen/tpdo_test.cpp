#include "firmware/canopen/tpdo.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <initializer_list>
#include <iomanip>
#include <iterator>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/firmware/canopen/communication_writes.hpp"

namespace kmax::firmware::canopen::tpdo_test {
namespace {

constexpr std::uint32_t position = mapping_of(0x2012, 2, 32);
const std::size_t position_slot = slot_of(entry_of<"measured.position">(), 0);

/// Values that change at any time, and are shown as of the latest refresh().
struct TestSource {
  void refresh() {
    ++refreshes;
    shown = live;
  }
  std::uint32_t value(std::size_t slot) const { return shown.at(slot); }

  std::array<std::uint32_t, slot_count> live{};
  std::array<std::uint32_t, slot_count> shown{};
  int refreshes = 0;
};

struct SentPdo {
  std::uint64_t time_us;
  std::uint32_t identifier;
  std::uint32_t first_value;  ///< of 32 bits
  std::uint8_t length;
};

struct Setting {
  std::uint32_t type = 255, event_ms = 0, inhibit_100us = 0;
};
constexpr Setting each_ms{.event_ms = 1};

std::uint32_t identifier_of(std::size_t n) {
  return static_cast<std::uint32_t>(0x185 + 0x100 * n);
}

/// PDOs, their settings, and virtual time in 64 bits of which they see 32.
struct TpdoBench : CommunicationWrites {
  /// The PDOs with these settings exist and hold `position`.
  explicit TpdoBench(std::initializer_list<Setting> settings = {}, std::uint64_t start_us = 0)
      : now_us(start_us) {
    for (std::size_t n = 0; n < tpdo_count; ++n) write(communication(n), 1, bit_31 | 0x222);
    for (const Setting& setting : settings) add(setting);
    if (settings.size() != 0) configure();
  }
  /// One more, with the next number.
  void add(const Setting& with) {
    EXPECT_EQ(remap(communication(added), {position}, identifier_of(added), with.type, with.event_ms,
                    with.inhibit_100us),
              Abort::none);
    ++added;
  }
  static std::uint16_t communication(std::size_t n) { return static_cast<std::uint16_t>(0x1800 + n); }

  void configure() { tpdos.configure(values, test_node_id, bit_rate, clock()); }
  std::uint32_t clock() const { return static_cast<std::uint32_t>(now_us); }

  bool fetch() {
    drivers::CanFrame frame;
    if (!tpdos.next_frame(frame, source, clock())) return false;
    std::uint32_t first = 0;
    for (unsigned i = 0; i < 4; ++i) first |= std::uint32_t{frame.data[i]} << 8 * i;
    sent.push_back({now_us, frame.identifier, first, frame.length});
    return true;
  }
  void fetch_all() {
    while (fetch()) {
    }
  }
  void step(std::uint64_t us) {
    now_us += us;
    tpdos.poll(clock());
    fetch_all();
  }
  void run(std::uint64_t us, std::uint64_t poll_us) {
    for (const std::uint64_t end = now_us + us; now_us < end;) step(poll_us);
  }
  void sync() {
    tpdos.on_sync();
    fetch_all();
  }
  std::vector<std::uint32_t> identifiers() const {
    std::vector<std::uint32_t> all;
    for (const SentPdo& pdo : sent) all.push_back(pdo.identifier);
    return all;
  }

  Tpdos tpdos;
  TestSource source;
  std::vector<SentPdo> sent;
  std::uint64_t now_us;
  std::uint32_t bit_rate = 1'000'000;
  std::size_t added = 0;
};

using Identifiers = std::vector<std::uint32_t>;

TEST(Tpdo, NothingGoesBeforeTheStartOrAfterTheStop) {
  TpdoBench bench;
  bench.add(each_ms);
  bench.add({.type = 1});
  bench.run(10'000, 50);
  bench.sync();
  EXPECT_TRUE(bench.sent.empty());
  bench.configure();
  bench.tpdos.poll(bench.clock());
  bench.tpdos.on_sync();
  ASSERT_TRUE(bench.fetch());
  bench.tpdos.stop();
  bench.run(10'000, 50);
  bench.sync();
  EXPECT_EQ(bench.sent.size(), 1U);
}

TEST(Tpdo, TheDefaultsGoEveryTenMillisecondsTogetherAndInOrder) {
  TpdoBench bench;
  bench.values = {};
  bench.write(0x1804, 1, bit_31);
  bench.configure();
  bench.source.live[slot_of(entry_of<"measured.count">(), 0)] = 0x01020304;
  for (int batch = 0; batch < 5; ++batch) {
    bench.run(batch == 0 ? 9975 : 10'000, 25);  // up to just before the next one
    EXPECT_EQ(bench.source.refreshes, batch + 1);
    EXPECT_EQ(bench.identifiers(), (Identifiers{0x185, 0x285, 0x385, 0x485}));
    EXPECT_EQ(bench.sent[0].first_value, 0x01020304U);
    EXPECT_EQ(bench.sent[0].length, 8);
    bench.sent.clear();
  }
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
}

// The states of both axes: at once, and then not too often.
TEST(Tpdo, ByDefaultTheStatesGoWhenTheyChange) {
  TpdoBench bench;
  bench.values = {};
  for (std::uint16_t n = 0; n < 4; ++n) bench.write(static_cast<std::uint16_t>(0x1800 + n), 1, bit_31);
  bench.configure();
  auto& statusword = bench.source.live[slot_of(entry_of<"drive.statusword">(), 1)];
  bench.source.live[slot_of(entry_of<"profile.operation_mode_display">(), 0)] = 0xFFFF'FFFF;
  bench.run(100'000, 50);
  ASSERT_EQ(bench.sent.size(), 1U) << "once, whatever they are";
  EXPECT_EQ(bench.sent[0].identifier, 0x505U);
  EXPECT_EQ(bench.sent[0].length, 6);
  EXPECT_EQ(bench.sent[0].first_value, 0x00FF'0000U) << "statusword and mode of axis 0, statusword of axis 1";
  const std::uint64_t changed_us = bench.now_us;
  statusword = 0x27;
  bench.run(5'000, 50);
  statusword = 0x08;
  bench.run(100'000, 50);
  ASSERT_EQ(bench.sent.size(), 3U);
  EXPECT_LE(bench.sent[1].time_us, changed_us + 1050);
  EXPECT_EQ(bench.sent[1].first_value, 0x27FF'0000U);
  EXPECT_EQ(bench.sent[2].time_us - bench.sent[1].time_us, 20'000U);
  EXPECT_EQ(bench.sent[2].first_value, 0x08FF'0000U);
}

// What nobody has asked for leaves the bus to others, as docs/canopen.md says.
TEST(Tpdo, TheDefaultsLeaveMostOfTheBusFree) {
  std::ifstream page("../docs/canopen.md");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  for (const auto& [bit_rate, most_percent] :
       {std::pair{1'000'000U, 15.0}, {500'000U, 15.0}, {250'000U, 25.0}, {125'000U, 50.0}}) {
    TpdoBench bench;
    bench.values = {};
    bench.bit_rate = bit_rate;
    bench.configure();
    while (bench.now_us < 1'000'000 - 50) {
      ++bench.source.live[slot_of(entry_of<"drive.statusword">(), 0)];  // as often as it can
      bench.step(50);
    }
    std::uint32_t bits = 0;
    for (const SentPdo& pdo : bench.sent) {
      const std::uint32_t data = 8U * pdo.length;
      bits += data + 47 + (data + 33) / 4;  // with all stuff bits that there can be, and the pause after it
    }
    const double percent = 100.0 * bits / bit_rate;
    EXPECT_LT(percent, most_percent) << bit_rate;
    std::ostringstream row;
    row << "\n| " << bit_rate / 1000 << " kbit/s | " << bench.sent.size() << " | " << std::fixed
        << std::setprecision(1) << percent << " % |";
    EXPECT_NE(text.find(row.str()), std::string::npos) << "missing in docs/canopen.md:" << row.str();
  }
}

// The readings may go on while a batch waits for the bus.
TEST(Tpdo, ABatchIsOfOneMoment) {
  TpdoBench bench({each_ms, each_ms, each_ms, each_ms});
  for (std::uint32_t batch = 0; batch < 20; ++batch) {
    bench.tpdos.poll(bench.clock());
    for (std::uint32_t i = 0; i < 4; ++i) {
      bench.source.live[position_slot] = 100 * batch + i;
      bench.now_us += 100;
      bench.tpdos.poll(bench.clock());
      ASSERT_TRUE(bench.fetch());
      bench.source.refresh();  // by somebody else
      EXPECT_EQ(bench.sent.back().first_value, 100 * batch);
    }
    EXPECT_FALSE(bench.fetch());
    bench.now_us += 600;
  }
}

// A batch that is half gone stays of its moment when another PDO becomes due.
TEST(Tpdo, ABatchStaysOfItsMomentWhenANewOneBegins) {
  TpdoBench bench({{.event_ms = 10}, {.event_ms = 10}, each_ms});
  bench.tpdos.poll(bench.clock());
  bench.source.live[position_slot] = 1;
  ASSERT_TRUE(bench.fetch());
  bench.source.live[position_slot] = 2;
  bench.now_us += 1000;
  bench.tpdos.poll(bench.clock());
  bench.fetch_all();
  EXPECT_EQ(bench.identifiers(), (Identifiers{0x185, 0x285, 0x385}));
  EXPECT_EQ(bench.sent[1].first_value, 1U);
  EXPECT_EQ(bench.sent[2].first_value, 2U);
}

TEST(Tpdo, WhatIsDueAgainBeforeItWasFetchedGoesOnceWithNewerValues) {
  TpdoBench bench({each_ms, each_ms});
  bench.tpdos.poll(bench.clock());
  bench.source.live[position_slot] = 1;
  ASSERT_TRUE(bench.fetch());  // the first of two
  for (int i = 0; i < 3; ++i) {
    bench.now_us += 1000;
    bench.tpdos.poll(bench.clock());
  }
  bench.source.live[position_slot] = 2;
  bench.fetch_all();
  EXPECT_EQ(bench.identifiers(), (Identifiers{0x185, 0x285, 0x185}));  // goes on where it was
  EXPECT_EQ(bench.sent[1].first_value, 2U);
  EXPECT_EQ(bench.sent[2].first_value, 2U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 2U + 3U);
  bench.step(1000);
  EXPECT_EQ(bench.sent[3].identifier, 0x185U);
}

TEST(Tpdo, OnAFullBusEachGetsItsTurn) {
  TpdoBench bench({each_ms, each_ms, each_ms, each_ms});
  for (int i = 0; i < 400; ++i) {
    bench.tpdos.poll(bench.clock());
    bench.fetch();
    bench.now_us += 1000;
  }
  std::array<int, 4> counts{};
  for (const std::uint32_t id : bench.identifiers()) ++counts.at(id / 0x100 - 1);
  EXPECT_EQ(counts, (std::array{100, 100, 100, 100}));
  // Of 1600 that were due, 400 went and 3 wait.
  EXPECT_EQ(bench.tpdos.counters().held_back, 1600U - 400 - 3);
}

TEST(Tpdo, ABatchThatEndedEarlyDoesNotTurnTheOrderOfTheNextOne) {
  TpdoBench bench({each_ms, each_ms, {.event_ms = 2}, {.event_ms = 2}});
  for (int i = 0; i < 10; ++i) {
    bench.tpdos.poll(bench.clock());
    for (int n = 0; n < (i % 2 == 0 ? 4 : 2); ++n) ASSERT_TRUE(bench.fetch());  // not once more
    bench.now_us += 1000;
  }
  const Identifiers two_batches{0x185, 0x285, 0x385, 0x485, 0x185, 0x285};
  for (std::size_t i = 0; i < bench.sent.size(); ++i) EXPECT_EQ(bench.sent[i].identifier, two_batches[i % 6]);
}

TEST(Tpdo, CyclicSynchronousOnesGoAtEveryNthSync) {
  for (std::uint32_t n = 1; n <= 240; ++n) {
    TpdoBench bench({{.type = n, .event_ms = 1}});
    for (std::uint32_t syncs = 1; syncs <= 3 * n + 1; ++syncs) {
      bench.step(1000);
      bench.sync();
      ASSERT_EQ(bench.sent.size(), syncs / n) << n;
    }
  }
}

TEST(Tpdo, EachSyncIsReadAnewAndOneThatWasMissedIsCounted) {
  TpdoBench bench({{.type = 1}, {.type = 2}});
  for (std::uint32_t i = 1; i <= 4; ++i) {
    bench.source.live[position_slot] = i;
    bench.sync();
  }
  EXPECT_EQ(bench.identifiers(), (Identifiers{0x185, 0x185, 0x285, 0x185, 0x185, 0x285}));
  EXPECT_EQ(bench.sent[1].first_value, 2U);
  EXPECT_EQ(bench.sent[2].first_value, 2U);
  EXPECT_EQ(bench.source.refreshes, 4);
  bench.tpdos.on_sync();
  bench.sync();
  EXPECT_EQ(bench.tpdos.counters().held_back, 1U);
  EXPECT_EQ(bench.sent.size(), 8U);
}

TEST(Tpdo, AcyclicSynchronousOnesGoAtASyncAfterAChange) {
  TpdoBench bench({{.type = 0, .event_ms = 1, .inhibit_100us = 1000}});
  bench.run(10'000, 100);
  EXPECT_TRUE(bench.sent.empty());
  bench.sync();  // nothing is known of it yet
  EXPECT_EQ(bench.sent.size(), 1U);
  for (int i = 0; i < 5; ++i) bench.sync();
  EXPECT_EQ(bench.sent.size(), 1U);
  bench.source.live[position_slot] = 7;
  bench.run(10'000, 100);
  EXPECT_EQ(bench.sent.size(), 1U);
  bench.sync();  // an inhibit time is for the types 254 and 255 only
  ASSERT_EQ(bench.sent.size(), 2U);
  EXPECT_EQ(bench.sent[1].first_value, 7U);
  bench.sync();
  EXPECT_EQ(bench.sent.size(), 2U);
  bench.source.live[position_slot] = 8;
  bench.sync();
  EXPECT_EQ(bench.sent.size(), 3U);
}

TEST(Tpdo, WithoutEventTimeItGoesAtAChangeOfWhatIsMapped) {
  for (const std::uint32_t type : {254U, 255U}) {
    TpdoBench bench;
    ASSERT_EQ(bench.remap(0x1800, {mapping_of(0x6041, 0, 16), mapping_of(0x6061, 0, 8)}, 0x185, type),
              Abort::none);
    bench.configure();
    bench.run(19'950, 50);
    EXPECT_EQ(bench.sent.size(), 1U);
    EXPECT_EQ(bench.sent[0].length, 3);
    EXPECT_EQ(bench.source.refreshes, 20);  // every millisecond, not every poll
    bench.source.live[position_slot] = 1;   // not mapped
    bench.source.live[slot_of(entry_of<"drive.statusword">(), 0)] = 0x10000;  // beyond its 16 bits
    bench.run(5000, 50);
    EXPECT_EQ(bench.sent.size(), 1U);
    bench.source.live[slot_of(entry_of<"profile.operation_mode_display">(), 0)] = 0xFFFFFFFF;
    bench.run(5000, 50);
    ASSERT_EQ(bench.sent.size(), 2U);
    EXPECT_EQ(bench.sent[1].first_value, 0xFF0000U);
    bench.sync();
    EXPECT_EQ(bench.sent.size(), 2U);
  }
}

TEST(Tpdo, AChangeThatWaitsForTheBusIsNotForgottenAndGoesWithTheNewestValue) {
  TpdoBench bench({{}, {}});
  bench.step(0);
  bench.sent.clear();
  bench.source.live[position_slot] = 1;
  bench.now_us += 1000;
  bench.tpdos.poll(bench.clock());
  ASSERT_TRUE(bench.fetch());  // both have been found changed
  bench.source.live[position_slot] = 0;
  bench.now_us += 1000;
  bench.tpdos.poll(bench.clock());
  bench.fetch_all();
  EXPECT_EQ(bench.identifiers(), (Identifiers{0x185, 0x285, 0x185}));
  EXPECT_EQ(bench.sent[1].first_value, 0U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 1U);
}

TEST(Tpdo, APdoWithBrokenSettingsIsLeftOutTheOthersGo) {
  TpdoBench bench;
  bench.values = {};
  bench.values.set_whole<"tpdo2.mapped_count">(9);
  bench.configure();
  bench.step(0);
  EXPECT_EQ(bench.identifiers(), (Identifiers{0x185, 0x385, 0x485, 0x505}));
}

RC_GTEST_PROP(Tpdo, PacksTheValuesOneAfterTheOther, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  std::vector<std::uint32_t> objects;
  std::vector<std::uint8_t> bytes;
  TpdoBench bench;
  for (;;) {
    const std::size_t slot = random() % slot_count;
    const auto [e, axis] = owner_of(slot);
    const Entry& entry = entry_at(e);
    if (!tpdo_mappable(entry)) continue;
    const unsigned size = bytes_of(entry.type);
    if (bytes.size() + size > 8) break;
    objects.push_back(mapping_of(static_cast<std::uint16_t>(entry.index() + axis_index_offset * axis),
                                 entry.object_subindex(), 8 * size));
    bench.source.live[slot] = static_cast<std::uint32_t>(random());
    for (unsigned i = 0; i < size; ++i)
      bytes.push_back(static_cast<std::uint8_t>(bench.source.live[slot] >> 8 * i));
    // a slot may be drawn twice: its bytes are then those of its latest value
    for (std::size_t at = 0, o = 0; o < objects.size(); ++o) {
      const unsigned length = (objects[o] & 0xFF) / 8;
      if (objects[o] == objects.back()) {
        for (unsigned i = 0; i < length; ++i)
          bytes[at + i] = static_cast<std::uint8_t>(bench.source.live[slot] >> 8 * i);
      }
      at += length;
    }
  }
  RC_PRE(!objects.empty());
  RC_ASSERT(bench.remap(0x1803, objects, 0x485, 255, 1) == Abort::none);
  bench.configure();
  bench.tpdos.poll(bench.clock());
  drivers::CanFrame frame, expected{.identifier = 0x485, .length = static_cast<std::uint8_t>(bytes.size())};
  std::copy(bytes.begin(), bytes.end(), expected.data.begin());
  RC_ASSERT(bench.tpdos.next_frame(frame, bench.source, bench.clock()));
  RC_ASSERT(frame == expected);
}

constexpr std::uint64_t wrap = std::uint64_t{1} << 32;
constexpr std::uint64_t day = 86'400'000'000;

// Frames on the grid start + k period, each within `late_us` of its time, none left out or twice.
void expect_grid(const TpdoBench& bench, std::size_t n, std::uint64_t start_us, std::uint64_t period_us,
                 std::uint64_t late_us) {
  std::uint64_t due = start_us;
  for (const SentPdo& pdo : bench.sent) {
    if (pdo.identifier != identifier_of(n)) continue;
    ASSERT_GE(pdo.time_us, due);
    ASSERT_LE(pdo.time_us, due + late_us);
    due += period_us;
  }
  EXPECT_GT(due, bench.now_us - period_us);
  EXPECT_LE(due, bench.now_us + period_us);
}

TEST(Tpdo, DaysOfJitteredPollsDoNotMoveTheGrid) {
  const std::uint64_t start = wrap - 12'345;
  TpdoBench bench({{.event_ms = 1000},
                   {.type = 254, .event_ms = 1000},
                   {.type = 254, .event_ms = 65535},
                   {.type = 254, .event_ms = 300}},
                  start);
  std::minstd_rand random(1);
  std::uniform_int_distribution<std::uint64_t> jitter(1, 100'000);
  bench.step(0);
  while (bench.now_us < start + 2 * day) bench.step(jitter(random));
  expect_grid(bench, 0, start, 1'000'000, 100'000);
  expect_grid(bench, 1, start, 1'000'000, 100'000);
  expect_grid(bench, 2, start, 65'535'000, 100'000);
  expect_grid(bench, 3, start, 300'000, 100'000);
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
  for (std::size_t i = 0; i + 1 < bench.sent.size(); ++i) {
    if (bench.sent[i].identifier != 0x185) continue;
    ASSERT_EQ(bench.sent[i + 1].identifier, 0x285U);
    ASSERT_EQ(bench.sent[i + 1].time_us, bench.sent[i].time_us);
  }
}

TEST(Tpdo, EachMillisecondAcrossTheWrap) {
  const std::uint64_t start = wrap - 3'000'000;
  TpdoBench bench({each_ms, each_ms, each_ms, each_ms}, start);
  std::minstd_rand random(2);
  std::uniform_int_distribution<std::uint64_t> jitter(20, 300);
  bench.step(0);
  while (bench.now_us < wrap + 3'000'000) bench.step(jitter(random));
  for (std::size_t n = 0; n < 4; ++n) expect_grid(bench, n, start, 1000, 300);
  EXPECT_EQ(static_cast<std::size_t>(bench.source.refreshes), bench.sent.size() / 4);
}

TEST(Tpdo, ALatePollSendsOnceCountsTheMissedAndKeepsTheGrid) {
  TpdoBench bench({each_ms}, wrap - 50'000);
  const std::uint64_t start = bench.now_us;
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

TEST(Tpdo, ABusyBusDoesNotMoveTheGrid) {
  TpdoBench bench({each_ms});
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

TEST(Tpdo, TheEventTimeLeavesRoomOnASlowerBus) {
  const std::vector<std::pair<std::uint32_t, std::uint64_t>> least{{1'000'000, 1000}, {800'000, 1250},
                                                                   {500'000, 2000},   {250'000, 4000},
                                                                   {125'000, 8000},   {10'000, 100'000}};
  for (const auto& [bit_rate, period_us] : least) {
    for (const std::uint32_t event_ms : {1U, 3U, 0U}) {
      TpdoBench bench;
      bench.bit_rate = bit_rate;
      bench.add({.event_ms = event_ms});
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

TEST(Tpdo, AChangeOfOnePdoLeavesTheOthersAndJoinsTheirGrid) {
  TpdoBench bench({{.event_ms = 10}, {.event_ms = 10}, {.event_ms = 10}}, 777);
  bench.run(33'333, 1);
  bench.sent.clear();
  ASSERT_EQ(bench.write(0x1801, 2, 254), Abort::none);  // its settings: another, the same period
  ASSERT_EQ(bench.write(0x1802, 5, 5), Abort::none);    // half the period
  bench.add({.event_ms = 20});
  bench.configure();
  const std::uint64_t changed = bench.now_us;
  bench.run(45'000, 1);
  for (unsigned n = 0; n < 4; ++n) {
    const std::uint64_t period = n == 2 ? 5000 : n == 3 ? 20'000 : 10'000;
    std::vector<std::uint64_t> times;
    for (const SentPdo& pdo : bench.sent) {
      if (pdo.identifier == identifier_of(n)) times.push_back(pdo.time_us);
    }
    ASSERT_GE(times.size(), 2U) << n;
    EXPECT_EQ((times[0] - 777) % (n == 2 ? 5000 : 10'000), 0U) << n;  // on the grid
    EXPECT_LE(times[0], changed + period) << n;
    for (std::size_t i = 1; i < times.size(); ++i) EXPECT_EQ(times[i] - times[i - 1], period) << n;
  }
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
}

TEST(Tpdo, AFastOneThatJoinsASlowOneDoesNotWaitForIt) {
  TpdoBench bench({{.event_ms = 60'000}});
  bench.run(1'000'300, 100);
  bench.add(each_ms);
  bench.configure();
  bench.run(1000, 100);
  ASSERT_EQ(bench.sent.size(), 2U);
  EXPECT_EQ(bench.sent[1].time_us, 1'001'000U);
}

TEST(Tpdo, TheSameSettingsAgainDisturbNothing) {
  TpdoBench bench({each_ms, {.type = 3}});
  for (int i = 0; i < 3000; ++i) {
    bench.configure();
    bench.step(10);
    if (i % 100 == 99) bench.sync();
  }
  EXPECT_EQ(
      std::count_if(bench.sent.begin(), bench.sent.end(), [](auto& p) { return p.identifier == 0x285; }), 10);
  EXPECT_EQ(bench.sent.size(), 10U + 31U);
}

TEST(Tpdo, TheInhibitTimeDelaysAndKeepsTheLatestValue) {
  TpdoBench bench({{.inhibit_100us = 100}}, wrap - 12'000);  // 10 ms
  const std::uint64_t start = bench.now_us;
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

TEST(Tpdo, AnInhibitTimeLongerThanTheEventTimeThinsThemOut) {
  TpdoBench bench({{.event_ms = 1, .inhibit_100us = 25}});  // 2.5 ms
  bench.run(100'000, 20);
  for (std::size_t i = 1; i < bench.sent.size(); ++i)
    EXPECT_GE(bench.sent[i].time_us - bench.sent[i - 1].time_us, 2500U);
  EXPECT_GE(bench.sent.size(), 39U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);  // as it was asked for
}

TEST(Tpdo, ALatePollWithinTheInhibitTimeMissesNothing) {
  TpdoBench bench({{.event_ms = 1, .inhibit_100us = 500}});  // 50 ms
  bench.step(0);
  bench.step(20'500);
  EXPECT_EQ(bench.sent.size(), 1U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
}

TEST(Tpdo, AnInhibitTimeOutlivesAChangeOfTheType) {
  TpdoBench bench({{.inhibit_100us = 100}});
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
RC_GTEST_PROP(Tpdo, InhibitAndChangesAtAnyTime, ()) {
  const auto inhibit = *rc::gen::inRange(0U, 100U);
  TpdoBench bench({{.inhibit_100us = inhibit}}, wrap - *rc::gen::inRange<std::uint64_t>(0, 200'000));
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
}  // namespace kmax::firmware::canopen::tpdo_test
