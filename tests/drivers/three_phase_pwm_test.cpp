#include "drivers/stm32f4/three_phase_pwm.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::three_phase_pwm_test {

constexpr ThreePhasePwmConfig typical{
    .half_period_ticks = 4200, .dead_time_code = 21, .minimum_low_ticks = 252};
constexpr std::uint32_t moe = 1U << 15;
// DTG 21, LOCK 2, OSSI, OSSR, BKE, BKP; AOE and MOE 0.
constexpr std::uint32_t disarmed = 21U | 2U << 8 | 1U << 10 | 1U << 11 | 1U << 12 | 1U << 13;

TEST(ThreePhasePwm, ConfiguresCentreAlignedComplementaryPwm) {
  TimerRegisters timer{};
  timer.cr1 = 0x1;
  timer.cr2 = 0x7F00;
  timer.dier = 0xFFFF;
  timer.smcr = 6;
  timer.rcr = 3;
  timer.psc = 3;
  timer.sr = 0xFFFF;
  ThreePhasePwm<> pwm{timer, typical};
  ASSERT_TRUE(pwm.configure());
  EXPECT_EQ(timer.cr1, 1U << 2 | 3U << 5 | 1U << 7) << "URS, CMS = 3, ARPE, stopped";
  EXPECT_EQ(timer.cr2, 1U << 4) << "all idle levels 0, TRGO shows CEN";
  EXPECT_EQ(timer.dier, 0U);
  EXPECT_EQ(timer.smcr, 0U);
  EXPECT_EQ(timer.rcr, 0U) << "an update at each turn";
  EXPECT_EQ(timer.psc, 0U);
  EXPECT_EQ(timer.sr, 0U);
  EXPECT_EQ(timer.egr, 1U) << "UG";
  EXPECT_EQ(timer.ccmr[0], 0x7878U) << "PWM mode 2, preloaded";
  EXPECT_EQ(timer.ccmr[1], 0x0078U);
  EXPECT_EQ(timer.ccer, 0x555U);
  EXPECT_EQ(timer.arr, 4200U);
  for (unsigned leg = 0; leg < 3; ++leg) EXPECT_EQ(timer.ccr[leg], 4200U) << "duty 0";
  EXPECT_EQ(timer.ccr[3], 0xFFFFU) << "no comparison of channel 4";
  EXPECT_EQ(timer.bdtr, disarmed);
  EXPECT_FALSE(pwm.armed());
}

struct Configured {
  Configured() : pwm{timer, typical} { EXPECT_TRUE(pwm.configure()); }
  TimerRegisters timer{};
  ThreePhasePwm<> pwm;
};

TEST(ThreePhasePwm, OutputsAreOffBeforeAnythingElseIsTouched) {
  FakeTimer timer;
  std::string order;
  timer.bdtr.on_write = [&](std::uint32_t) { order += 'b'; };
  timer.cr1.on_write = [&](std::uint32_t) { order += '1'; };
  timer.ccer.on_write = [&](std::uint32_t) { order += 'e'; };
  timer.arr.on_write = [&](std::uint32_t) { order += 'a'; };
  ThreePhasePwm<FakeTimer> pwm{timer, typical};
  ASSERT_TRUE(pwm.configure());
  EXPECT_EQ(order.front(), 'b');
  EXPECT_EQ(order.back(), 'e') << "the legs come last";
}

TEST(ThreePhasePwm, IsSetUpInTheManualsOrder) {
  FakeTimer timer;
  timer.cr1.value = 1U | 1U << 4 | 3U << 5;  // runs down, centre-aligned
  WriteOrder order;
  timer.add_to(order);
  ThreePhasePwm<FakeTimer> pwm{timer, typical};
  ASSERT_TRUE(pwm.configure());
  constexpr std::uint32_t loading = 1U << 2 | 1U << 7;
  EXPECT_EQ(order.all, (WriteOrder::Writes{{"bdtr", disarmed},
                                           {"cr1", 1U << 4 | 3U << 5},
                                           {"cr1", 1U << 4},
                                           {"cr1", loading},
                                           {"smcr", 0},
                                           {"dier", 0},
                                           {"ccr4", 0xFFFF},
                                           {"cr2", 1U << 4},
                                           {"ccer", 0},
                                           {"ccmr1", 0x7878},
                                           {"ccmr2", 0x0078},
                                           {"psc", 0},
                                           {"rcr", 0},
                                           {"arr", 4200},
                                           {"ccr1", 4200},
                                           {"ccr2", 4200},
                                           {"ccr3", 4200},
                                           {"cr1", loading},
                                           {"cr1", loading},
                                           {"cr1", loading},
                                           {"cr1", loading},
                                           {"egr", 1},
                                           {"cr1", loading | 3U << 5},
                                           {"sr", 0},
                                           {"ccer", 0x555}}));
}

