#include "drivers/stm32f4/tick_watch.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::stm32f4::tick_watch_test {

std::uint32_t address_of(const volatile void* target) {
  return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(target));
}

// Each stream as RM0090 numbers it: CHSEL, very high, words, circular, to a peripheral, EN.
constexpr std::uint32_t control(std::uint32_t channel) {
  return channel << 25 | 3U << 16 | 2U << 13 | 2U << 11 | 1U << 8 | 1U << 6 | 1U;
}

TEST(TickWatch, WiresTheFollowersTurnsAndComparisonsToBothBridges) {
  TimerRegisters leader{}, follower{};
  DmaRegisters dma{};
  TickWatch<> watch{leader, follower, dma};
  follower.bdtr = 0xBC15;
  watch.start(4200);
  EXPECT_EQ(dma.stream[1].cr, control(7)) << "TIM8_UP";
  EXPECT_EQ(dma.stream[1].par, address_of(&follower.ccr[3]));
  EXPECT_EQ(dma.stream[7].cr, control(7)) << "TIM8_CH4";
  EXPECT_EQ(dma.stream[7].par, address_of(&leader.egr));
  EXPECT_EQ(dma.stream[4].cr, control(6)) << "TIM1_CH4";
  EXPECT_EQ(dma.stream[4].par, address_of(&follower.bdtr));
  for (const unsigned stream : {1, 4, 7}) EXPECT_EQ(dma.stream[stream].ndtr, 1U);
  for (const unsigned stream : {0, 2, 3, 5, 6}) EXPECT_EQ(dma.stream[stream].cr, 0U);
  EXPECT_EQ(leader.dier, 1U << 12) << "CC4DE";
  EXPECT_EQ(follower.dier, 1U << 12 | 1U << 8) << "CC4DE, UDE";
}

TEST(TickWatch, CarriesTheMiddleABreakOfOneBridgeAndTheOffOfTheOther) {
  TimerRegisters leader{}, follower{};
  DmaRegisters dma{};
  TickWatch<> watch{leader, follower, dma};
  follower.bdtr = 0xBC15;
  watch.start(4200);
  // The words are the watch's own; the register holds the lower half of their address on this host.
  const auto carried = [&](unsigned stream) {
    const auto own = reinterpret_cast<std::uintptr_t>(&watch);
    const std::uint32_t offset = dma.stream[stream].m0ar - address_of(&watch);
    EXPECT_LT(offset, sizeof(watch));
    return *reinterpret_cast<const std::uint32_t*>(own + offset);
  };
  EXPECT_EQ(carried(1), 2100U);
  EXPECT_EQ(carried(4), 0x3C15U) << "without MOE";
  EXPECT_EQ(carried(7), 1U << 7 | 1U << 4) << "BG, CC4G";
}

TEST(TickWatch, ATickPutsTheComparisonOutOfReach) {
  TimerRegisters leader{}, follower{};
  DmaRegisters dma{};
  TickWatch<> watch{leader, follower, dma};
  watch.start(4200);
  watch.ISR_tick();
  EXPECT_EQ(follower.ccr[3], 0xFFFFU);
  EXPECT_EQ(leader.ccr[3], 0U);
}

}  // namespace kmax::drivers::stm32f4::tick_watch_test
