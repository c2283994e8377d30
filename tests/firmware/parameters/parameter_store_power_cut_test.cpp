// Loss of power at every word and every erase of a save, with words half programmed and sectors half erased:
// the set before or the set after is there, whole, and saving goes on.
#include <gtest/gtest.h>

#include <rapidcheck.h>

#include "firmware/parameters/parameter_store.hpp"
#include "tests/firmware/fake_flash.hpp"

namespace kmax::firmware::parameter_store_power_cut_test {
namespace {

constexpr std::size_t stride = record::aligned_up(Store::length);
constexpr std::uint32_t saves_per_sector = (FakeFlash::words_per_sector + stride - Store::length) / stride;
constexpr std::uint32_t patterns = 6;

enum class Outcome { complete, before, after };

/// A save that loses power at its operation number `at`; then a new start.
Outcome cut_save(FakeFlash& flash, const ParameterValues& values, int at, std::uint32_t pattern) {
  const PersistentValues old = loaded(flash);
  flash.cut_after(at, pattern);
  bool cut = false;
  try {
    Store store(flash);
    EXPECT_EQ(save(store, values), SaveProgress::done);
  } catch (const PowerCut&) {
    cut = true;
  }
  flash.restore_power();
  const PersistentValues found = loaded(flash);
  if (!cut) {
    EXPECT_EQ(found, persistent_part(values));
    return Outcome::complete;
  }
  if (found == persistent_part(values)) return Outcome::after;
  EXPECT_EQ(found, old) << "neither the set before nor the set after; cut at " << at << ", pattern "
                        << pattern;
  return Outcome::before;
}

void expect_saving_works(FakeFlash& flash, std::uint32_t seed) {
  Store store(flash);
  ASSERT_EQ(save(store, some_values(seed)), SaveProgress::done);
  ASSERT_EQ(loaded(flash), persistent_part(some_values(seed)));
  ASSERT_EQ(store.write_errors(), 0u);
}

/// Every operation of one save, on a memory after `saves_before` saves.
void cut_everywhere(std::uint32_t saves_before, bool expect_erase) {
  FakeFlash prepared;
  Store store(prepared);
  for (std::uint32_t k = 0; k < saves_before; ++k) ASSERT_EQ(save(store, some_values(k)), SaveProgress::done);
  const int erases_before = prepared.erases;
  const ParameterValues next = some_values(1000);
  int operations = 0, before = 0, after = 0;
  for (Outcome outcome{}; outcome != Outcome::complete || operations == 0; ++operations) {
    for (std::uint32_t pattern = 0; pattern < patterns; ++pattern) {
      FakeFlash flash = prepared;
      outcome = cut_save(flash, next, operations, pattern);
      before += outcome == Outcome::before ? 1 : 0;
      after += outcome == Outcome::after ? 1 : 0;
      if (outcome == Outcome::complete) {
        EXPECT_EQ(flash.erases - erases_before, expect_erase ? 1 : 0);
      }
      expect_saving_works(flash, 2000);
      if (testing::Test::HasFatalFailure()) FAIL() << "cut at " << operations << ", pattern " << pattern;
    }
    if (outcome == Outcome::complete) break;
  }
  EXPECT_EQ(operations, static_cast<int>(Store::length) + (expect_erase ? 1 : 0));
  // Only the commit word decides.
  EXPECT_EQ(before + after, operations * static_cast<int>(patterns));
  EXPECT_GE(after, 1);
  EXPECT_LT(after, static_cast<int>(patterns));
}

TEST(ParameterStorePowerCut, InTheFirstSaveOfAll) {
  cut_everywhere(0, false);
}
TEST(ParameterStorePowerCut, InTheSecondSave) {
  cut_everywhere(1, false);
}
TEST(ParameterStorePowerCut, InTheLastSaveOfASector) {
  cut_everywhere(saves_per_sector - 1, false);
}
TEST(ParameterStorePowerCut, InTheSaveThatChangesTheSector) {
  cut_everywhere(saves_per_sector, true);
}
TEST(ParameterStorePowerCut, InTheSaveAfterTheChange) {
  cut_everywhere(saves_per_sector + 1, false);
}
TEST(ParameterStorePowerCut, InTheSaveThatChangesBack) {
  cut_everywhere(2 * saves_per_sector, true);
}
TEST(ParameterStorePowerCut, OnceMoreRoundAndRound) {
  cut_everywhere(3 * saves_per_sector, true);
}

TEST(ParameterStorePowerCut, DuringTheEraseAgainAndAgain) {
  FakeFlash flash;
  Store store(flash);
  for (std::uint32_t k = 0; k < saves_per_sector; ++k) save(store, some_values(k));
  for (std::uint32_t i = 0; i < 200; ++i)
    ASSERT_EQ(cut_save(flash, some_values(500 + i), 0, i), Outcome::before);
  expect_saving_works(flash, 3);
}

// A device on a bad supply: cuts in saves that follow cuts.
TEST(ParameterStorePowerCut, ManyInARowNeverLoseTheLastGoodSet) {
  EXPECT_TRUE(rc::check("cuts in a row", [](std::uint32_t seed) {
    std::mt19937 random(seed);
    FakeFlash flash;
    const std::uint32_t full = static_cast<std::uint32_t>(random() % (2 * saves_per_sector));
    Store store(flash);
    for (std::uint32_t k = 0; k < full; ++k) save(store, some_values(k));
    for (int i = 0; i < 40; ++i) {
      const std::uint32_t values = static_cast<std::uint32_t>(random());
      const bool early = random() % 4 == 0;
      const int at = static_cast<int>(early ? random() % 4 : random() % (Store::length + 20));
      cut_save(flash, some_values(values), at, static_cast<std::uint32_t>(random()));
      RC_ASSERT(!testing::Test::HasFailure());
    }
    expect_saving_works(flash, seed);
    RC_ASSERT(!testing::Test::HasFailure());
  }));
}

// The sector with the newest good set is never erased, not even half.
TEST(ParameterStorePowerCut, NoEraseTouchesTheNewestSet) {
  std::mt19937 random(7);
  FakeFlash flash;
  int erases = 0;
  flash.before_erase = [&](std::size_t sector) {
    const StoreSurvey found = Store(flash).survey();
    ASSERT_TRUE(found.newest);
    ASSERT_NE(found.newest->sector, sector);
    ++erases;
  };
  expect_saving_works(flash, 1);
  for (std::uint32_t i = 0; i < 300; ++i)
    cut_save(flash, some_values(i), static_cast<int>(random() % (Store::length + 60)), i);
  EXPECT_GT(erases, 10);
}

// A memory that wears out and a supply that fails, together.
TEST(ParameterStorePowerCut, OnAMemoryWithBrokenWords) {
  EXPECT_TRUE(rc::check("cuts and bad words", [](std::uint32_t seed) {
    std::mt19937 random(seed);
    FakeFlash flash;
    for (int i = 0; i < 10; ++i) flash.broken.insert({random() % 2, random() % 4096});
    PersistentValues kept = loaded(flash);
    for (int i = 0; i < 40; ++i) {
      const ParameterValues values = some_values(static_cast<std::uint32_t>(random()));
      flash.cut_after(static_cast<int>(random() % (2 * Store::length)), static_cast<std::uint32_t>(random()));
      SaveProgress progress = SaveProgress::busy;
      try {
        Store store(flash);
        progress = save(store, values);
      } catch (const PowerCut&) {
      }
      flash.restore_power();
      const PersistentValues found = loaded(flash);
      const bool is_new = found == persistent_part(values);
      RC_ASSERT(is_new || (found == kept && progress != SaveProgress::done));
      kept = found;
    }
  }));
}

}  // namespace
}  // namespace kmax::firmware::parameter_store_power_cut_test
