#include "firmware/parameters/parameter_keeper.hpp"

#include <gtest/gtest.h>

#include <iterator>
#include <utility>
#include <vector>

#include "tests/firmware/fake_flash.hpp"

namespace kmax::firmware::parameter_keeper_test {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

Pairs pairs_of(const ParameterValues& values) {
  Pairs pairs;
  for (std::size_t i = 0; i < persistent_count; ++i)
    pairs.emplace_back(persistent_identity(i), persistent_part(values)[i]);
  return pairs;
}

/// One valid record, as some firmware may have left it; the word behind it.
std::size_t put_record(FakeFlash& flash, std::size_t word, record::Header header, const Pairs& pairs) {
  Crc32 crc;
  const auto put = [&](std::uint32_t value) {
    flash.words[0][word++] = value;
    crc.add(value);
  };
  header.count = static_cast<std::uint32_t>(pairs.size());
  for (std::size_t i = 0; i < record::header_words; ++i) put(header.word(i));
  for (const auto& [identity, value] : pairs) put(identity), put(value);
  flash.words[0][word++] = crc.value();
  flash.words[0][word++] = record::commit;
  return word;
}

class KeeperTest : public testing::Test {
 protected:
  void attach() { keeper.attach(AnyFlashSectors::of(flash), values); }
  void finish() {
    for (int i = 0; i < 20'000 && keeper.busy(); ++i) {
      EXPECT_EQ(keeper.state(), StoreState::busy);
      keeper.poll();
    }
    EXPECT_FALSE(keeper.busy());
  }
  void save() {
    ASSERT_EQ(keeper.save(values, false), Refusal::none);
    finish();
  }
  template <FixedName name>
  std::uint32_t shown() {
    keeper.publish(values);
    return values.raw(slot_of(entry_of<name>(), 0));
  }

