// Against RM0090, chapter Advanced-control timers (TIM1&TIM8); section titles stand with the tests. Counting
// first, then the outputs and what switches them off.

#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::advanced_timer_test {

using testing::TimerOnModel;

// Bits as RM0090 draws them, written down a second time on purpose.
constexpr std::uint32_t cen = 1U << 0, udis = 1U << 1, urs = 1U << 2, opm = 1U << 3, dir = 1U << 4,
                        centre = 1U << 5, arpe = 1U << 7;
constexpr std::uint32_t pwm2_preloaded = 0x7878, pwm2_direct = 0x7070, all_legs = 0x555;
constexpr std::uint32_t ossi_ossr = 3U << 10, bke = 1U << 12, bkp = 1U << 13, aoe = 1U << 14, moe = 1U << 15;
constexpr BoardTime tick = 2;  // 168 MHz

/// TIM1 or TIM8 at 168 MHz, and what it has told the board.
struct Bench : testing::ModelBench {
  explicit Bench(AdvancedTimer unit = AdvancedTimer::tim1) : ModelBench({&model}), model(unit, clocks) {
    clocks.apb2_timer = tick;
    model.on_trigger_output([this](BoardTime at) { triggers.push_back(at); });
    model.on_output_change([this](BoardTime at) { changes.push_back(at); });
  }
  void load(std::uint32_t top) {
    timer.cr1 = urs | arpe;
    timer.arr = top;
    timer.egr = 1;
    timer.cr1 = urs | arpe | centre;
    triggers.clear();  // MMS = 0 has shown UG
  }
  void count() { timer.cr1 = static_cast<std::uint32_t>(timer.cr1) | cen; }
  void pwm(std::uint32_t top, std::uint32_t mode = pwm2_preloaded) {
    timer.ccmr[0] = mode;
    timer.ccmr[1] = mode & 0xFF;
    timer.ccer = all_legs;
    load(top);
    count();
    timer.bdtr = ossi_ossr | bke | bkp | moe | 21;
    changes.clear();
  }
  std::uint32_t cnt() { return static_cast<std::uint32_t>(timer.cnt); }
  bool down() { return (static_cast<std::uint32_t>(timer.cr1) & dir) != 0; }
  bool update_flag() { return (static_cast<std::uint32_t>(timer.sr) & 1U) != 0; }

  AdvancedTimerModel model;
  TimerOnModel timer = block_on_model<TimerOnModel>(*this, model);
  std::vector<BoardTime> triggers, changes;
};

// "Center-aligned mode (up/down counting)": 0 to ARR - 1, overflow, ARR to 1, underflow, and so on.
TEST(AdvancedTimerModel, CountsUpAndDownOverTwiceAutoReload) {
  Bench bench;
  bench.load(6);
  bench.count();
  const std::vector<std::uint32_t> expected = {0, 1, 2, 3, 4, 5, 6, 5, 4, 3, 2, 1, 0, 1, 2};
  for (const std::uint32_t count : expected) {
    EXPECT_EQ(bench.cnt(), count) << bench.now;
    const BoardTime phase = (bench.now - 1000) / tick % 12;
    EXPECT_EQ(bench.down(), phase >= 6) << bench.now;
    bench.now += tick;
  }
}

// The same by arithmetic, from far away: no event was seen in between, so turns are made up for.
RC_GTEST_PROP(AdvancedTimerModel, CountIsATriangleOfTime, ()) {
  const auto top = *rc::gen::inRange<std::uint32_t>(1, 65536);
  const auto elapsed = *rc::gen::inRange<BoardTime>(0, 1'000'000'000'000);
  Bench bench;
  bench.load(top);
  bench.count();
  bench.now += elapsed;
  const BoardTime phase = elapsed / tick % (2 * BoardTime{top});
  RC_ASSERT(bench.cnt() == (phase < top ? phase : 2 * BoardTime{top} - phase));
  RC_ASSERT(bench.down() == (phase >= top));
}

