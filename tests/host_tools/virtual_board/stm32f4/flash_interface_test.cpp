#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <span>

#include "drivers/stm32f4/flash_sectors.hpp"
#include "tests/host_tools/virtual_board/stm32f4/system_on_model.hpp"

// RM0090, chapter Embedded Flash memory interface.

namespace kmax::virtual_board::flash_interface_test {

namespace stm32 = drivers::stm32f4;
namespace cr = stm32::flash_cr;
namespace sr = stm32::flash_sr;

constexpr std::uint32_t parameters = 0x0800'4000;

struct Chip : testing::SystemOnModel {
  testing::FlashOnModel& registers = flash_registers;
  void unlock() {
    registers.keyr = stm32::flash_key_1;
    registers.keyr = stm32::flash_key_2;
  }
  std::uint32_t status() { return static_cast<std::uint32_t>(registers.sr); }
  std::uint32_t control() { return static_cast<std::uint32_t>(registers.cr); }
  void store(std::uint32_t address, unsigned bytes, std::uint32_t value) {
    flash.store(address, bytes, value, now);
  }
  void wait() { now = std::max(now, flash.busy_until()); }
  std::uint32_t word(std::uint32_t address) { return flash.load(address, 4, now); }
  void start_erase(std::uint32_t sector) {
    registers.cr = cr::SectorErase::mask | cr::Sector::bits(sector) | cr::Parallelism::bits(cr::by_word);
    registers.cr = control() | cr::Start::mask;
  }
};

// Section Unlocking the Flash control register.
TEST(FlashKeys, OpenTheControlRegisterInOrderOnly) {
  Chip chip;
  EXPECT_EQ(chip.control(), cr::Lock::mask);
  EXPECT_THROW(chip.registers.cr = cr::Program::mask, RefusedAccess);
  chip.unlock();
  EXPECT_EQ(chip.control(), 0U);
  chip.registers.cr = cr::Lock::mask;
  EXPECT_EQ(chip.control(), cr::Lock::mask);
  chip.unlock();
  EXPECT_EQ(chip.control(), 0U) << "as often as one likes";
}

TEST(FlashKeys, AnyWrongSequenceLocksUntilReset) {
  const auto keys_that_lock = [](std::initializer_list<std::uint32_t> keys) {
    Chip chip;
    bool refused = false;
    for (const std::uint32_t key : keys) {
      try {
        chip.registers.keyr = key;
      } catch (const RefusedAccess&) {
        refused = true;
      }
    }
    EXPECT_TRUE(refused);
    chip.unlock();
    EXPECT_EQ(chip.control(), cr::Lock::mask);
    chip.flash.reset(chip.now);
    chip.unlock();
    EXPECT_EQ(chip.control(), 0U);
  };
  keys_that_lock({0xCDEF'89AB});
  keys_that_lock({0x4567'0123, 0x4567'0123});
  keys_that_lock({0x4567'0123, 0});
  keys_that_lock({0x4567'0123, 0xCDEF'89AB, 0x4567'0123});
}

// Section Programming: error flags.
TEST(FlashProgramming, WithoutPgOrLockedIsASequenceError) {
  Chip chip;
  chip.store(parameters, 4, 0);
  EXPECT_EQ(chip.status(), sr::SequenceError::mask) << "locked";
  EXPECT_THROW(chip.store(parameters, 4, 0), RefusedAccess) << "flags not cleared";
  chip.registers.sr = sr::SequenceError::mask;
  EXPECT_EQ(chip.status(), 0U) << "cleared by writing 1";
  chip.unlock();
  chip.registers.cr = cr::Parallelism::bits(cr::by_word);
  chip.store(parameters, 4, 0);
  EXPECT_EQ(chip.status(), sr::SequenceError::mask);
  EXPECT_EQ(chip.word(parameters), 0xFFFF'FFFFU);
  EXPECT_EQ(chip.flash.operations(), 0U);
}

TEST(FlashProgramming, WidthMustBeThatOfPsize) {
  for (std::uint32_t psize = 0; psize < 3; ++psize) {
    for (const unsigned bytes : {1U, 2U, 4U}) {
      Chip chip;
      chip.unlock();
      chip.registers.cr = cr::Program::mask | cr::Parallelism::bits(psize);
      chip.store(parameters, bytes, 0);
      chip.wait();
      const bool fits = bytes == 1U << psize;
      EXPECT_EQ(chip.status(), fits ? 0U : sr::ParallelismError::mask) << psize << " " << bytes;
      EXPECT_EQ(chip.word(parameters) != 0xFFFF'FFFFU, fits);
    }
  }
  Chip chip;
  chip.unlock();
  EXPECT_THROW(chip.registers.cr = cr::Program::mask | cr::Parallelism::bits(3), RefusedAccess);
}

TEST(FlashProgramming, ClearsBitsOnlyAndTakes16Microseconds) {
  Chip chip;
  chip.unlock();
  chip.registers.cr = cr::Program::mask | cr::Parallelism::bits(cr::by_word);
  const BoardTime start = chip.now;
  chip.store(parameters + 8, 4, 0x0F0F'FFFF);
  EXPECT_EQ(chip.flash.busy_until(), start + 16 * units_per_microsecond);
  EXPECT_NE(chip.status() & sr::Busy::mask, 0U);
  EXPECT_THROW(chip.store(parameters, 4, 0), RefusedAccess) << "busy";
  EXPECT_THROW(chip.registers.cr = 0, RefusedAccess) << "busy";
  chip.wait();
  EXPECT_EQ(chip.status() & sr::Busy::mask, 0U);
  chip.store(parameters + 8, 4, 0xFFFF'1234);
  chip.wait();
  EXPECT_EQ(chip.word(parameters + 8), 0x0F0F'1234U);
  EXPECT_EQ(chip.image.at(0x4008), 0x34) << "little endian, in the given image";
}

// Section Erase.
TEST(FlashErase, EverySectorHasItsPlaceAndTime) {
  for (std::uint32_t sector = 0; sector < 12; ++sector) {
    Chip chip;
    std::ranges::fill(chip.image, std::uint8_t{0});
    chip.unlock();
    chip.access_time = 0;
    chip.start_erase(sector);
    const std::size_t bytes = sector < 4 ? 0x4000 : sector == 4 ? 0x1'0000 : 0x2'0000;
    const std::size_t begin = sector < 4 ? sector * 0x4000 : sector == 4 ? 0x1'0000 : (sector - 4) * 0x2'0000;
    EXPECT_EQ(std::ranges::count(chip.image, 0xFF), bytes);
    EXPECT_EQ(chip.image.at(begin), 0xFF);
    EXPECT_EQ(chip.image.at(begin + bytes - 1), 0xFF);
    EXPECT_EQ(chip.flash.busy_until() - chip.now, (sector < 4    ? 250U
                                                   : sector == 4 ? 550U
                                                                 : 1000U) *
                                                      1000 * units_per_microsecond);
  }
}

TEST(FlashErase, WrongSetUpsAreRefused) {
  Chip chip;
  chip.unlock();
  const std::uint32_t by_word = cr::Parallelism::bits(cr::by_word);
  EXPECT_THROW(chip.registers.cr = cr::Start::mask | by_word, RefusedAccess) << "no SER";
  EXPECT_THROW(chip.registers.cr = cr::Start::mask | cr::SectorErase::mask | cr::Program::mask | by_word,
               RefusedAccess);
  EXPECT_THROW(chip.registers.cr = cr::Start::mask | cr::SectorErase::mask | cr::Sector::bits(12) | by_word,
               RefusedAccess);
  EXPECT_THROW(chip.registers.cr = cr::Start::mask | cr::SectorErase::mask, RefusedAccess) << "x8";
  EXPECT_THROW(chip.registers.cr = cr::MassErase::mask, RefusedAccess);
  EXPECT_THROW(chip.registers.cr = cr::EndInterrupt::mask, RefusedAccess);
  EXPECT_EQ(chip.flash.operations(), 0U);
}

TEST(FlashErase, ProtectedSectorStaysAndSaysSo) {
  Chip chip;
  chip.image.at(0x4000) = 0x11;
  chip.flash.set_write_protected(1, true);
  chip.unlock();
  chip.start_erase(1);
  EXPECT_EQ(chip.status(), sr::WriteProtected::mask);
  EXPECT_EQ(chip.image.at(0x4000), 0x11);
}

TEST(FlashErase, SystemResetInTheMiddleTearsIt) {
  std::set<std::vector<std::uint8_t>> outcomes;
  Chip chip;
  for (int attempt = 0; attempt < 12; ++attempt) {
    std::ranges::fill(chip.image, std::uint8_t{0x42});
    chip.unlock();
    chip.start_erase(2);
    chip.flash.reset(chip.now);
    EXPECT_EQ(chip.image.at(0x7FFF), 0x42) << "the neighbours";
    EXPECT_EQ(chip.image.at(0xC000), 0x42);
    outcomes.insert({chip.image.begin() + 0x8000, chip.image.begin() + 0xC000});
    EXPECT_EQ(chip.status(), 0U);
  }
  EXPECT_GT(outcomes.size(), 3U) << "not always the same";
}

// Section Adaptive real-time memory accelerator.
TEST(FlashCaches, DataCacheMustBeResetAfterAnErase) {
  Chip chip;
  chip.registers.acr = stm32::flash_acr::DataCache::mask;
  chip.unlock();
  chip.start_erase(1);
  chip.wait();
  EXPECT_THROW(chip.word(parameters), RefusedAccess);
  EXPECT_THROW(chip.registers.acr = stm32::flash_acr::DataCacheReset::mask, RefusedAccess) << "still enabled";
  chip.registers.acr = 0;
  EXPECT_NO_THROW(chip.word(parameters)) << "not through the cache";
  chip.registers.acr = stm32::flash_acr::DataCacheReset::mask;
  chip.registers.acr = 0;
  chip.registers.acr = stm32::flash_acr::DataCache::mask;
  EXPECT_EQ(chip.word(parameters), 0xFFFF'FFFFU);
}

TEST(FlashPowerCut, TornWritesLackZerosAndNothingElse) {
  std::set<std::uint32_t> seen;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Chip chip;
    chip.unlock();
    chip.registers.cr = cr::Program::mask | cr::Parallelism::bits(cr::by_word);
    chip.flash.cut_power_after(1, seed);
    EXPECT_THROW(chip.store(parameters, 4, 0x00FF'00FF), PowerCut);
    EXPECT_THROW(chip.status(), RefusedAccess);
    chip.flash.power_up(chip.now);
    const std::uint32_t torn = chip.word(parameters);
    EXPECT_EQ(torn & 0x00FF'00FFU, 0x00FF'00FFU) << seed;
    seen.insert(torn);
  }
  EXPECT_GT(seen.size(), 20U);
  EXPECT_TRUE(seen.contains(0xFFFF'FFFFU)) << "not begun";
  EXPECT_TRUE(seen.contains(0x00FF'00FFU)) << "finished";
}

TEST(FlashPowerCut, TornErasesLeaveOldErasedAndHalfErasedWords) {
  bool untouched = false, complete = false, mixed = false;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Chip chip;
    std::ranges::fill(chip.image, std::uint8_t{0});
    chip.unlock();
    chip.flash.cut_power_after(1, seed);
    EXPECT_THROW(chip.start_erase(1), PowerCut);
    const auto sector = std::span(chip.image).subspan(0x4000, 0x4000);
    const auto erased = std::ranges::count(sector, 0xFF);
    const auto old = std::ranges::count(sector, 0x00);
    EXPECT_EQ(chip.image.at(0x3FFF), 0) << "the neighbours";
    EXPECT_EQ(chip.image.at(0x8000), 0);
    untouched = untouched || old == 0x4000;
    complete = complete || erased == 0x4000;
    mixed = mixed || (old > 0x400 && erased > 0x400);
  }
  EXPECT_TRUE(untouched);
  EXPECT_TRUE(complete);
  EXPECT_TRUE(mixed);
}

// drivers/stm32f4/flash_sectors.hpp on the model: the parameter sectors 1 and 2.

/// A word of flash memory as the processor sees it on the bus.
class WordOnModel {
 public:
  testing::SystemOnModel* chip = nullptr;
  std::uint32_t address = 0;

  explicit operator std::uint32_t() const { return chip->flash.load(address, 4, chip->now); }
  WordOnModel& operator=(std::uint32_t word) {
    chip->flash.store(address, 4, word, chip->now);
    chip->finish_access();
    return *this;
  }
};

using Sectors = stm32::FlashSectors<testing::FlashOnModel, WordOnModel>;

struct SectorsOnModel : testing::SystemOnModel {
  std::vector<WordOnModel> words{2 * Sectors::words_per_sector};
  std::unique_ptr<Sectors> sectors;
  BoardTime stalled = 0;

  SectorsOnModel() {
    for (std::size_t i = 0; i < words.size(); ++i) {
      words[i].chip = this;
      words[i].address = static_cast<std::uint32_t>(0x0800'4000 + 4 * i);
    }
    std::ranges::fill(image, std::uint8_t{0x5A});
    flash_registers.acr = 0x705;
    // The core fetches from flash: it gets its next instruction when the flash is free.
    after_access = [this] {
      if (flash.busy_until() <= now) return;
      stalled += flash.busy_until() - now;
      now = flash.busy_until();
    };
    sectors = std::make_unique<Sectors>(
        flash_registers, std::array{Sectors::Sector{1, first_half()}, Sectors::Sector{2, second_half()}});
  }
  std::span<WordOnModel, Sectors::words_per_sector> first_half() {
    return std::span<WordOnModel, Sectors::words_per_sector>(words.data(), Sectors::words_per_sector);
  }
  std::span<WordOnModel, Sectors::words_per_sector> second_half() {
    return std::span<WordOnModel, Sectors::words_per_sector>(words.data() + Sectors::words_per_sector,
                                                             Sectors::words_per_sector);
  }
  bool all(std::size_t begin, std::size_t end, std::uint8_t byte) const {
    const std::vector<std::uint8_t> expected(end - begin, byte);
    return std::equal(expected.data(), expected.data() + expected.size(), image.data() + begin);
  }
};

TEST(FlashSectorsOnModel, EraseTouchesItsSectorOnlyAndStallsTheCore) {
  SectorsOnModel chip;
  ASSERT_TRUE(chip.sectors->erase(1));
  EXPECT_TRUE(chip.all(0, 0x8000, 0x5A));
  EXPECT_TRUE(chip.all(0x8000, 0xC000, 0xFF));
  EXPECT_TRUE(chip.all(0xC000, chip.image.size(), 0x5A));
  EXPECT_NEAR(seconds(chip.stalled), 0.25, 1e-3);
}

TEST(FlashSectorsOnModel, EraseProgramReadBackWholeSectors) {
  SectorsOnModel chip;
  for (std::size_t sector = 0; sector < 2; ++sector) {
    ASSERT_TRUE(chip.sectors->erase(sector));
    for (std::size_t word = 0; word < Sectors::words_per_sector; ++word)
      ASSERT_TRUE(
          chip.sectors->program(sector, word, static_cast<std::uint32_t>(word * 0x9E37'79B1U + sector)));
  }
  for (std::size_t sector = 0; sector < 2; ++sector)
    for (std::size_t word = 0; word < Sectors::words_per_sector; ++word)
      ASSERT_EQ(chip.sectors->read(sector, word), static_cast<std::uint32_t>(word * 0x9E37'79B1U + sector));
  EXPECT_EQ(chip.flash.operations(), 2 + 2 * Sectors::words_per_sector);
  EXPECT_NEAR(seconds(chip.stalled), 2 * 0.25 + 8192 * 16e-6, 1e-2);
}

TEST(FlashSectorsOnModel, LockedForGoodAfterAWrongKey) {
  SectorsOnModel chip;
  EXPECT_THROW(chip.flash_registers.keyr = 0x1234, RefusedAccess);
  EXPECT_FALSE(chip.sectors->erase(0));
  EXPECT_EQ(chip.sectors->result(), stm32::FlashResult::locked);
  chip.flash.reset(chip.now);
  EXPECT_TRUE(chip.sectors->erase(0)) << "a reset unlocks the keys";
}

TEST(FlashSectorsOnModel, ProtectedSectorIsNamedAndTheNextOneStillWorks) {
  SectorsOnModel chip;
  chip.flash.set_write_protected(1, true);
  EXPECT_FALSE(chip.sectors->erase(0));
  EXPECT_EQ(chip.sectors->result(), stm32::FlashResult::write_protected);
  EXPECT_TRUE(chip.sectors->erase(1));
}

TEST(FlashSectorsOnModel, TakesOverARegisterThatWasLeftUnlocked) {
  SectorsOnModel chip;
  // Found unlocked and with PSIZE x8: the driver sets its own.
  chip.flash_registers.keyr = stm32::flash_key_1;
  chip.flash_registers.keyr = stm32::flash_key_2;
  chip.flash_registers.cr = 0;
  ASSERT_TRUE(chip.sectors->erase(0));
  EXPECT_TRUE(chip.sectors->program(0, 0, 0x1234'5678));
  EXPECT_EQ(static_cast<std::uint32_t>(chip.flash_registers.cr), cr::Lock::mask);
}

// The power goes in the n-th operation: what is torn is confined to that operation's words.
RC_GTEST_PROP(FlashSectorsOnModel, PowerCutTearsOneOperation, (std::uint64_t seed)) {
  const auto operation = *rc::gen::inRange<std::uint64_t>(1, 12);
  SectorsOnModel chip;
  chip.flash.cut_power_after(operation, seed);
  std::uint32_t programmed = 0;
  bool cut = false;
  try {
    static_cast<void>(chip.sectors->erase(0));
    for (; programmed < 20; ++programmed) RC_ASSERT(chip.sectors->program(0, programmed, programmed));
  } catch (const PowerCut&) {
    cut = true;
  }
  RC_ASSERT(cut);
  RC_ASSERT(chip.flash.operations() == operation);
  RC_ASSERT(chip.flash.power_is_cut());
  bool refused = false;
  try {
    static_cast<void>(chip.sectors->read(0, 0));
  } catch (const RefusedAccess&) {
    refused = true;
  }
  RC_ASSERT(refused);

  chip.flash.power_up(chip.now);
  RC_ASSERT(chip.all(0, 0x4000, 0x5A) && chip.all(0x8000, chip.image.size(), 0x5A));
  if (operation == 1) {  // half-erased: every bit is the old one or 1
    for (std::size_t word = 0; word < Sectors::words_per_sector; ++word)
      RC_ASSERT((chip.sectors->read(0, word) & 0x5A5A'5A5AU) == 0x5A5A'5A5AU);
    return;
  }
  RC_ASSERT(programmed == operation - 2);
  for (std::uint32_t word = 0; word < programmed; ++word) RC_ASSERT(chip.sectors->read(0, word) == word);
  RC_ASSERT((chip.sectors->read(0, programmed) & programmed) == programmed);
  for (std::uint32_t word = programmed + 1; word < 40; ++word)
    RC_ASSERT(chip.sectors->read(0, word) == 0xFFFF'FFFFU);
  RC_ASSERT(chip.sectors->erase(0));
}

}  // namespace kmax::virtual_board::flash_interface_test
