#include "drivers/stm32f4/can_bit_timing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace kmax::drivers::stm32f4::can_bit_timing_test {

constexpr std::uint32_t board_clock = 42'000'000;

TEST(CanBitTiming, RatesOfTheBoardAreExactAndWithinCia301) {
  for (const std::uint32_t rate : {125'000U, 250'000U, 500'000U, 1'000'000U}) {
    const auto solution = solve_can_bit_timing(board_clock, rate);
    ASSERT_TRUE(solution.usable) << rate;
    EXPECT_TRUE(solution.timing.valid());
    EXPECT_EQ(solution.rate_error_ppm, 0U) << rate;
    EXPECT_GE(solution.timing.sample_point_permille(), 850U) << rate;
    EXPECT_LE(solution.timing.sample_point_permille(), 900U) << rate;
  }
}

TEST(CanBitTiming, WordsOfTheRegister) {
  // RM0090, CAN bit timing register: all fields minus one. The vendor's 1 Mbit/s setting, 2, 16, 4, 4.
  constexpr CanBitTiming vendor{2, 16, 4, 4};
  static_assert(vendor.btr() == 0x033F'0001);
  static_assert(vendor.sample_point_permille() == 810);
  EXPECT_EQ(solve_can_bit_timing(board_clock, 1'000'000, {.sample_point_permille = 810}).timing, vendor);
  EXPECT_EQ((CanBitTiming{1024, 16, 8, 4}.btr()), 0x037F'03FFU);
}

TEST(CanBitTiming, NothingBetterExists) {
  for (const std::uint32_t clock : {16'000'000U, 36'000'000U, 42'000'000U, 45'000'000U}) {
    for (const std::uint32_t rate : {10'000U, 83'333U, 125'000U, 250'000U, 500'000U, 800'000U, 1'000'000U}) {
      const auto solution = solve_can_bit_timing(clock, rate);
      for (std::uint32_t prescaler = 1; prescaler <= 1024; ++prescaler) {
        for (std::uint32_t quanta = 4; quanta <= 25; ++quanta) {
          const double made = static_cast<double>(clock) / (prescaler * quanta);
          const double error = std::abs(made - rate) / rate * 1e6;
          ASSERT_GE(error * 1.01 + 2, solution.rate_error_ppm) << clock << " " << rate;
        }
      }
    }
  }
}

// Wherever the rate can be had exactly: of all timings that do, none samples nearer to where it is wanted.
TEST(CanBitTiming, NoExactTimingSamplesNearer) {
  const auto off = [](unsigned a, unsigned b) { return a > b ? a - b : b - a; };
  for (const std::uint32_t clock : {16'000'000U, 36'000'000U, 42'000'000U}) {
    for (const std::uint32_t rate : {125'000U, 250'000U, 500'000U, 1'000'000U}) {
      for (const std::uint16_t goal :
           std::initializer_list<std::uint16_t>{500, 600, 667, 750, 810, 875, 950}) {
        const auto solution = solve_can_bit_timing(clock, rate, {.sample_point_permille = goal});
        unsigned least = 1000;
        for (std::uint32_t segment_1 = 1; segment_1 <= 16; ++segment_1) {
          for (std::uint32_t segment_2 = 1; segment_2 <= 8; ++segment_2) {
            const std::uint32_t quanta = 1 + segment_1 + segment_2;
            if (clock % (rate * quanta) == 0 && clock / (rate * quanta) <= 1024)
              least = std::min(least, off(1000 * (1 + segment_1) / quanta, goal));
          }
        }
        EXPECT_EQ(solution.rate_error_ppm, 0U);
        EXPECT_LE(off(solution.sample_error_permille, least), 1U) << clock << ' ' << rate << ' ' << goal;
        EXPECT_LE(off(off(solution.timing.sample_point_permille(), goal), least), 1U) << clock << ' ' << rate;
      }
    }
  }
}

TEST(CanBitTiming, OutsideOfToleranceIsNotUsable) {
  EXPECT_FALSE(solve_can_bit_timing(board_clock, 800'000).usable) << "52.5 clocks a bit";
  EXPECT_TRUE(solve_can_bit_timing(board_clock, 800'000, {.rate_tolerance_ppm = 20'000}).timing.valid());
  EXPECT_FALSE(solve_can_bit_timing(board_clock, 1'000'000, {.sample_point_permille = 990}).usable);
  EXPECT_FALSE(solve_can_bit_timing(board_clock, 2'000'000).usable);
  EXPECT_FALSE(solve_can_bit_timing(board_clock, 0).usable);
  EXPECT_FALSE(solve_can_bit_timing(0, 500'000).usable);
  EXPECT_FALSE(solve_can_bit_timing(2'000'000, 1'000'000).usable) << "two clocks are no bit";
  EXPECT_TRUE(solve_can_bit_timing(168'000'000, 10'000).usable);
  EXPECT_FALSE(solve_can_bit_timing(168'000'001, 500'000).usable);
  EXPECT_FALSE(solve_can_bit_timing(board_clock, 9'999).usable);
  EXPECT_FALSE(solve_can_bit_timing(board_clock, 1'000'001).usable);
}

// Three clocks a bit at best are four at 750 kbit/s, a quarter too slow; what is farther off is no solution.
TEST(CanBitTiming, ToleranceIsInclusiveUpToAQuarterOfTheRate) {
  CanBitTimingGoal goal{
      .sample_point_permille = 770, .sample_point_tolerance_permille = 20, .rate_tolerance_ppm = 250'000};
  const auto solution = solve_can_bit_timing(3'000'000, 1'000'000, goal);
  EXPECT_TRUE(solution.usable);
  EXPECT_EQ(solution.timing, (CanBitTiming{1, 2, 1, 1}));
  EXPECT_EQ(solution.rate_error_ppm, 250'000U);
  EXPECT_EQ(solution.sample_error_permille, 20U);
  goal.rate_tolerance_ppm = 249'999;
  EXPECT_FALSE(solve_can_bit_timing(3'000'000, 1'000'000, goal).usable);
  goal.rate_tolerance_ppm = 1'000'000;
  EXPECT_TRUE(solve_can_bit_timing(3'000'000, 1'000'000, goal).usable);
  EXPECT_FALSE(solve_can_bit_timing(2'999'999, 1'000'000, goal).usable);
  goal.sample_point_tolerance_permille = 19;
  EXPECT_FALSE(solve_can_bit_timing(3'000'000, 1'000'000, goal).usable);
}

TEST(CanBitTiming, ARateThatIsNotExactIsNeverCalledSo) {
  const auto solution = solve_can_bit_timing(board_clock + 1, 1'000'000, {.rate_tolerance_ppm = 0});
  EXPECT_EQ(solution.rate_error_ppm, 1U);
  EXPECT_FALSE(solution.usable);
  EXPECT_TRUE(solve_can_bit_timing(board_clock, 1'000'000, {.rate_tolerance_ppm = 0}).usable);
}

TEST(CanBitTiming, UsesTheWholeRangeOfThePrescalerAndNothingBeyond) {
  const auto last = solve_can_bit_timing(1024 * 160'000, 10'000);
  EXPECT_EQ(last.timing, (CanBitTiming{1024, 13, 2, 2}));
  EXPECT_EQ(last.rate_error_ppm, 0U);
  const auto beyond = solve_can_bit_timing(1025 * 160'000, 10'000);
  EXPECT_EQ(beyond.timing, (CanBitTiming{820, 16, 3, 3})) << "16 quanta would sample where it is wanted";
  EXPECT_EQ(beyond.sample_error_permille, 25U);
}

TEST(CanBitTiming, TheJumpIsAsWideAsTheSecondSegmentUpToFour) {
  for (const std::uint32_t sample_point : {875U, 800U, 750U, 700U, 600U, 500U}) {
    const auto timing =
        solve_can_bit_timing(board_clock, 250'000, {.sample_point_permille = sample_point}).timing;
    EXPECT_EQ(timing.jump_width, std::min<int>(timing.segment_2, 4)) << sample_point;
  }
}

TEST(CanBitTiming, ValidKnowsTheFields) {
  EXPECT_FALSE((CanBitTiming{}.valid()));
  EXPECT_TRUE((CanBitTiming{1, 1, 1, 1}.valid()));
  EXPECT_TRUE((CanBitTiming{1024, 16, 8, 4}.valid()));
  EXPECT_FALSE((CanBitTiming{0, 1, 1, 1}.valid()));
  EXPECT_FALSE((CanBitTiming{1025, 16, 8, 4}.valid()));
  EXPECT_FALSE((CanBitTiming{1, 0, 1, 1}.valid()));
  EXPECT_FALSE((CanBitTiming{1, 17, 8, 4}.valid()));
  EXPECT_FALSE((CanBitTiming{1, 1, 0, 0}.valid()));
  EXPECT_FALSE((CanBitTiming{1, 16, 9, 4}.valid()));
  EXPECT_FALSE((CanBitTiming{1, 16, 8, 0}.valid()));
  EXPECT_FALSE((CanBitTiming{1, 16, 8, 5}.valid()));
  EXPECT_FALSE((CanBitTiming{1, 5, 1, 2}.valid())) << "jump wider than the segment that is shortened";
}

}  // namespace kmax::drivers::stm32f4::can_bit_timing_test
