// RM0090, Adaptive real-time memory accelerator, by hand.
#include "host_tools/virtual_board/run/flash_accelerator.hpp"

#include <gtest/gtest.h>

namespace kmax::virtual_board::flash_accelerator_test {

constexpr std::uint32_t code = 0x0800'C000;

TEST(FlashAccelerator, AJumpWaitsAndWhatFollowsIsPrefetched) {
  FlashAccelerator flash;
  EXPECT_EQ(flash.fetch(code, 2, 0), 5U);
  std::uint64_t now = 6;
  for (std::uint32_t at = code + 2; at < code + 16; at += 2, ++now) EXPECT_EQ(flash.fetch(at, 2, now), 0U);
  EXPECT_EQ(flash.fetch(code + 16, 2, now), 0U)
      << "eight short instructions hide the six cycles of the next line";
  now += 4;
  EXPECT_EQ(flash.fetch(code + 32, 2, now), 2U) << "four long ones do not";
}

TEST(FlashAccelerator, KeepsWhatItMissedAndInOneReadingWhatItPrefetched) {
  for (const auto kept : {FlashAccelerator::Kept::missed, FlashAccelerator::Kept::all}) {
    FlashAccelerator flash(kept);
    static_cast<void>(flash.fetch(code, 2, 0));
    static_cast<void>(flash.fetch(code + 16, 2, 100));
    static_cast<void>(flash.fetch(code + 0x400, 2, 200));
    EXPECT_EQ(flash.fetch(code, 2, 300), 0U);
    static_cast<void>(flash.fetch(code + 0x400, 2, 400));
    EXPECT_EQ(flash.fetch(code + 16, 2, 500), kept == FlashAccelerator::Kept::all ? 0U : 5U);
  }
}

TEST(FlashAccelerator, ForgetsTheLineThatWasNotUsedForLongest) {
  FlashAccelerator flash;
  for (std::uint32_t line = 0; line < 65; ++line)
    static_cast<void>(flash.fetch(code + 64 * line, 2, 100 * line));
  EXPECT_EQ(flash.fetch(code + 64, 2, 10'000), 0U);
  EXPECT_EQ(flash.fetch(code, 2, 20'000), 5U);
}

TEST(FlashAccelerator, AnInstructionAcrossTwoLinesNeedsBoth) {
  FlashAccelerator flash;
  EXPECT_EQ(flash.fetch(code + 14, 4, 0), 5U + 6U);
}

TEST(FlashAccelerator, KeepsEightLinesOfData) {
  FlashAccelerator flash;
  for (std::uint32_t line = 0; line < 8; ++line) EXPECT_EQ(flash.load(code + 16 * line, 100 * line), 5U);
  EXPECT_EQ(flash.load(code + 12, 1000), 0U);
  EXPECT_EQ(flash.load(code + 16 * 8, 1100), 5U);
  EXPECT_EQ(flash.load(code + 16, 1200), 5U) << "the second went";
}

}  // namespace kmax::virtual_board::flash_accelerator_test
