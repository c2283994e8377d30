#include "firmware/canopen/tpdo.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <random>
#include <vector>

#include "tests/firmware/canopen/tpdo_bench.hpp"

namespace kmax::firmware::canopen::tpdo_test {
namespace {

using Identifiers = std::vector<std::uint32_t>;

TEST(Tpdo, NothingGoesBeforeTheStartOrAfterTheStop) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 1), Abort::none);
  ASSERT_EQ(bench.remap(0x1801, {position}, 0x285, 1), Abort::none);
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

TEST(Tpdo, TheDefaultsGoEachMillisecondTogetherAndInOrder) {
  TpdoBench bench;
  bench.values = {};
  bench.configure();
  bench.source.live[slot_of(entry_of<"measured.count">(), 0)] = 0x01020304;
  for (int batch = 0; batch < 5; ++batch) {
    bench.run(batch == 0 ? 975 : 1000, 25);  // up to just before the next one
    EXPECT_EQ(bench.source.refreshes, batch + 1);
    EXPECT_EQ(bench.identifiers(), (Identifiers{0x185, 0x285, 0x385, 0x485}));
    EXPECT_EQ(bench.sent[0].first_value, 0x01020304U);
    EXPECT_EQ(bench.sent[0].length, 8);
    bench.sent.clear();
  }
  EXPECT_EQ(bench.tpdos.counters().sent, 20U);
  EXPECT_EQ(bench.tpdos.counters().held_back, 0U);
}

// The readings may go on while a batch waits for the bus.
TEST(Tpdo, ABatchIsOfOneMoment) {
  TpdoBench bench;
  for (std::uint16_t n = 0; n < 4; ++n)
    ASSERT_EQ(bench.remap(static_cast<std::uint16_t>(0x1800 + n), {position}, 0x333U + n, 255, 1),
              Abort::none);
  bench.configure();
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
  TpdoBench bench;
  for (std::uint16_t n = 0; n < 3; ++n) {
    ASSERT_EQ(
        bench.remap(static_cast<std::uint16_t>(0x1800 + n), {position}, 0x333U + n, 255, n < 2 ? 10 : 1),
        Abort::none);
  }
  bench.configure();
  bench.tpdos.poll(bench.clock());
  bench.source.live[position_slot] = 1;
  ASSERT_TRUE(bench.fetch());
  bench.source.live[position_slot] = 2;
  bench.now_us += 1000;
  bench.tpdos.poll(bench.clock());
  bench.fetch_all();
  EXPECT_EQ(bench.identifiers(), (Identifiers{0x333, 0x334, 0x335}));
  EXPECT_EQ(bench.sent[1].first_value, 1U);
  EXPECT_EQ(bench.sent[2].first_value, 2U);
}

TEST(Tpdo, WhatIsDueAgainBeforeItWasFetchedGoesOnceWithNewerValues) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255, 1), Abort::none);
  ASSERT_EQ(bench.remap(0x1801, {position}, 0x285, 255, 1), Abort::none);
  bench.configure();
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
  TpdoBench bench;
  for (std::uint16_t n = 0; n < 4; ++n)
    ASSERT_EQ(bench.remap(static_cast<std::uint16_t>(0x1800 + n), {position}, 0x333U + n, 255, 1),
              Abort::none);
  bench.configure();
  for (int i = 0; i < 400; ++i) {
    bench.tpdos.poll(bench.clock());
    bench.fetch();
    bench.now_us += 1000;
  }
  std::array<int, 4> counts{};
  for (const std::uint32_t id : bench.identifiers()) ++counts.at(id - 0x333);
  EXPECT_EQ(counts, (std::array{100, 100, 100, 100}));
  // Of 1600 that were due, 400 went and 3 wait.
  EXPECT_EQ(bench.tpdos.counters().held_back, 1600U - 400 - 3);
}

TEST(Tpdo, ABatchThatEndedEarlyDoesNotTurnTheOrderOfTheNextOne) {
  TpdoBench bench;
  for (std::uint16_t n = 0; n < 4; ++n) {
    ASSERT_EQ(bench.remap(static_cast<std::uint16_t>(0x1800 + n), {position}, 0x333U + n, 255, n < 2 ? 1 : 2),
              Abort::none);
  }
  bench.configure();
  for (int i = 0; i < 10; ++i) {
    bench.tpdos.poll(bench.clock());
    for (int n = 0; n < (i % 2 == 0 ? 4 : 2); ++n) ASSERT_TRUE(bench.fetch());  // not once more
    bench.now_us += 1000;
  }
  const Identifiers two_batches{0x333, 0x334, 0x335, 0x336, 0x333, 0x334};
  for (std::size_t i = 0; i < bench.sent.size(); ++i) EXPECT_EQ(bench.sent[i].identifier, two_batches[i % 6]);
}

TEST(Tpdo, CyclicSynchronousOnesGoAtEveryNthSync) {
  for (std::uint32_t n = 1; n <= 240; ++n) {
    TpdoBench bench;
    ASSERT_EQ(bench.remap(0x1802, {position}, 0x385, n, 1), Abort::none);
    bench.configure();
    for (std::uint32_t syncs = 1; syncs <= 3 * n + 1; ++syncs) {
      bench.step(1000);
      bench.sync();
      ASSERT_EQ(bench.sent.size(), syncs / n) << n;
    }
  }
}

TEST(Tpdo, EachSyncIsReadAnewAndOneThatWasMissedIsCounted) {
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 1), Abort::none);
  ASSERT_EQ(bench.remap(0x1801, {position}, 0x285, 2), Abort::none);
  bench.configure();
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
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 0, 1, 1000), Abort::none);
  bench.configure();
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
  TpdoBench bench;
  ASSERT_EQ(bench.remap(0x1800, {position}, 0x185, 255), Abort::none);
  ASSERT_EQ(bench.remap(0x1801, {position}, 0x285, 255), Abort::none);
  bench.configure();
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
  EXPECT_EQ(bench.identifiers(), (Identifiers{0x185, 0x385, 0x485}));
  EXPECT_EQ(bench.tpdos.counters().left_out, 1U);
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

}  // namespace
}  // namespace kmax::firmware::canopen::tpdo_test