// "Center-aligned mode" and TIMx_CR2, MMS = 010: an update event at each over- and underflow.
TEST(AdvancedTimerModel, UpdateTriggersAtBothTurns) {
  Bench bench;
  bench.load(4200);
  bench.timer.cr2 = 2U << 4;
  bench.count();
  bench.run(5 * 4200 * tick);
  ASSERT_EQ(bench.triggers.size(), 5U);
  for (unsigned n = 0; n < 5; ++n) EXPECT_EQ(bench.triggers[n], 1000 + (n + 1) * 4200 * tick);
}

// TIMx_CR2, MMS = 000 and 001.
TEST(AdvancedTimerModel, TriggerOutputShowsUpdateGenerationOrEnable) {
  Bench bench;
  bench.load(100);
  bench.timer.egr = 1;
  EXPECT_EQ(bench.triggers.size(), 1U);
  bench.timer.cr2 = 1U << 4;
  bench.timer.egr = 1;
  EXPECT_EQ(bench.triggers.size(), 1U) << "UG is not shown with MMS = 1";
  bench.count();
  EXPECT_EQ(bench.triggers.size(), 2U);
  bench.run(1000 * tick);
  bench.timer.cr2 = 0;
  EXPECT_EQ(bench.triggers.size(), 2U);
  bench.timer.cr2 = 1U << 4;
  EXPECT_EQ(bench.triggers.size(), 3U) << "the level of CEN comes back: a rising edge";
}

// Figure "Counter timing diagram, update event with ARPE=1 (counter overflow)": the count goes on from the
// new ARR.
TEST(AdvancedTimerModel, AutoReloadIsPreloaded) {
  Bench bench;
  bench.load(0xFD);
  bench.count();
  bench.run(100 * tick);
  bench.timer.arr = 0x36;
  EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.arr), 0x36U) << "reads show the preload";
  bench.run((0xFC - 100) * tick);
  EXPECT_EQ(bench.cnt(), 0xFCU) << "the old one still holds";
  bench.run(tick);
  EXPECT_EQ(bench.cnt(), 0x36U);
  bench.run(0x36 * tick);
  EXPECT_EQ(bench.cnt(), 0U);
}

// TIMx_EGR UG, TIMx_CR1 URS.
TEST(AdvancedTimerModel, SoftwareUpdateRestartsAndLoads) {
  Bench bench;
  bench.load(500);
  EXPECT_FALSE(bench.update_flag()) << "URS = 1";
  bench.count();
  bench.run(700 * tick);
  EXPECT_TRUE(bench.update_flag());
  bench.timer.sr = ~1U;
  EXPECT_FALSE(bench.update_flag());
  EXPECT_TRUE(bench.down());
  bench.timer.cr1 = static_cast<std::uint32_t>(bench.timer.cr1) & ~urs;
  bench.timer.arr = 40;
  bench.timer.egr = 1;
  EXPECT_TRUE(bench.update_flag());
  EXPECT_EQ(bench.cnt(), 0U);
  EXPECT_FALSE(bench.down()) << "up again";
  bench.run(41 * tick);
  EXPECT_EQ(bench.cnt(), 39U) << "the new ARR holds";
}

// "Hints on using center-aligned mode": it starts in the direction that DIR has; UG loads ARR while that is
// down.
TEST(AdvancedTimerModel, StartsDownwardsFromTheTop) {
  Bench bench;
  bench.timer.arr = 300;
  bench.timer.cr1 = arpe | urs | dir;
  bench.timer.egr = 1;
  EXPECT_EQ(bench.cnt(), 300U);
  bench.timer.cr1 = arpe | urs | dir | centre;
  bench.timer.cr1 = arpe | urs | centre;
  EXPECT_TRUE(bench.down()) << "DIR is read-only when centre-aligned";
  bench.count();
  bench.run(1 * tick);
  EXPECT_EQ(bench.cnt(), 299U);
  bench.run(300 * tick);
  EXPECT_EQ(bench.cnt(), 1U);
  EXPECT_FALSE(bench.down());
}