  FakeFlash flash;
  ParameterValues values;
  ParameterKeeper keeper;
};

TEST_F(KeeperTest, ItsNumbersAreThoseOfTheParameters) {
  const StoreState states[] = {StoreState::idle,     StoreState::busy,    StoreState::saved,
                               StoreState::failed,   StoreState::refused, StoreState::defaults_set,
                               StoreState::no_memory};
  for (std::size_t i = 0; i < std::size(states); ++i) EXPECT_EQ(static_cast<std::size_t>(states[i]), i);
  EXPECT_EQ(static_cast<int>(StoreCommand::save), 1);
  EXPECT_EQ(static_cast<int>(StoreCommand::defaults), 2);
}

TEST_F(KeeperTest, WithoutAMemoryNothingIsSaved) {
  EXPECT_EQ(keeper.state(), StoreState::no_memory);
  keeper.attach({}, values);
  EXPECT_EQ(keeper.state(), StoreState::no_memory);
  EXPECT_EQ(shown<"store.state">(), 6u);
  EXPECT_EQ(shown<"store.free_saves">(), 0u);
  for (const bool armed : {false, true}) {
    EXPECT_EQ(keeper.save(values, armed), Refusal::store_missing);
    EXPECT_EQ(keeper.save_lock_code(1, armed), Refusal::store_missing);
    EXPECT_EQ(keeper.state(), StoreState::no_memory);
  }
}

TEST_F(KeeperTest, AnEmptyMemoryHoldsNothing) {
  attach();
  EXPECT_FALSE(keeper.loaded().found);
  EXPECT_EQ(shown<"store.state">(), 0u);
  EXPECT_EQ(shown<"store.sequence">(), 0u);
  EXPECT_EQ(shown<"store.saved_parameters">(), 0u);
  EXPECT_EQ(shown<"store.unsaved_parameters">(), 0u);
  EXPECT_EQ(shown<"store.free_saves">(),
            static_cast<std::uint32_t>(Store(flash).free_saves(Store(flash).survey())));
  EXPECT_GT(shown<"store.free_saves">(), 1u);
  EXPECT_EQ(shown<"store.erases">() | shown<"store.write_errors">() | shown<"store.damaged_records">(), 0u);
  EXPECT_EQ(keeper.lock_code(), 0u);
}

// Before a memory has been attached the defaults count as kept, afterwards what it held.
TEST_F(KeeperTest, EachParameterThatIsNotAsItIsKeptCounts) {
  for (const bool attached : {false, true}) {
    if (attached) {
      values = some_values(3);
      attach();
    }
    EXPECT_EQ(shown<"store.unsaved_parameters">(), 0u);
    const ParameterValues kept = values;
    for (std::size_t i = 0; i < persistent_count; ++i) {
      values.set_raw(persistent_slots[i], kept.raw(persistent_slots[i]) + 1);
      EXPECT_EQ(shown<"store.unsaved_parameters">(), i + 1);
    }
  }
}

TEST_F(KeeperTest, ASaveIsBusyAndThenKeptUntilSomethingIsAnother) {
  values = some_values(1);
  attach();
  ASSERT_EQ(keeper.save(values, false), Refusal::none);
  EXPECT_TRUE(keeper.busy());
  EXPECT_EQ(shown<"store.state">(), 1u);
  finish();
  EXPECT_EQ(keeper.state(), StoreState::saved);
  EXPECT_EQ(shown<"store.sequence">(), 1u);
  EXPECT_EQ(shown<"store.saved_parameters">(), persistent_count);
  EXPECT_EQ(loaded(flash), persistent_part(values));
  const int programs = flash.programs;
  keeper.note_defaults(Refusal::none);
  EXPECT_EQ(keeper.save(values, false), Refusal::none);
  EXPECT_FALSE(keeper.busy()) << "it is there already";
  EXPECT_EQ(keeper.state(), StoreState::saved);
  keeper.poll();
  EXPECT_EQ(flash.programs, programs);
  values = some_values(2);
  EXPECT_GT(shown<"store.unsaved_parameters">(), 0u);
  save();
  EXPECT_EQ(shown<"store.unsaved_parameters">(), 0u);
  EXPECT_EQ(shown<"store.sequence">(), 2u);
  EXPECT_EQ(loaded(flash), persistent_part(values));
}

TEST_F(KeeperTest, DefaultsThatWereNeverSavedAreSaved) {
  attach();
  save();
  EXPECT_EQ(shown<"store.sequence">(), 1u);
}

TEST_F(KeeperTest, ARefusalWhileBusyDisturbsNothing) {
  attach();
  ASSERT_EQ(keeper.save(values, false), Refusal::none);
  for (const bool armed : {false, true}) {
    EXPECT_EQ(keeper.save(values, armed), Refusal::store_busy);
    EXPECT_EQ(keeper.save_lock_code(1, armed), Refusal::store_busy);
  }
  keeper.note_defaults(Refusal::none);
  keeper.note_defaults(Refusal::while_armed);
  EXPECT_EQ(keeper.state(), StoreState::busy);
  finish();
  EXPECT_EQ(keeper.state(), StoreState::saved);
}

TEST_F(KeeperTest, ArmedItIsRefused) {
  attach();
  EXPECT_EQ(keeper.save(values, true), Refusal::while_armed);
  EXPECT_EQ(keeper.state(), StoreState::refused);
  keeper.note_defaults(Refusal::none);
  EXPECT_EQ(keeper.state(), StoreState::defaults_set);
  EXPECT_EQ(keeper.save_lock_code(1, true), Refusal::while_armed);
  EXPECT_EQ(keeper.state(), StoreState::refused);
  keeper.note_defaults(Refusal::none);
  keeper.note_defaults(Refusal::while_armed);
  EXPECT_EQ(keeper.state(), StoreState::refused);
  EXPECT_FALSE(keeper.busy());
  EXPECT_EQ(flash.programs, 0);
}

TEST_F(KeeperTest, AfterAFailureTheSameSetIsWrittenAgain) {
  attach();
  ASSERT_EQ(keeper.save_lock_code(4711, false), Refusal::none);
  finish();
  for (std::size_t sector = 0; sector < FakeFlash::sector_count; ++sector) {
    for (std::size_t word = 0; word < FakeFlash::words_per_sector; ++word) {
      if (flash.words[sector][word] == record::erased) flash.broken.insert({sector, word});
    }
  }
  const ParameterValues kept = values;
  values = some_values(2);
  save();
  EXPECT_EQ(keeper.state(), StoreState::failed);
  EXPECT_GT(shown<"store.write_errors">(), 0u);
  EXPECT_GT(shown<"store.unsaved_parameters">(), 0u);
  EXPECT_EQ(keeper.save(kept, false), Refusal::none);
  EXPECT_TRUE(keeper.busy());
  finish();
  ASSERT_EQ(keeper.state(), StoreState::failed);
  EXPECT_EQ(keeper.save_lock_code(4711, false), Refusal::none);
  EXPECT_TRUE(keeper.busy());
}

TEST_F(KeeperTest, ALockCodeIsKeptBesideTheSetThatIsKept) {
  values = some_values(1);
  attach();
  save();
  const PersistentValues kept = persistent_part(values);
  values = some_values(2);
  const std::uint32_t unsaved = shown<"store.unsaved_parameters">();
  ASSERT_GT(unsaved, 0u);
  for (const std::uint32_t code : {4711u, 12u, 0u}) {
    ASSERT_EQ(keeper.save_lock_code(code, false), Refusal::none);
    EXPECT_TRUE(keeper.busy());
    finish();
    EXPECT_EQ(keeper.state(), StoreState::saved);
    EXPECT_EQ(keeper.lock_code(), code);
    EXPECT_EQ(shown<"store.unsaved_parameters">(), unsaved);
    EXPECT_EQ(shown<"store.saved_parameters">(), persistent_count);
    EXPECT_EQ(loaded(flash), kept);
    keeper.note_defaults(Refusal::none);
    EXPECT_EQ(keeper.save_lock_code(code, false), Refusal::none);
    EXPECT_FALSE(keeper.busy()) << "it is there already";
    EXPECT_EQ(keeper.state(), StoreState::saved);
  }
}

TEST_F(KeeperTest, TellsWhatItFoundAndWhatOfItThisFirmwareDoesNotHave) {
  Pairs pairs = pairs_of(some_values(1));
  const Pairs missing(pairs.begin(), pairs.begin() + 4);
  pairs.erase(pairs.begin(), pairs.begin() + 4);
  for (std::uint32_t i = 0; i < 5; ++i) pairs.emplace_back(0xFFFF'0000u + i, i);
  const std::size_t behind = put_record(flash, 0, {41, 1, 7, 0}, pairs);
  // Whole but for a word.
  const std::size_t next = record::aligned_up(behind);
  put_record(flash, next, {42, 1, 7, 0}, pairs);
  flash.words[0][next + record::header_words] ^= 1u;
  attach();
  EXPECT_TRUE(keeper.loaded().found);
  EXPECT_EQ(shown<"store.sequence">(), 41u);
  EXPECT_EQ(shown<"store.saved_parameters">(), pairs.size());
  EXPECT_EQ(shown<"store.erases">(), 7u);
  EXPECT_EQ(shown<"store.damaged_records">(), 1u);
  EXPECT_EQ(shown<"store.unsaved_parameters">(), 0u);
  EXPECT_EQ(shown<"store.migrated_dropped">(), 5u);
  EXPECT_EQ(shown<"store.dropped_1">(), 0xFFFF'0000u);
  EXPECT_EQ(shown<"store.dropped_2">(), 0xFFFF'0001u);
  EXPECT_EQ(shown<"store.dropped_3">(), 0xFFFF'0002u);
  EXPECT_EQ(shown<"store.migrated_defaulted">(), 4u);
  EXPECT_EQ(shown<"store.defaulted_1">(), missing[0].first);
  EXPECT_EQ(shown<"store.defaulted_2">(), missing[1].first);
  EXPECT_EQ(shown<"store.defaulted_3">(), missing[2].first);
}

}  // namespace
}  // namespace kmax::firmware::parameter_keeper_test