TEST(ThreePhasePwm, RefusesImpossibleConfigurations) {
  for (const ThreePhasePwmConfig& config :
       {ThreePhasePwmConfig{252, 21, 252}, ThreePhasePwmConfig{4200, 21, 4200},
        ThreePhasePwmConfig{4200, 21, 21}, ThreePhasePwmConfig{4200, 255, 252},
        ThreePhasePwmConfig{4200, 0, 252}}) {
    TimerRegisters timer{};
    timer.bdtr = moe;
    ThreePhasePwm<> pwm{timer, config};
    EXPECT_FALSE(pwm.configure());
    EXPECT_FALSE(pwm.armed()) << "off all the same";
    EXPECT_EQ(timer.ccer, 0U);
  }
}

TEST(ThreePhasePwm, NoticesALockedBreakAndDeadTimeRegister) {
  FakeTimer timer;
  timer.bdtr.on_read = [](std::uint32_t) { return disarmed - 1; };
  ThreePhasePwm<FakeTimer> pwm{timer, typical};
  EXPECT_FALSE(pwm.configure());
}

TEST(ThreePhasePwm, DisarmIsOneStoreWithoutARead) {
  FakeTimer timer;
  ThreePhasePwm<FakeTimer> pwm{timer, typical};
  pwm.disarm();
  EXPECT_EQ(timer.bdtr.writes, std::vector<std::uint32_t>{disarmed}) << "before configure, too";
  EXPECT_EQ(timer.bdtr.reads, 0U);
}

TEST(ThreePhasePwm, ArmIsOneStoreAndLooksWhetherItTook) {
  FakeTimer timer;
  ThreePhasePwm<FakeTimer> pwm{timer, typical};
  ASSERT_TRUE(pwm.configure());
  timer.bdtr.writes.clear();
  EXPECT_FALSE(pwm.arm()) << "the counter stands";
  EXPECT_TRUE(timer.bdtr.writes.empty());
  timer.cr1.value |= 1;
  EXPECT_TRUE(pwm.arm());
  EXPECT_EQ(timer.bdtr.writes, std::vector<std::uint32_t>{disarmed | moe});
  pwm.disarm();
  timer.bdtr.on_read = [](std::uint32_t word) { return word & ~moe; };  // a break holds MOE at 0
  EXPECT_FALSE(pwm.arm());
}

TEST(ThreePhasePwm, TellsABreakThatIsHeldAndTurnsItRound) {
  FakeTimer timer;
  ThreePhasePwm<FakeTimer> pwm{timer, typical};
  ASSERT_TRUE(pwm.configure());
  EXPECT_FALSE(pwm.break_is_held());
  timer.sr.on_read = [](std::uint32_t word) { return word | 1U << 7; };
  EXPECT_TRUE(pwm.break_is_held());
  pwm.break_when_low();
  ASSERT_TRUE(pwm.configure());
  EXPECT_EQ(timer.bdtr.value, disarmed & ~(1U << 13)) << "BKP";
}

TEST(ThreePhasePwm, LegsChangeOnlyWhileDisarmed) {
  Configured configured;
  ASSERT_TRUE(configured.pwm.enable_legs({.a = false}));
  auto& [timer, pwm] = configured;
  EXPECT_EQ(timer.ccer, 0x550U) << "leg A off";
  timer.cr1 = timer.cr1 | 1U;
  ASSERT_TRUE(pwm.arm());
  EXPECT_FALSE(pwm.enable_legs({}));
  EXPECT_EQ(timer.ccer, 0x550U);
  pwm.disarm();
  EXPECT_TRUE(pwm.enable_legs({}));
  EXPECT_EQ(timer.ccer, 0x555U);
  EXPECT_TRUE(pwm.enable_legs({.a = false, .b = false, .c = false}));
  EXPECT_EQ(timer.ccer, 0U);
}