// "TIMx and external trigger synchronization", Slave mode: Trigger mode; TIMx_CR2 MMS = 001.
TEST(AdvancedTimerModel, TriggerStartsTheSlaveOnce) {
  Bench leader;
  Bench follower(AdvancedTimer::tim8);
  leader.model.on_trigger_output([&](BoardTime at) { follower.model.trigger_input(at); });
  leader.load(100);
  follower.load(100);
  follower.timer.smcr = 6;
  leader.timer.cr2 = 1U << 4;
  EXPECT_FALSE((static_cast<std::uint32_t>(follower.timer.cr1) & cen) != 0);
  leader.count();
  EXPECT_TRUE((static_cast<std::uint32_t>(follower.timer.cr1) & cen) != 0);
  EXPECT_TRUE((static_cast<std::uint32_t>(follower.timer.sr) & 1U << 6) != 0) << "TIF";
  follower.now = leader.now = leader.now + 37 * tick;
  EXPECT_EQ(follower.cnt(), leader.cnt());
  follower.timer.cr1 = static_cast<std::uint32_t>(follower.timer.cr1) & ~cen;
  leader.timer.cr1 = static_cast<std::uint32_t>(leader.timer.cr1);
  EXPECT_FALSE((static_cast<std::uint32_t>(follower.timer.cr1) & cen) != 0) << "no new edge, no new start";
}

TEST(AdvancedTimerModel, EventsCostNothingUntilSomebodyLooks) {
  Bench bench;
  bench.pwm(4200);
  EXPECT_EQ(bench.model.next_event(), never) << "nothing waits, nobody listens";
  bench.timer.ccr[0] = 1234;
  EXPECT_EQ(bench.model.next_event(), 1000 + 4200 * tick);
  const auto events_of_ten_periods = [&] {
    const unsigned before = bench.events;
    bench.run(10 * 8400 * tick);
    return bench.events - before;
  };
  EXPECT_EQ(events_of_ten_periods(), 1U) << "one update loads it";
  bench.timer.cr2 = 2U << 4;
  EXPECT_EQ(events_of_ten_periods(), 20U);
  bench.model.on_trigger_output({});
  EXPECT_EQ(events_of_ten_periods(), 0U);
}

TEST(AdvancedTimerModel, RefusesWhatIsNotModelled) {
  const auto refused = [](auto&& action) {
    Bench bench;
    bench.load(100);
    EXPECT_THROW(action(bench), RefusedAccess);
  };
  refused([](Bench& b) { b.timer.cr1 = udis; });
  refused([](Bench& b) { b.timer.cr1 = opm; });
  refused([](Bench& b) { b.timer.cr1 = 3U << 8; });
  refused([](Bench& b) { b.timer.cr1 = arpe | dir; });  // CMS and DIR at once
  refused([](Bench& b) { b.timer.cr1 = arpe | cen; });  // edge-aligned
  refused([](Bench& b) { b.timer.cr2 = 7U << 4; });
  refused([](Bench& b) { b.timer.cr2 = 1U << 8; });  // OIS1
  refused([](Bench& b) { b.timer.smcr = 6; });       // TIM1 has no modelled trigger
  refused([](Bench& b) { b.timer.dier = 1; });       // UIE
  refused([](Bench& b) { b.timer.psc = 1; });
  refused([](Bench& b) { b.timer.rcr = 1; });
  refused([](Bench& b) { b.timer.bdtr = aoe; });
  refused([](Bench& b) { b.timer.ccmr[0] = 0x6868; });  // PWM mode 1
  refused([](Bench& b) { b.timer.ccer = 1; });          // CC1E alone
  refused([](Bench& b) { b.timer.ccer = 7; });          // active low
  refused([](Bench& b) { b.timer.ccmr[1] = 0x6000; });
  refused([](Bench& b) { b.timer.ccmr[0] = 0x30; });  // toggle
  refused([](Bench& b) { b.timer.bdtr = 1U << 16; });
  refused([](Bench& b) { b.timer.arr = 70000; });
  refused([](Bench& b) {
    b.timer.ccer = 5;
    b.timer.bdtr = moe;  // no PWM mode
  });
  refused([](Bench& b) {
    b.timer.cnt = 100;
    b.count();  // already at its turn
  });
  refused([](Bench& b) {
    b.count();
    b.timer.cnt = 5;
  });
  refused([](Bench& b) { b.model.read({0x48, 4, b.now}); });  // DCR
  refused([](Bench& b) { b.model.read({0x00, 2, b.now}); });
}

