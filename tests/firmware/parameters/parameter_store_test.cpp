#include "firmware/parameters/parameter_store.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"

#include <gtest/gtest.h>

#include <rapidcheck.h>

#include "tests/firmware/fake_flash.hpp"

namespace kmax::firmware::parameter_store_test {
namespace {

constexpr std::size_t stride = record::aligned_up(Store::length);
constexpr std::size_t saves_per_sector = (FakeFlash::words_per_sector + stride - Store::length) / stride;

// What is in a device's flash was written by an earlier firmware.
TEST(ParameterRecord, BeginsWhereEarlierFirmwareBeganIt) {
  EXPECT_EQ(record::aligned_up(0), 0U);
  EXPECT_EQ(record::aligned_up(1), 16U);
  EXPECT_EQ(record::aligned_up(16), 16U);
  EXPECT_EQ(record::aligned_up(17), 32U);
  EXPECT_EQ(record::length_of(3), 13U);
}

TEST(ParameterStore, AnErasedMemoryHoldsNothing) {
  FakeFlash flash;
  Store store(flash);
  ParameterValues values = some_values(1);
  EXPECT_FALSE(store.load(values).found);
  EXPECT_EQ(persistent_part(values), persistent_part(some_values(1)));
  const StoreSurvey found = store.survey();
  EXPECT_FALSE(found.newest);
  EXPECT_EQ(found.damaged, 0);
  EXPECT_EQ(found.next_sequence, 1u);
  EXPECT_EQ(store.free_saves(found), saves_per_sector);
}

TEST(ParameterStore, WhatIsSavedIsLoaded) {
  FakeFlash flash;
  Store store(flash);
  for (std::uint32_t k = 1; k <= 3 * saves_per_sector; ++k) {
    ASSERT_EQ(save(store, some_values(k)), SaveProgress::done);
    LoadReport report;
    ASSERT_EQ(loaded(flash, &report), persistent_part(some_values(k))) << k;
    EXPECT_TRUE(report.found);
    EXPECT_FALSE(report.other_dictionary);
    EXPECT_EQ(report.header.sequence, k);
    EXPECT_EQ(report.header.count, persistent_count);
    EXPECT_EQ(report.migration.dropped + report.migration.defaulted, 0);
  }
  EXPECT_EQ(flash.programmed_twice, 0);
  EXPECT_EQ(store.write_errors(), 0u);
}

TEST(ParameterStore, NothingButThePersistentPartChangesWhenLoading) {
  FakeFlash flash;
  Store store(flash);
  ASSERT_EQ(save(store, some_values(1)), SaveProgress::done);
  ParameterValues values;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    if (!entry_at(owner_of(slot).entry).persistent)
      values.set_raw(slot, 0xABCD'0000U + static_cast<std::uint32_t>(slot));
  }
  store.load(values);
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const bool persistent = entry_at(owner_of(slot).entry).persistent;
    EXPECT_EQ(values.raw(slot), persistent ? some_values(1).raw(slot) : 0xABCD'0000U + slot);
  }
}

TEST(ParameterStore, ASectorIsErasedOnlyWhenTheOtherIsFullAndIsCounted) {
  FakeFlash flash;
  Store store(flash);
  int erases = 0;
  flash.before_erase = [&](std::size_t sector) {
    const auto newest = Store(flash).survey().newest;
    ASSERT_TRUE(newest);
    EXPECT_NE(newest->sector, sector);
  };
  for (std::uint32_t k = 1; k <= 5 * saves_per_sector; ++k) {
    const bool full = store.free_saves(store.survey()) == 0;
    ASSERT_EQ(save(store, some_values(k)), SaveProgress::done);
    erases += full ? 1 : 0;
    ASSERT_EQ(flash.erases, erases) << k;
    EXPECT_EQ(full, k > 1 && (k - 1) % saves_per_sector == 0) << k;
    EXPECT_EQ(store.survey().erases, static_cast<std::uint32_t>(erases));
  }
  EXPECT_EQ(erases, 4);
  // A firmware that restarts goes on counting.
  Store after(flash);
  for (std::uint32_t k = 0; k < saves_per_sector; ++k)
    ASSERT_EQ(save(after, some_values(k)), SaveProgress::done);
  EXPECT_EQ(after.survey().erases, 5u);
}

TEST(ParameterStore, TheSetIsTheOneGivenToBegin) {
  FakeFlash flash;
  Store store(flash);
  ParameterValues values = some_values(1);
  store.begin(values);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(store.step(), SaveProgress::busy);
  values = some_values(2);
  while (store.step() == SaveProgress::busy) {
  }
  EXPECT_EQ(loaded(flash), persistent_part(some_values(1)));
}

TEST(ParameterStore, ASaveGivenUpHalfWayDoesNoHarm) {
  FakeFlash flash;
  Store store(flash);
  ASSERT_EQ(save(store, some_values(1)), SaveProgress::done);
  store.begin(some_values(2));
  for (int i = 0; i < 50; ++i) store.step();
  EXPECT_EQ(loaded(flash), persistent_part(some_values(1)));
  ASSERT_EQ(save(store, some_values(3)), SaveProgress::done);
  EXPECT_EQ(loaded(flash), persistent_part(some_values(3)));
  EXPECT_EQ(store.survey().damaged, 1);
}

/// One valid record, as some firmware may have left it.
void put_record(FakeFlash& flash, std::size_t sector, std::size_t word, record::Header header,
                const PersistentValues& values) {
  Crc32 crc;
  const auto put = [&](std::uint32_t value) {
    flash.words[sector][word++] = value;
    crc.add(value);
  };
  header.count = persistent_count;
  for (std::size_t i = 0; i < record::header_words; ++i) put(header.word(i));
  for (std::size_t i = 0; i < persistent_count; ++i) put(persistent_identity(i)), put(values[i]);
  flash.words[sector][word] = crc.value();
  flash.words[sector][word + 1] = record::commit;
}

// What lies in the flash of a device outlives the firmware that wrote it.
TEST(ParameterStore, TheWordsOfARecordAreWhatItsFormatSays) {
  FakeFlash flash;
  Store store(flash);
  const ParameterValues values = some_values(7);
  ASSERT_EQ(save(store, values), SaveProgress::done);
  const auto& words = flash.words[0];
  std::vector<std::uint32_t> expected{0x4B4D'5032 /* KMP2 */, 1, dictionary_checksum, 0, persistent_count};
  for (std::size_t i = 0; i < persistent_count; ++i)
    expected.insert(expected.end(), {persistent_identity(i), persistent_part(values)[i]});
  Crc32 crc;
  for (const std::uint32_t word : expected) crc.add(word);
  expected.insert(expected.end(), {crc.value(), 0, 0xFFFF'FFFF});
  ASSERT_LE(expected.size(), words.size());
  for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_EQ(words[i], expected[i]) << "word " << i;
}

TEST(ParameterStore, SequenceWraps) {
  FakeFlash flash;
  put_record(flash, 1, 0, {0xFFFF'FFFDU, dictionary_checksum, 7, 0}, persistent_part(some_values(99)));
  Store store(flash);
  std::uint32_t expected = 0xFFFF'FFFDU;
  for (std::uint32_t k = 0; k < 2 * saves_per_sector; ++k) {
    ASSERT_EQ(save(store, some_values(k)), SaveProgress::done);
    LoadReport report;
    ASSERT_EQ(loaded(flash, &report), persistent_part(some_values(k))) << k;
    EXPECT_EQ(report.header.sequence, ++expected);
  }
  EXPECT_EQ(expected, 2 * saves_per_sector - 3);
}

TEST(ParameterStore, TheNewestOfBothSectorsCountsWhereverItStands) {
  for (const std::size_t newer : {0u, 1u}) {
    FakeFlash flash;
    put_record(flash, 1 - newer, 0, {41, dictionary_checksum, 0, 0}, persistent_part(some_values(1)));
    put_record(flash, newer, 2 * stride, {42, dictionary_checksum, 0, 0}, persistent_part(some_values(2)));
    EXPECT_EQ(loaded(flash), persistent_part(some_values(2)));
  }
}

// Hard: every single bit of the newest record, and of what surrounds it.
TEST(ParameterStore, ASingleFlippedBitAnywhereIsFoundAndTheSetBeforeIsUsed) {
  FakeFlash flash;
  Store store(flash);
  ASSERT_EQ(save(store, some_values(1)), SaveProgress::done);
  ASSERT_EQ(save(store, some_values(2)), SaveProgress::done);
  const PersistentValues before = persistent_part(some_values(1)), newest = persistent_part(some_values(2));
  for (std::size_t word = 0; word < 3 * stride; ++word) {
    const bool in_newest = word >= stride && word < stride + Store::length;
    for (unsigned bit = 0; bit < 32; ++bit) {
      // Where nothing is lost, one bit of each word tells.
      if (!in_newest && bit != word % 32) continue;
      flash.words[0][word] ^= 1U << bit;
      LoadReport report;
      const PersistentValues found = loaded(flash, &report);
      ASSERT_EQ(found, in_newest ? before : newest) << "word " << word << " bit " << bit;
      ASSERT_EQ(report.header.sequence, in_newest ? 1u : 2u);
      flash.words[0][word] ^= 1U << bit;
    }
  }
}

TEST(ParameterStore, GarbageIsNoSetAndDoesNotHinderSaving) {
  const auto try_it = [](FakeFlash& flash, const char* what) {
    LoadReport report;
    EXPECT_EQ(loaded(flash, &report), persistent_part(ParameterValues{})) << what;
    EXPECT_FALSE(report.found) << what;
    Store store(flash);
    for (std::uint32_t k = 0; k < 3; ++k) {
      ASSERT_EQ(save(store, some_values(k)), SaveProgress::done) << what;
      ASSERT_EQ(loaded(flash), persistent_part(some_values(k))) << what;
    }
    EXPECT_EQ(flash.programmed_twice, 0) << what;
  };
  for (const std::uint32_t word : {0U, record::magic, 0xFFFF'FFFEU, 0x7FFF'FFFFU}) {
    FakeFlash flash;
    for (auto& sector : flash.words) sector.fill(word);
    try_it(flash, "one word everywhere");
  }
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    FakeFlash flash;
    std::mt19937 random(seed);
    for (auto& sector : flash.words) {
      for (std::uint32_t& word : sector) word = static_cast<std::uint32_t>(random());
      // Headers that look right, with every length that can be claimed.
      for (std::size_t w = 0; w + 5 < sector.size() && seed % 2 == 0; w += record::alignment)
        sector[w] = record::magic, sector[w + 4] = static_cast<std::uint32_t>(random()) >> (random() % 32);
    }
    try_it(flash, "random words");
  }
}

TEST(ParameterStore, LengthsAtTheEndOfASectorAreNotBelieved) {
  for (const std::uint32_t count : {0U, 1U, 2044U, 2045U, 0x7FFF'FFFFU, 0x8000'0000U, 0xFFFF'FFFEU}) {
    for (std::size_t word = 0; word < FakeFlash::words_per_sector; word += record::alignment) {
      FakeFlash flash;
      flash.words[1][word] = record::magic;
      flash.words[1][word + 4] = count;
      EXPECT_FALSE(Store(flash).survey().newest);  // FakeFlash throws on a read beyond the end
    }
  }
}

// Where the commit word alone would be the first of a new line of 16, the next record begins in its place.
// How many parameters a record has is up to the firmware that wrote it.
TEST(ParameterStore, ASetBehindARecordThatLacksOnlyItsCommitWordIsFoundWhateverTheRecordsLength) {
  for (std::uint32_t count = 0; count < record::alignment; ++count) {
    FakeFlash flash;
    const record::Header header{.sequence = 1, .schema = dictionary_checksum, .erases = 0, .count = count};
    Crc32 crc;
    const std::size_t covered = record::length_of(count) - 2;
    for (std::size_t i = 0; i < covered; ++i) {
      const std::uint32_t word = i < record::header_words ? header.word(i) : 0x1234'5678U;
      flash.program(0, i, word);
      crc.add(word);
    }
    flash.program(0, covered, crc.value());
    Store store(flash);
    ASSERT_EQ(save(store, some_values(1)), SaveProgress::done) << count;
    EXPECT_EQ(loaded(flash), persistent_part(some_values(1))) << count << " parameters";
    EXPECT_EQ(store.survey().damaged, 1) << count << " parameters";
  }
}

TEST(ParameterStore, AWordThatDoesNotTakeIsSteppedOver) {
  for (const std::size_t bad : {std::size_t{0}, std::size_t{3}, Store::length - 2, Store::length - 1}) {
    for (const std::uint32_t bits : {0xFFFF'FFFFU, 0x0000'0001U, 0x8000'0000U}) {
      FakeFlash flash;
      Store store(flash);
      ASSERT_EQ(save(store, some_values(1)), SaveProgress::done);
      flash.broken = {{0, stride + bad}};
      flash.broken_bits = bits;
      ASSERT_EQ(save(store, some_values(2)), SaveProgress::done);
      ASSERT_EQ(loaded(flash), persistent_part(some_values(2)));
      EXPECT_LE(store.write_errors(), 1u);  // 0: the bits were to stay set
      EXPECT_EQ(flash.erases, 0);
    }
  }
}

TEST(ParameterStore, AProgrammingThatSaysItFailedIsBelieved) {
  FakeFlash flash;
  Store store(flash);
  flash.refused = {{0, 7}};
  ASSERT_EQ(save(store, some_values(1)), SaveProgress::done);
  EXPECT_EQ(store.write_errors(), 1u);
  EXPECT_EQ(loaded(flash), persistent_part(some_values(1)));
}

// Programming one word changes another that had been read back already.
TEST(ParameterStore, ARecordThatChangesBehindTheWritersBackIsNotCalledSaved) {
  for (const auto& [late, changed] : {std::pair{Store::length - 2, std::size_t{10}},
                                      {Store::length - 1, 10},
                                      {Store::length - 1, 0},
                                      {Store::length - 1, 1},
                                      {Store::length - 1, Store::length - 2}}) {
    FakeFlash flash;
    flash.after_program = [&, at = late, other = changed](std::size_t sector, std::size_t word) {
      if (sector == 0 && word == at) flash.words[0][other] ^= 4;
    };
    Store store(flash);
    ASSERT_EQ(save(store, some_values(1)), SaveProgress::done);
    EXPECT_EQ(store.write_errors(), 1u) << changed;
    LoadReport report;
    EXPECT_EQ(loaded(flash, &report), persistent_part(some_values(1))) << changed;
    EXPECT_EQ(report.header.sequence, 1u);
    if (changed != 0) {
      EXPECT_EQ(store.survey().damaged, 1) << changed;
    }
  }
}

TEST(ParameterStore, ABrokenSectorIsLeftAndOneThatHoldsTheSetIsNeverErased) {
  FakeFlash flash;
  Store store(flash);
  ASSERT_EQ(save(store, some_values(1)), SaveProgress::done);
  for (std::size_t word = stride; word < FakeFlash::words_per_sector; ++word) flash.broken.insert({0, word});
  ASSERT_EQ(save(store, some_values(2)), SaveProgress::done);
  EXPECT_EQ(flash.erases, 1);
  EXPECT_GT(store.write_errors(), 0u);
  ASSERT_EQ(loaded(flash), persistent_part(some_values(2)));

  // Now the other sector takes nothing more either: the set in it stays.
  for (std::size_t word = stride; word < FakeFlash::words_per_sector; ++word) flash.broken.insert({1, word});
  for (std::size_t word = 0; word < stride; ++word) flash.broken.insert({0, word});
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(save(store, some_values(3)), SaveProgress::failed);
    ASSERT_EQ(loaded(flash), persistent_part(some_values(2)));
  }
  flash.broken.clear();
  ASSERT_EQ(save(store, some_values(4)), SaveProgress::done);
  EXPECT_EQ(loaded(flash), persistent_part(some_values(4)));
}

TEST(ParameterStore, AnEraseThatFailsLosesNothing) {
  FakeFlash flash;
  Store store(flash);
  for (std::uint32_t k = 1; k <= saves_per_sector; ++k) save(store, some_values(k));
  flash.erase_works = false;
  ASSERT_EQ(save(store, some_values(50)), SaveProgress::failed);
  EXPECT_EQ(flash.erases, 1);
  EXPECT_EQ(store.write_errors(), 1u);
  ASSERT_EQ(loaded(flash), persistent_part(some_values(saves_per_sector)));
  flash.erase_works = true;
  ASSERT_EQ(save(store, some_values(51)), SaveProgress::done);
  EXPECT_EQ(loaded(flash), persistent_part(some_values(51)));
}

TEST(ParameterStore, AMemoryThatIsNotThereFailsInsteadOfHanging) {
  AnyFlashSectors none;
  ParameterStore<AnyFlashSectors> store(none);
  ParameterValues values;
  EXPECT_FALSE(store.load(values).found);
  store.begin(values);
  SaveProgress progress = SaveProgress::busy;
  for (int i = 0; i < 10'000 && progress == SaveProgress::busy; ++i) progress = store.step();
  EXPECT_EQ(progress, SaveProgress::failed);
}

// Whatever words are broken: a save either keeps the new set or leaves the old one, and says which.
TEST(ParameterStore, SavesOnABadMemorySayTheTruth) {
  EXPECT_TRUE(rc::check("bad words", [](std::uint32_t seed) {
    FakeFlash flash;
    std::mt19937 random(seed);
    const auto badness = random() % 200;
    for (std::size_t i = 0; i < badness; ++i) flash.broken.insert({random() % 2, random() % 4096});
    flash.broken_bits = static_cast<std::uint32_t>(random());
    Store store(flash);
    PersistentValues kept = persistent_part(ParameterValues{});
    for (std::uint32_t k = 0; k < 30; ++k) {
      const ParameterValues values = some_values(seed + k);
      if (save(store, values) == SaveProgress::done) kept = persistent_part(values);
      RC_ASSERT(loaded(flash) == kept);
    }
  }));
}

TEST(StoreSurvey, OfNothing) {
  const StoreSurvey defaults{};
  EXPECT_FALSE(defaults.newest);
  EXPECT_EQ(defaults.next_sequence, 1u);
  EXPECT_EQ(defaults.erases, 0u);
  EXPECT_EQ(defaults.damaged, 0);
  EXPECT_EQ(defaults.lock_code, 0u);
  EXPECT_EQ(defaults.parameters(), 0u);
}

TEST(LoadReport, OfNothing) {
  const LoadReport defaults{};
  EXPECT_FALSE(defaults.found);
  EXPECT_FALSE(defaults.other_dictionary);
  EXPECT_EQ(defaults.header.sequence, 0u);
  EXPECT_EQ(defaults.header.schema, 0u);
  EXPECT_EQ(defaults.header.erases, 0u);
  EXPECT_EQ(defaults.header.count, 0u);
}

}  // namespace
}  // namespace kmax::firmware::parameter_store_test