TEST(ThreePhasePwm, DutyIsTicksAboveTheCompareValue) {
  Configured configured;
  auto& [timer, pwm] = configured;
  ASSERT_TRUE(pwm.ISR_set_duty({0.0F, 0.5F, 0.25F}));
  EXPECT_EQ(timer.ccr[0], 4200U);
  EXPECT_EQ(timer.ccr[1], 2100U);
  EXPECT_EQ(timer.ccr[2], 3150U);
  pwm.ISR_set_ticks({0, 1, 4200});
  EXPECT_EQ(timer.ccr[0], 4200U);
  EXPECT_EQ(timer.ccr[1], 4199U);
  EXPECT_EQ(timer.ccr[2], 252U) << "the low-side window stays open";
}

TEST(ThreePhasePwm, NoVoltageIsTheMiddleOnAllLegs) {
  Configured configured;
  configured.pwm.ISR_set_no_voltage();
  for (unsigned leg = 0; leg < 3; ++leg) EXPECT_EQ(configured.timer.ccr[leg], 2100U);
}

TEST(ThreePhasePwm, TheStepsOfAStartInStep) {
  FakeTimer timer;
  ThreePhasePwm<FakeTimer> pwm{timer, typical};
  ASSERT_TRUE(pwm.configure());
  EXPECT_FALSE(pwm.counting_down());
  pwm.load_counter(true);
  EXPECT_TRUE(pwm.counting_down());
  EXPECT_EQ(timer.cr1.value, 1U << 2 | 1U << 4 | 3U << 5 | 1U << 7) << "URS, DIR, CMS, ARPE";
  EXPECT_FALSE(pwm.running());
  pwm.enable_counter();
  EXPECT_TRUE(pwm.running());
  pwm.select_trigger_output(2);
  EXPECT_EQ(timer.cr2.value, 2U << 4);
  pwm.start_on_internal_trigger_0();
  EXPECT_EQ(timer.smcr.writes, (std::vector<std::uint32_t>{0, 0, 6})) << "TS = 0 before SMS = 6";
  pwm.ignore_triggers();
  EXPECT_EQ(timer.smcr.value, 0U);
  EXPECT_EQ(timer.sr.value, ~(1U << 6)) << "TIF alone is cleared";
  timer.cnt.value = 1234;
  EXPECT_EQ(pwm.counter(), 1234U);
  EXPECT_EQ(pwm.half_period_ticks(), 4200);
}

TEST(ThreePhasePwm, TellsThatTheTicksStayedAwaySinceItWasArmed) {
  FakeTimer timer;
  ThreePhasePwm<FakeTimer> pwm{timer, typical};
  ASSERT_TRUE(pwm.configure());
  EXPECT_FALSE(pwm.ISR_ticks_stayed_away());
  timer.sr.value = 1U << 4;
  EXPECT_TRUE(pwm.ISR_ticks_stayed_away()) << "CC4IF";
  pwm.enable_counter();
  ASSERT_TRUE(pwm.arm());
  EXPECT_EQ(timer.sr.value, ~(1U << 4)) << "is cleared, and nothing else";
}

TEST(ThreePhasePwm, NotANumberLeavesTheDutyAlone) {
  Configured configured;
  auto& [timer, pwm] = configured;
  ASSERT_TRUE(pwm.ISR_set_duty({0.5F, 0.5F, 0.5F}));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(pwm.ISR_set_duty({nan, 0.1F, 0.1F}));
  EXPECT_FALSE(pwm.ISR_set_duty({0.1F, nan, 0.1F}));
  EXPECT_FALSE(pwm.ISR_set_duty({0.1F, 0.1F, nan}));
  for (unsigned leg = 0; leg < 3; ++leg) EXPECT_EQ(timer.ccr[leg], 2100U);
}

RC_GTEST_PROP(ThreePhasePwm, AnyNumberKeepsTheWindowOpen, (float duty)) {
  TimerRegisters timer{};
  const auto half = *rc::gen::inRange<std::uint16_t>(300, 65535);
  ThreePhasePwm<> pwm{timer, {half, 21, 252}};
  RC_ASSERT(pwm.configure());
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float value :
       {duty, duty * 1e30F, -duty, infinity, -infinity, 1.0F, std::nextafter(1.0F, 2.0F)}) {
    if (value != value) continue;
    RC_ASSERT(pwm.ISR_set_duty({value, value, value}));
    RC_ASSERT(timer.ccr[0] >= 252U && timer.ccr[0] <= half);
    const double limited =
        std::min(std::max(static_cast<double>(value), 0.0), static_cast<double>(half - 252) / half);
    const double error = static_cast<double>(half - timer.ccr[0]) - limited * half;
    RC_ASSERT(error <= 0.51 && error >= -0.51);
  }
}

}  // namespace kmax::drivers::stm32f4::three_phase_pwm_test