TEST(AdvancedTimerModel, ResetSwitchesOff) {
  Bench bench;
  bench.pwm(4200);
  bench.run(5000 * tick);
  ASSERT_TRUE(bench.update_flag());
  bench.changes.clear();
  bench.model.reset(bench.now);
  EXPECT_FALSE(bench.model.moe());
  EXPECT_FALSE(bench.model.outputs()[0].enabled);
  EXPECT_EQ(bench.changes, std::vector<BoardTime>{bench.now});
  EXPECT_FALSE(bench.update_flag());
  EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.arr), 0xFFFFU);
  EXPECT_EQ(bench.model.next_event(), never);
}

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

// "Using the break function": the break clears MOE at once; only software sets it again.
TEST(AdvancedTimerModel, ClockFailureBreaksTheOutputs) {
  Bench bench;
  bench.pwm(4200);
  bench.run(77);
  bench.model.clock_failure_break(bench.now);
  EXPECT_FALSE(bench.model.moe());
  EXPECT_EQ(bench.changes, std::vector<BoardTime>{bench.now});
  EXPECT_NE(static_cast<std::uint32_t>(bench.timer.sr) & 1U << 7, 0U) << "BIF";
  bench.timer.sr = ~(1U << 7);
  EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.sr) & 1U << 7, 0U);
  bench.run(10 * 4200 * tick);
  EXPECT_FALSE(bench.model.moe());
  bench.timer.bdtr = ossi_ossr | bke | bkp | moe | 21;
  EXPECT_TRUE(bench.model.moe());
}

TEST(AdvancedTimerModel, BreakNeedsItsEnable) {
  Bench bench;
  bench.pwm(4200);
  bench.timer.bdtr = ossi_ossr | moe | 21;
  bench.model.clock_failure_break(bench.now);
  EXPECT_TRUE(bench.model.moe()) << "BKE = 0";
}

// TIMx_EGR, BG: whatever BKE says.
TEST(AdvancedTimerModel, BreakGenerationClearsMainOutputEnable) {
  Bench bench;
  bench.pwm(4200);
  bench.timer.bdtr = ossi_ossr | moe | 21;
  bench.timer.egr = 1U << 7;
  EXPECT_FALSE(bench.model.moe());
  EXPECT_NE(static_cast<std::uint32_t>(bench.timer.sr) & 1U << 7, 0U);
}

TEST(AdvancedTimerModel, ABreakInputThatIsHeldKeepsTheOutputsOff) {
  for (const bool high : {false, true}) {
    Bench bench;
    bench.model.set_break_input(high, bench.now);
    bench.pwm(4200);
    const std::uint32_t other = ossi_ossr | bke | (high ? 0 : bkp) | moe | 21;
    const std::uint32_t held = other ^ bkp;
    bench.timer.bdtr = held;
    EXPECT_FALSE(bench.model.moe());
    bench.timer.sr = 0;
    EXPECT_NE(static_cast<std::uint32_t>(bench.timer.sr) & 1U << 7, 0U) << "BIF comes back";
    bench.timer.bdtr = other;
    bench.timer.sr = 0;
    EXPECT_TRUE(bench.model.moe());
    EXPECT_EQ(static_cast<std::uint32_t>(bench.timer.sr) & 1U << 7, 0U);
    bench.model.set_break_input(!high, bench.now);
    EXPECT_FALSE(bench.model.moe());
  }
}

