#include "drivers/stm32f4/dead_time.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <type_traits>

namespace kmax::drivers::stm32f4::dead_time_test {

// RM0090, TIMx_BDTR, DTG: its four lines, written out with the manual's own symbols.
std::uint32_t by_the_manual(std::uint32_t dtg) {
  const std::uint32_t top = dtg >> 5;
  if (top < 4) return dtg;                       // DTG[7:5] = 0xx: DTG[7:0] * tDTS
  if (top < 6) return (64 + (dtg & 0x3F)) * 2;   // 10x: (64 + DTG[5:0]) * 2 tDTS
  if (top == 6) return (32 + (dtg & 0x1F)) * 8;  // 110: (32 + DTG[4:0]) * 8 tDTS
  return (32 + (dtg & 0x1F)) * 16;               // 111: (32 + DTG[4:0]) * 16 tDTS
}

TEST(DeadTime, EveryCodeMeansWhatTheManualSays) {
  for (unsigned code = 0; code < 256; ++code) {
    EXPECT_EQ(dead_time_ticks(static_cast<std::uint8_t>(code)), by_the_manual(code)) << code;
  }
}

TEST(DeadTime, SolverFindsTheShortestThatIsLongEnough) {
  for (std::uint32_t wanted = 1; wanted <= longest_dead_time_ticks; ++wanted) {
    std::uint32_t shortest = longest_dead_time_ticks;
    for (unsigned code = 0; code < 256; ++code) {
      if (by_the_manual(code) >= wanted && by_the_manual(code) < shortest) shortest = by_the_manual(code);
    }
    const auto code = dead_time_code(wanted);
    ASSERT_TRUE(code.has_value()) << wanted;
    EXPECT_EQ(by_the_manual(*code), shortest) << wanted;
  }
}

TEST(DeadTime, RefusesNoneAndTooLong) {
  EXPECT_FALSE(dead_time_code(0));
  EXPECT_FALSE(dead_time_code(1009));
  EXPECT_FALSE(dead_time_code(0xFFFF'FFFF));
  EXPECT_EQ(dead_time_code(1008), 255);
}

TEST(DeadTime, NanosecondsRoundUp) {
  EXPECT_EQ(ticks_not_shorter_than(168'000'000, 119), 20U);
  EXPECT_EQ(ticks_not_shorter_than(168'000'000, 120), 21U);
  EXPECT_EQ(ticks_not_shorter_than(168'000'000, 1'000), 168U);
  EXPECT_EQ(ticks_not_shorter_than(168'000'000, 0), 0U);
  EXPECT_EQ(ticks_not_shorter_than(0xFFFF'FFFF, 1'000'000'000), 0xFFFF'FFFFU);
  EXPECT_EQ(ticks_not_shorter_than(0x8000'0000, 2'000'000'000), 0xFFFF'FFFFU) << "one tick more does not fit";
  EXPECT_EQ(ticks_not_shorter_than(0xFFFF'FFFF, 0xFFFF'FFFF), 0xFFFF'FFFFU) << "saturates";
}

// A template parameter so that asking is not an error.
template <std::uint32_t nanoseconds>
concept Solvable = requires {
  typename std::integral_constant<std::uint8_t, dead_time_code_for(168'000'000, nanoseconds)>;
};

TEST(DeadTime, DoesNotCompileOutOfRange) {
  static_assert(dead_time_code_for(168'000'000, 120) == 21);
  static_assert(Solvable<1>);
  static_assert(Solvable<6000>);
  static_assert(!Solvable<0>);
  static_assert(!Solvable<6001>, "6 us are 1008 ticks");
}

}  // namespace kmax::drivers::stm32f4::dead_time_test
