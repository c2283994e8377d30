#include "drivers/stm32f4/flash_sectors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "tests/drivers/fake_register.hpp"

// On fake registers: what is written in which order, and each way out. On the flash model:
// tests/host_tools/virtual_board/stm32f4/flash_interface_test.cpp.

namespace kmax::drivers::stm32f4::flash_sectors_test {

struct FakeFlash {
  FakeRegister acr, keyr, sr, cr;
};

/// A word of flash memory: a store clears bits, if the controller lets it.
class FakeWord {
 public:
  std::uint32_t value = 0xFFFF'FFFF;
  std::function<bool()>* store_works = nullptr;

  explicit operator std::uint32_t() const { return value; }
  FakeWord& operator=(std::uint32_t word) {
    if ((*store_works)()) value &= word;
    return *this;
  }
};

using Sectors = FlashSectors<FakeFlash, FakeWord>;

/// Controller with an open lock, as far as the tests need one, and two sectors: numbers 1 and 2.
struct Chip {
  FakeFlash flash;
  std::vector<FakeWord> memory{2 * Sectors::words_per_sector};
  std::function<bool()> store_works = [] { return true; };
  bool erases = true;
  std::uint32_t flags_of_operation = 0;
  std::string order;
  Sectors sectors{flash, {sector(0), sector(1)}, {.erase = 40, .word = 20}};

