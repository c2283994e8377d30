// drivers/stm32f4/flash_sectors.hpp on the model of the flash: the parameter sectors 1 and 2.
#include "drivers/stm32f4/flash_sectors.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <memory>

#include "tests/host_tools/virtual_board/cortex_m/system_on_model.hpp"

namespace kmax::virtual_board::flash_sectors_on_model_test {
namespace {

namespace stm32 = drivers::stm32f4;
using stm32::FlashResult;
using testing::FlashOnModel;

/// A word of flash memory as the processor sees it on the bus.
class WordOnModel {
 public:
  testing::SystemOnModel* chip = nullptr;
  std::uint32_t address = 0;

  explicit operator std::uint32_t() const { return chip->flash.load(address, 4, chip->bus.now); }
  WordOnModel& operator=(std::uint32_t word) {
    chip->flash.store(address, 4, word, chip->bus.now);
    chip->bus.finish_access();
    return *this;
  }
};

using Sectors = stm32::FlashSectors<FlashOnModel, WordOnModel>;

struct Chip : testing::SystemOnModel {
  std::vector<WordOnModel> words{2 * Sectors::words_per_sector};
  std::unique_ptr<Sectors> sectors;
  BoardTime stalled = 0;

  Chip() {
    for (std::size_t i = 0; i < words.size(); ++i) {
      words[i].chip = this;
      words[i].address = static_cast<std::uint32_t>(0x0800'4000 + 4 * i);
    }
    std::ranges::fill(image, std::uint8_t{0x5A});
    flash_registers.acr = 0x705;
    // The core fetches from flash: it gets its next instruction when the flash is free.
    bus.after_access = [this] {
      if (flash.busy_until() <= bus.now) return;
      stalled += flash.busy_until() - bus.now;
      bus.now = flash.busy_until();
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
  Chip chip;
  ASSERT_TRUE(chip.sectors->erase(1));
  EXPECT_TRUE(chip.all(0, 0x8000, 0x5A));
  EXPECT_TRUE(chip.all(0x8000, 0xC000, 0xFF));
  EXPECT_TRUE(chip.all(0xC000, chip.image.size(), 0x5A));
  EXPECT_NEAR(seconds(chip.stalled), 0.25, 1e-3);
}

TEST(FlashSectorsOnModel, EraseProgramReadBackWholeSectors) {
  Chip chip;
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
  Chip chip;
  EXPECT_THROW(chip.flash_registers.keyr = 0x1234, RefusedAccess);
  EXPECT_FALSE(chip.sectors->erase(0));
  EXPECT_EQ(chip.sectors->result(), FlashResult::locked);
  chip.flash.reset(chip.bus.now);
  EXPECT_TRUE(chip.sectors->erase(0)) << "a reset unlocks the keys";
}

TEST(FlashSectorsOnModel, ProtectedSectorIsNamedAndTheNextOneStillWorks) {
  Chip chip;
  chip.flash.set_write_protected(1, true);
  EXPECT_FALSE(chip.sectors->erase(0));
  EXPECT_EQ(chip.sectors->result(), FlashResult::write_protected);
  EXPECT_TRUE(chip.sectors->erase(1));
}

TEST(FlashSectorsOnModel, TakesOverARegisterThatWasLeftUnlocked) {
  Chip chip;
  // Found unlocked and with PSIZE x8: the driver sets its own.
  chip.flash_registers.keyr = stm32::flash_key_1;
  chip.flash_registers.keyr = stm32::flash_key_2;
  chip.flash_registers.cr = 0;
  ASSERT_TRUE(chip.sectors->erase(0));
  EXPECT_TRUE(chip.sectors->program(0, 0, 0x1234'5678));
}

// The power goes in the n-th operation: what is torn is confined to that operation's words.
RC_GTEST_PROP(FlashSectorsOnModel, PowerCutTearsOneOperation, (std::uint64_t seed)) {
  const auto operation = *rc::gen::inRange<std::uint64_t>(1, 12);
  Chip chip;
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

  chip.flash.power_up(chip.bus.now);
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

}  // namespace
}  // namespace kmax::virtual_board::flash_sectors_on_model_test
