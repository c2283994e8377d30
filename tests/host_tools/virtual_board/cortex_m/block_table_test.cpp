#include "host_tools/virtual_board/cortex_m/block_table.hpp"

#include <gtest/gtest.h>

#include <array>
#include <stdexcept>
#include <vector>

namespace kmax::virtual_board::block_table_test {

constexpr std::uint32_t address = 0x0800'1000;
// str r1, [r0]; vldr s0, [r0, #8]; ldmia r0!, {r2, r3}; bne
constexpr std::array<std::uint8_t, 10> code{0x01, 0x60, 0x90, 0xED, 0x02, 0x0A, 0x0C, 0xC8, 0xFE, 0xD1};

TEST(BlockTable, AddsUpABlock) {
  BlockTable table;
  EXPECT_EQ(table.find(address, code.size()), nullptr);
  const Block& block = table.add(address, code);
  EXPECT_EQ(table.find(address, code.size()), &block);
  EXPECT_EQ(block.instructions, 4U);
  EXPECT_EQ(block.cycles, 1U + 2 + 3 + 1);
  EXPECT_EQ(block.cycles_if_taken, 2U);
  EXPECT_EQ(block.floating_point, 1U);
  EXPECT_EQ(first_floating_point(address, code), address + 2);
  const auto memory = table.memory_instructions(block);
  ASSERT_EQ(memory.size(), 3U);
  EXPECT_EQ(memory[1].position, 2);
  EXPECT_EQ(memory[1].instructions, 2);
  EXPECT_EQ(memory[1].cycles, 3U);
  EXPECT_EQ(memory[2].cycles, 6U);
}

TEST(BlockTable, TellsBlocksBySizeAndKeepsThoseThatShareASlot) {
  BlockTable table;
  const Block& whole = table.add(address, code);
  const Block& part = table.add(address, std::span(code).first(2));
  const Block& far = table.add(address + (2U << 16), std::span(code).first(6));
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(table.find(address, 10), &whole);
    EXPECT_EQ(table.find(address, 2), &part);
    EXPECT_EQ(table.find(address + (2U << 16), 6), &far);
    EXPECT_EQ(table.find(address, 6), nullptr);
  }
  EXPECT_EQ(part.cycles, 1U);
  EXPECT_EQ(part.floating_point, 0U);
  EXPECT_EQ(table.memory_instructions(part).size(), 1U);
  EXPECT_EQ(table.memory_instructions(far).size(), 2U);
  EXPECT_EQ(far.instructions, 2U);
}

TEST(BlockTable, KeepsMoreBlocksThanHaveSlotsWhereTheyAre) {
  BlockTable table;
  std::vector<const Block*> blocks;
  for (std::uint32_t i = 0; i < 70'000; ++i) blocks.push_back(&table.add(2 * i, std::span(code).first(2)));
  for (std::uint32_t i = 0; i < blocks.size(); ++i) {
    ASSERT_EQ(table.find(2 * i, 2), blocks[i]);
    ASSERT_EQ(blocks[i]->address, 2 * i);
    ASSERT_EQ(table.memory_instructions(*blocks[i]).size(), 1U);
  }
}

TEST(BlockTable, AFullPageOverflowsNoCount) {
  BlockTable table;
  std::vector<std::uint8_t> page;
  for (int i = 0; i < 256; ++i) page.insert(page.end(), {0xB0, 0xEC, 0x20, 0x0A});  // vldmia r0!, {s0-s31}
  const Block& block = table.add(address, page);
  EXPECT_EQ(block.instructions, 256U);
  EXPECT_EQ(block.cycles, 256U * 33);
  std::vector<std::uint8_t> stores;
  for (int i = 0; i < 512; ++i) stores.insert(stores.end(), {0x01, 0x60});
  EXPECT_EQ(table.memory_instructions(table.add(address + 1024, stores)).size(), 512U);
  page.push_back(0);
  EXPECT_THROW(table.add(address, page), std::length_error);
}

TEST(BlockTable, EndsAtACodeThatIsCutOff) {
  BlockTable table;
  EXPECT_EQ(table.add(address, std::span(code).first(4)).instructions, 2U);
  EXPECT_EQ(table.add(address + 100, {}).instructions, 0U);
}

TEST(AccessLocator, FindsTheInstructionByItsEffectiveAddress) {
  BlockTable table;
  const Block& block = table.add(address, code);
  AccessLocator locator;
  const auto memory = table.memory_instructions(block);
  const auto registers = [](unsigned) { return 0x4000'0000U; };
  EXPECT_EQ(locator.locate(memory, 0x4000'0000, true, registers), &memory[0]);
  EXPECT_EQ(locator.locate(memory, 0x4000'0000, true, registers), nullptr) << "there is no second store";
  EXPECT_EQ(locator.locate(memory, 0x4000'0008, false, registers), &memory[1]);
  EXPECT_EQ(locator.locate(memory, 0x4000'0000, false, registers), &memory[2]);
  const auto changed = [](unsigned) { return 0x1234U; };
  EXPECT_EQ(locator.locate(memory, 0x4000'0004, false, changed), &memory[2])
      << "second word, base overwritten";
  EXPECT_FALSE(locator.is_piece(4));
  EXPECT_EQ(locator.locate(memory, 0x4000'0008, false, changed), nullptr);
  locator.begin_block();
  EXPECT_EQ(locator.locate(memory, 0x4000'0002, true, registers), &memory[0]);
  EXPECT_TRUE(locator.is_piece(2));
}

}  // namespace kmax::virtual_board::block_table_test