  Chip() {
    for (FakeWord& word : memory) word.store_works = &store_works;
    flash.acr.value = 0x705;
    flash.cr.value = flash_cr::Lock::mask;
    flash.keyr.on_write = [this](std::uint32_t key) {
      order += key == 0x4567'0123U ? "1" : key == 0xCDEF'89ABU ? "2" : "?";
      if (key == 0xCDEF'89ABU) flash.cr.value &= ~flash_cr::Lock::mask;
    };
    flash.cr.on_write = [this](std::uint32_t word) {
      order += (word & flash_cr::Lock::mask) != 0 ? "L" : word == 0 ? "0" : "c";
      if ((word & flash_cr::Start::mask) == 0) return;
      order += "S";
      flash.sr.value |= flags_of_operation;
      const std::uint32_t number = flash_cr::Sector::of(word);
      if (flags_of_operation != 0 || !erases || number < 1 || number > 2) return;
      for (std::size_t i = 0; i < Sectors::words_per_sector; ++i)
        memory[(number - 1) * Sectors::words_per_sector + i].value = 0xFFFF'FFFF;
    };
    flash.sr.on_write = [this](std::uint32_t ones) {
      order += "f";
      flash.sr.value = previous_flags_ & ~ones;
    };
    flash.sr.on_read = [this](std::uint32_t word) {
      previous_flags_ = word;
      return word;
    };
    flash.acr.on_write = [this](std::uint32_t word) { order += (word & 0x600U) == 0 ? "n" : "y"; };
  }

  std::size_t count(char what) const {
    return static_cast<std::size_t>(std::count(order.begin(), order.end(), what));
  }

 private:
  Sectors::Sector sector(std::size_t index) {
    return {static_cast<std::uint32_t>(index + 1),
            std::span<FakeWord, Sectors::words_per_sector>(memory.data() + index * Sectors::words_per_sector,
                                                           Sectors::words_per_sector)};
  }
  std::uint32_t previous_flags_ = 0;
};

TEST(FlashSectors, EraseSequence) {
  Chip chip;
  chip.memory[5].value = 0;
  chip.memory[Sectors::words_per_sector].value = 0;
  ASSERT_TRUE(chip.sectors.erase(0));
  // Keys, caches off, flags cleared, SER with the sector, STRT, CR to 0, lock, caches reset, off, on.
  EXPECT_EQ(chip.order, "12nfccS0Lnny");
  EXPECT_EQ(chip.flash.cr.writes.at(0), 1U << 1 | 1U << 3 | 2U << 8) << "SER, sector 1, x32, and no STRT yet";
  EXPECT_EQ(chip.flash.cr.writes.at(1), chip.flash.cr.writes.at(0) | 1U << 16);
  EXPECT_EQ(chip.flash.acr.writes, (std::vector<std::uint32_t>{0x105, 0x1905, 0x105, 0x705}));
  EXPECT_EQ(chip.sectors.read(0, 5), 0xFFFF'FFFFU);
  EXPECT_EQ(chip.sectors.read(1, 0), 0U) << "the other sector";
}

TEST(FlashSectors, ProgramSequence) {
  Chip chip;
  ASSERT_TRUE(chip.sectors.program(1, 7, 0x1234'5678));
  EXPECT_EQ(chip.order, "12nfc0Lnny");
  EXPECT_EQ(chip.flash.cr.writes.at(0), 1U | 2U << 8) << "PG, x32";
  EXPECT_EQ(chip.memory[Sectors::words_per_sector + 7].value, 0x1234'5678U);
  EXPECT_EQ(chip.sectors.words(1)[7].value, 0x1234'5678U);
  EXPECT_EQ(chip.sectors.result(), FlashResult::done);
}

TEST(FlashSectors, NothingOutsideTheTwoSectorsIsTouched) {
  Chip chip;
  EXPECT_FALSE(chip.sectors.erase(2));
  EXPECT_EQ(chip.sectors.result(), FlashResult::out_of_range);
  EXPECT_FALSE(chip.sectors.program(2, 0, 0));
  EXPECT_FALSE(chip.sectors.program(0, 4096, 0));
  EXPECT_FALSE(chip.sectors.program(0, ~std::size_t{0}, 0));
  EXPECT_EQ(chip.sectors.read(2, 0), 0U);
  EXPECT_EQ(chip.sectors.read(0, 4096), 0U);
  EXPECT_EQ(chip.order, "");
}

TEST(FlashSectors, BitsCannotBeSet) {
  Chip chip;
  ASSERT_TRUE(chip.sectors.program(0, 0, 0xF0));
  chip.order.clear();
  EXPECT_FALSE(chip.sectors.program(0, 0, 0xF1));
  EXPECT_EQ(chip.sectors.result(), FlashResult::not_erased);
  EXPECT_EQ(chip.order, "") << "nothing is half done";
  EXPECT_TRUE(chip.sectors.program(0, 0, 0x70)) << "clearing more of them is allowed";
}

TEST(FlashSectors, EveryErrorFlagHasItsNameAndLocksAgain) {
  struct Row {
    unsigned bit;
    FlashResult result;
  };
  for (const Row& row : {Row{1, FlashResult::operation_error}, Row{4, FlashResult::write_protected},
                         Row{5, FlashResult::alignment_error}, Row{6, FlashResult::parallelism_error},
                         Row{7, FlashResult::sequence_error}}) {
    Chip chip;
    chip.flags_of_operation = 1U << row.bit;
    EXPECT_FALSE(chip.sectors.erase(1));
    EXPECT_EQ(chip.sectors.result(), row.result) << row.bit;
    EXPECT_EQ(chip.flash.cr.value, flash_cr::Lock::mask);
    EXPECT_EQ(chip.flash.acr.value, 0x705U);
    chip.flags_of_operation = 0;
    EXPECT_TRUE(chip.sectors.erase(1)) << "old flags are cleared first: " << row.bit;
  }
}

TEST(FlashSectors, OldErrorFlagsAreNotTakenForNewOnes) {
  Chip chip;
  chip.flash.sr.value = flash_sr::errors;
  EXPECT_TRUE(chip.sectors.program(0, 0, 1));
}

TEST(FlashSectors, BusyFromBeforeTouchesNothing) {
  Chip chip;
  chip.flash.sr.value = flash_sr::Busy::mask;
  EXPECT_FALSE(chip.sectors.erase(0));
  EXPECT_EQ(chip.sectors.result(), FlashResult::busy);
  EXPECT_EQ(chip.order, "");
  EXPECT_EQ(chip.flash.sr.reads, 40U);
}

TEST(FlashSectors, BusyForEverEndsAndLeavesTheControlRegisterAlone) {
  Chip chip;
  chip.flags_of_operation = flash_sr::Busy::mask;
  EXPECT_FALSE(chip.sectors.erase(0));
  EXPECT_EQ(chip.sectors.result(), FlashResult::timed_out);
  EXPECT_EQ(chip.count('L') + chip.count('0'), 0U) << "a write to CR would stall the bus";
  EXPECT_EQ(chip.flash.acr.value, 0x705U) << "the caches are on again";
  chip.flags_of_operation = chip.flash.sr.value = 0;
  EXPECT_TRUE(chip.sectors.erase(0));
  EXPECT_EQ(chip.flash.cr.value, flash_cr::Lock::mask);
}

TEST(FlashSectors, WhatDoesNotReadBackIsNotDone) {
  Chip chip;
  chip.store_works = [] { return false; };
  EXPECT_FALSE(chip.sectors.program(0, 3, 0x55));
  EXPECT_EQ(chip.sectors.result(), FlashResult::wrong_content);
  chip.erases = false;
  chip.memory[4095].value = 0x7FFF'FFFF;
  EXPECT_FALSE(chip.sectors.erase(0)) << "one bit in the last word";
  EXPECT_EQ(chip.sectors.result(), FlashResult::wrong_content);
}

TEST(FlashSectors, CachesThatWereOffStayOff) {
  Chip chip;
  chip.flash.acr.value = 0x105;
  EXPECT_TRUE(chip.sectors.program(0, 0, 1));
  EXPECT_EQ(chip.flash.acr.value, 0x105U);
}

}  // namespace kmax::drivers::stm32f4::flash_sectors_test