// "Center-aligned mode": CMS says in which direction a comparison sets its flag, and asks for DMA.
TEST(AdvancedTimerModel, ChannelFourAsksForDmaInTheDirectionsOfItsMode) {
  constexpr std::uint32_t ude = 1U << 8, cc4de = 1U << 12;
  for (const std::uint32_t cms : {1U, 2U, 3U}) {
    Bench bench;
    std::vector<BoardTime> compares, updates;
    bench.model.on_dma_request([&](TimerRequest request, BoardTime at) {
      (request == TimerRequest::update ? updates : compares).push_back(at - 1000);
    });
    bench.load(100);
    bench.timer.cr1 = urs | arpe | cms << 5;
    bench.timer.dier = ude | cc4de;
    bench.timer.ccr[3] = 30;
    bench.count();
    bench.run(400 * tick);
    std::vector<BoardTime> expected;
    for (const BoardTime period : {0, 200}) {
      if ((cms & 2U) != 0) expected.push_back((period + 30) * tick);
      if ((cms & 1U) != 0) expected.push_back((period + 170) * tick);
    }
    EXPECT_EQ(compares, expected) << cms;
    EXPECT_EQ(updates, (std::vector<BoardTime>{100 * tick, 200 * tick, 300 * tick, 400 * tick}));
    EXPECT_NE(static_cast<std::uint32_t>(bench.timer.sr) & 1U << 4, 0U) << "CC4IF";
    // Out of reach, and back when it has been passed already.
    compares.clear();
    bench.timer.ccr[3] = 0xFFFF;
    bench.run(250 * tick);
    EXPECT_TRUE(compares.empty());
    bench.timer.ccr[3] = 30;
    bench.run(40 * tick);
    EXPECT_TRUE(compares.empty()) << "at 50 to 90 upwards";
    bench.timer.egr = 1U << 4;
    EXPECT_EQ(compares.size(), 1U) << "CC4G";
    bench.timer.dier = 0;
    bench.run(400 * tick);
    EXPECT_EQ(compares.size(), 1U);
  }
}

// "Debug mode" and DBGMCU_APB2_FZ.
TEST(AdvancedTimerModel, AHaltStopsTheCounterAndLeavesMainOutputEnable) {
  for (const FrozenOutputs outputs : {FrozenOutputs::off, FrozenOutputs::held}) {
    Bench bench;
    bench.timer.ccr[0] = 50;
    bench.pwm(100);
    bench.run(130 * tick);
    ASSERT_EQ(bench.cnt(), 70U);
    bench.model.freeze(true, outputs, bench.now);
    bench.run(1'000'000 * tick);
    EXPECT_EQ(bench.cnt(), 70U);
    EXPECT_TRUE(bench.model.moe());
    EXPECT_EQ(bench.model.outputs()[0].enabled, outputs == FrozenOutputs::held);
    if (outputs == FrozenOutputs::held) {
      EXPECT_EQ(bench.model.outputs()[0].high_duty, 1.0) << "above CCR1, for ever";
    }
    bench.model.freeze(false, outputs, bench.now);
    bench.run(10 * tick);
    EXPECT_EQ(bench.cnt(), 60U);
    EXPECT_TRUE(bench.down());
    EXPECT_EQ(bench.model.outputs()[0].high_duty, 0.5) << "by itself";
  }
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
  bench.timer.ccmr[0] = pwm2_direct;
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

}  // namespace kmax::virtual_board::advanced_timer_test
