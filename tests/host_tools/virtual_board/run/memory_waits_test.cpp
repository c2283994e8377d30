#include "host_tools/virtual_board/run/memory_waits.hpp"

#include <gtest/gtest.h>

namespace kmax::virtual_board::memory_waits_test {

constexpr std::uint32_t in_flash = 0x0800'C000, at_zero = 0x4000, sram1 = 0x2000'4000, sram2 = 0x2001'C000,
                        ccm = 0x1000'0000, registers = 0x4001'0000;

TEST(MemoryWaits, CodeInSramWaitsForNothing) {
  MemoryWaits waits;
  for (std::uint32_t n = 0; n < 1'000; ++n) waits.fetch(at_zero + 4 * n, 4, n);
  EXPECT_EQ(waits.for_flash() + waits.for_sram() + waits.flash_reads(), 0U);
}

TEST(MemoryWaits, DataWhereTheCodeIsFetchedFromCostACycle) {
  MemoryWaits waits;
  for (const std::uint32_t other : {sram2, ccm, registers}) waits.access(other, at_zero, 0);
  EXPECT_EQ(waits.for_sram(), 0U);
  waits.access(sram1, in_flash, 0);
  EXPECT_EQ(waits.for_sram(), 0U) << "the code comes from elsewhere";
  waits.access(sram1, at_zero, 0);
  waits.access(sram2 - 4, at_zero, 0);
  waits.access(at_zero + 0x100, at_zero, 0);  // a literal
  EXPECT_EQ(waits.for_sram(), 3U);
  EXPECT_EQ(waits.for_flash(), 0U);
}

TEST(MemoryWaits, FlashIsReadByInstructionsAndData) {
  MemoryWaits waits;
  waits.fetch(in_flash, 4, 0);
  EXPECT_EQ(waits.for_flash(), 5U) << "wait states";
  const std::uint64_t before = waits.for_flash();
  waits.access(in_flash + 0x1000, at_zero, 100);
  EXPECT_EQ(waits.for_flash() - before, 5U);
  waits.access(in_flash + 0x1004, at_zero, 200);
  EXPECT_EQ(waits.for_flash() - before, 5U) << "the same line";
  EXPECT_EQ(waits.flash_reads(), 3U);
  EXPECT_EQ(waits.for_flash_if_all_kept(), waits.for_flash());
}

}  // namespace kmax::virtual_board::memory_waits_test
