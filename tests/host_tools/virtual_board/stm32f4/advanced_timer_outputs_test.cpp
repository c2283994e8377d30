// Against RM0090, chapter Advanced-control timers (TIM1&TIM8); section titles stand with the tests. The
// outputs and what switches them off.

#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "drivers/stm32f4/interrupts.hpp"
#include "tests/host_tools/virtual_board/stm32f4/advanced_timer_bench.hpp"

namespace kmax::virtual_board::advanced_timer_outputs_test {
namespace {

using namespace testing;
using Bench = AdvancedTimerBench;
using drivers::stm32f4::Interrupt;

// "PWM mode", TIMx_CCMR1 OCxPE: the duty changes at the next turn, not before, and tells that it did.
TEST(AdvancedTimerModel, DutyIsPreloadedUntilTheNextTurn) {
  Bench bench;
  bench.timer.ccr[1] = 1000;
  bench.pwm(4000);
  bench.run(10 * tick);
  bench.timer.ccr[1] = 3000;
  bench.run(3989 * tick);
  EXPECT_EQ(bench.model.outputs()[1].high_duty, 0.75);
  EXPECT_TRUE(bench.changes.empty());
  bench.run(tick);
  EXPECT_EQ(bench.model.outputs()[1].high_duty, 0.25) << "overflow";
  EXPECT_EQ(bench.changes, std::vector<BoardTime>{1000 + 4000 * tick});
  bench.timer.ccr[1] = 4000;
  bench.run(3999 * tick);
  EXPECT_EQ(bench.model.outputs()[1].high_duty, 0.25);
  bench.run(tick);
  EXPECT_EQ(bench.model.outputs()[1].high_duty, 0.0) << "underflow";
  bench.timer.ccr[1] = 65535;
  bench.run(4000 * tick);
  EXPECT_EQ(bench.model.outputs()[1].high_duty, 0.0) << "a compare value above ARR is never reached";
}

TEST(AdvancedTimerModel, DutyWithoutPreloadIsImmediate) {
  Bench bench;
  bench.pwm(4000, pwm2_direct);
  bench.run(10 * tick);
  bench.timer.ccr[0] = 1000;
  EXPECT_EQ(bench.model.outputs()[0].high_duty, 0.75);
  EXPECT_EQ(bench.changes, std::vector<BoardTime>{bench.now});
}

TEST(AdvancedTimerModel, PwmMode1IsTheInverse) {
  Bench bench;
  bench.timer.ccr[2] = 1000;
  bench.pwm(4000, 0x6868);
  EXPECT_EQ(bench.model.outputs()[2].high_duty, 0.25);
}

// Table "Output control bits for complementary OCx and OCxN channels with break feature".
TEST(AdvancedTimerModel, MainOutputEnableAndChannelEnablesDecide) {
  Bench bench;
  bench.pwm(4200);
  for (const PwmLegOutput& leg : bench.model.outputs()) {
    EXPECT_TRUE(leg.enabled);
    EXPECT_DOUBLE_EQ(leg.dead_time, 21.0 / 168e6);
  }
  bench.timer.ccer = all_legs & ~0xFU;
  EXPECT_FALSE(bench.model.outputs()[0].enabled);
  EXPECT_TRUE(bench.model.outputs()[1].enabled);
  bench.run(123);
  bench.changes.clear();
  bench.timer.bdtr = ossi_ossr | bke | bkp | 21;
  for (const PwmLegOutput& leg : bench.model.outputs()) EXPECT_FALSE(leg.enabled);
  EXPECT_EQ(bench.changes, std::vector<BoardTime>{bench.now}) << "at once, not at an update event";
  EXPECT_FALSE(bench.model.moe());
}

// TIMx_BDTR, DTG; TIMx_CR1, CKD: the dead-time clock.
TEST(AdvancedTimerModel, DeadTimeFollowsCodeAndClockDivision) {
  struct Row {
    std::uint32_t code;
    double ticks;
  };
  for (const Row& row : {Row{1, 1}, Row{127, 127}, Row{128, 128}, Row{191, 254}, Row{192, 256}, Row{223, 504},
                         Row{224, 512}, Row{255, 1008}}) {
    Bench bench;
    bench.pwm(4200);
    bench.timer.bdtr = ossi_ossr | moe | row.code;
    EXPECT_DOUBLE_EQ(bench.model.outputs()[0].dead_time, row.ticks / 168e6);
    bench.timer.cr1 = static_cast<std::uint32_t>(bench.timer.cr1) | 2U << 8;
    EXPECT_DOUBLE_EQ(bench.model.outputs()[0].dead_time, 4 * row.ticks / 168e6);
  }
}

// "Using the break function": the break clears MOE at once; with AOE = 0 only software sets it again.
TEST(AdvancedTimerModel, ClockFailureBreaksTheOutputs) {
  Bench bench;
  bench.pwm(4200);
  bench.timer.dier = 1U << 7;
  bench.run(77);
  bench.model.clock_failure_break(bench.now);
  EXPECT_FALSE(bench.model.moe());
  EXPECT_EQ(bench.changes, std::vector<BoardTime>{bench.now});
  EXPECT_TRUE(bench.interrupts.level(Interrupt::tim1_brk_tim9));
  bench.timer.sr = ~(1U << 7);
  EXPECT_FALSE(bench.interrupts.level(Interrupt::tim1_brk_tim9));
  bench.run(10 * 4200 * tick);
  EXPECT_FALSE(bench.model.moe());
  bench.timer.bdtr = ossi_ossr | bke | bkp | moe | 21;
  EXPECT_TRUE(bench.model.moe());
  bench.timer.egr = 1U << 7;
  EXPECT_FALSE(bench.model.moe()) << "BG";
}

TEST(AdvancedTimerModel, BreakNeedsItsEnableAndAutomaticOutputReturnsAtTheUpdate) {
  Bench bench;
  bench.pwm(4200);
  bench.timer.bdtr = ossi_ossr | moe | 21;
  bench.model.clock_failure_break(bench.now);
  EXPECT_TRUE(bench.model.moe()) << "BKE = 0";
  bench.timer.bdtr = ossi_ossr | bke | bkp | aoe | moe | 21;
  bench.run(100 * tick);
  bench.model.clock_failure_break(bench.now);
  EXPECT_FALSE(bench.model.moe());
  bench.run(4099 * tick);
  EXPECT_FALSE(bench.model.moe());
  bench.run(tick);
  EXPECT_TRUE(bench.model.moe());
}

// TIMx_BDTR, LOCK: the first write decides until reset.
TEST(AdvancedTimerModel, LockFreezesWhatItsLevelSays) {
  Bench bench;
  bench.timer.bdtr = 2U << 8 | ossi_ossr | bke | bkp | 21;
  bench.timer.bdtr = 0;
  EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.bdtr), 2U << 8 | ossi_ossr | bke | bkp | 21);
  bench.timer.bdtr = moe;
  EXPECT_TRUE(bench.model.moe()) << "MOE is never locked";
  bench.model.reset(bench.now);
  bench.timer.bdtr = 1U << 8 | ossi_ossr | 21;
  bench.timer.bdtr = 3U << 8 | 50;
  EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.bdtr), 1U << 8 | 21U) << "level 1 leaves OSSI and OSSR";
  bench.model.reset(bench.now);
  bench.timer.bdtr = 0;
  bench.timer.bdtr = 3U << 8 | 50;
  EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.bdtr), 50U) << "level 0 is a decision too";
  bench.model.reset(bench.now);
  bench.timer.ccmr[0] = pwm2_preloaded;
  bench.timer.bdtr = 3U << 8;
  bench.timer.ccmr[0] = 0x6868;
  EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.ccmr[0]), pwm2_preloaded);
}

// A stopped counter compares as well: mode 2 is active while counting up for CNT >= CCR.
TEST(AdvancedTimerModel, StoppedCounterFreezesTheOutputs) {
  Bench bench;
  bench.timer.ccr[0] = 0;
  bench.timer.ccr[1] = 1;
  bench.pwm(4200);
  bench.timer.cr1 = static_cast<std::uint32_t>(bench.timer.cr1) & ~cen;
  EXPECT_EQ(bench.model.outputs()[0].high_duty, 1.0) << "CNT = CCR = 0";
  EXPECT_EQ(bench.model.outputs()[1].high_duty, 0.0);
  bench.timer.cnt = 1;
  EXPECT_EQ(bench.model.outputs()[1].high_duty, 1.0);
}

}  // namespace
}  // namespace kmax::virtual_board::advanced_timer_outputs_test
