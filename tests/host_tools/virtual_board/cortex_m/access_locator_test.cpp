#include "host_tools/virtual_board/cortex_m/access_locator.hpp"

#include <gtest/gtest.h>

#include <array>

namespace kmax::virtual_board::access_locator_test {
namespace {

constexpr std::uint32_t address = 0x0800'1000;
// str r1, [r0]; vldr s0, [r0, #8]; ldmia r0!, {r2, r3}; bne
constexpr std::array<std::uint8_t, 10> code{0x01, 0x60, 0x90, 0xED, 0x02, 0x0A, 0x0C, 0xC8, 0xFE, 0xD1};

TEST(AccessLocator, FindsTheInstructionByItsEffectiveAddress) {
  BlockTable table;
  const Block& block = table.add(address, code);
  AccessLocator locator;
  locator.begin_block(block);
  const auto registers = [](unsigned) { return 0x4000'0000U; };
  EXPECT_EQ(locator.locate(0x4000'0000, true, registers), &block.memory[0]);
  EXPECT_EQ(locator.locate(0x4000'0000, true, registers), nullptr) << "there is no second store";
  EXPECT_EQ(locator.locate(0x4000'0008, false, registers), &block.memory[1]);
  EXPECT_EQ(locator.locate(0x4000'0000, false, registers), &block.memory[2]);
  const auto changed = [](unsigned) { return 0x1234U; };
  EXPECT_EQ(locator.locate(0x4000'0004, false, changed), &block.memory[2]) << "second word, base overwritten";
  EXPECT_FALSE(locator.is_piece(4));
  EXPECT_EQ(locator.locate(0x4000'0008, false, changed), nullptr);
  locator.begin_block(block);
  EXPECT_EQ(locator.locate(0x4000'0002, true, registers), &block.memory[0]);
  EXPECT_TRUE(locator.is_piece(2));
}

}  // namespace
}  // namespace kmax::virtual_board::access_locator_test
