#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <span>

#include "tests/host_tools/virtual_board/cortex_m/system_on_model.hpp"

// RM0090, chapter Embedded Flash memory interface.

namespace kmax::virtual_board::flash_interface_test {
namespace {

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
    flash.store(address, bytes, value, bus.now);
  }
  void wait() { bus.now = std::max(bus.now, flash.busy_until()); }
  std::uint32_t word(std::uint32_t address) { return flash.load(address, 4, bus.now); }
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
    chip.flash.reset(chip.bus.now);
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
  const BoardTime start = chip.bus.now;
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
    chip.bus.access_time = 0;
    chip.start_erase(sector);
    const std::size_t bytes = sector < 4 ? 0x4000 : sector == 4 ? 0x1'0000 : 0x2'0000;
    const std::size_t begin = sector < 4 ? sector * 0x4000 : sector == 4 ? 0x1'0000 : (sector - 4) * 0x2'0000;
    EXPECT_EQ(std::ranges::count(chip.image, 0xFF), bytes);
    EXPECT_EQ(chip.image.at(begin), 0xFF);
    EXPECT_EQ(chip.image.at(begin + bytes - 1), 0xFF);
    EXPECT_EQ(chip.flash.busy_until() - chip.bus.now, (sector < 4    ? 250U
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
    chip.flash.reset(chip.bus.now);
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
    chip.flash.power_up(chip.bus.now);
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

}  // namespace
}  // namespace kmax::virtual_board::flash_interface_test
