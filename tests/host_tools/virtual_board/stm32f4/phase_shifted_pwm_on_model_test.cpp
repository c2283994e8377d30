// drivers/stm32f4/three_phase_pwm.hpp and phase_shifted_pwm.hpp on the models of TIM1 and TIM8, wired as the
// board wires them.
#include "drivers/stm32f4/phase_shifted_pwm.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::phase_shifted_pwm_on_model_test {

using drivers::stm32f4::ThreePhasePwm;
using drivers::stm32f4::ThreePhasePwmConfig;
using testing::TimerOnModel;

constexpr ThreePhasePwmConfig typical{
    .half_period_ticks = 4200, .dead_time_code = 21, .minimum_low_ticks = 252};
constexpr BoardTime tick = 2;
constexpr BoardTime half_period = 4200 * tick;

struct Board : testing::ModelBench {
  explicit Board(const ThreePhasePwmConfig& config = typical)
      : ModelBench({&tim1, &tim8}, 12345), pwm1(timer1, config), pwm8(timer8, config) {
    clocks.apb2_timer = tick;
    tim1.on_trigger_output([this](BoardTime at) {
      tim8.trigger_input(at);
      triggers.push_back(at);
    });
    tim1.on_output_change([this](BoardTime at) { changes.push_back(at); });
  }
  bool start() { return pwm1.configure() && pwm8.configure() && start_phase_shifted(pwm1, pwm8); }

  AdvancedTimerModel tim1{AdvancedTimer::tim1, clocks};
  AdvancedTimerModel tim8{AdvancedTimer::tim8, clocks};
  TimerOnModel timer1 = block_on_model<TimerOnModel>(*this, tim1);
  TimerOnModel timer8 = block_on_model<TimerOnModel>(*this, tim8);
  ThreePhasePwm<TimerOnModel> pwm1, pwm8;
  std::vector<BoardTime> triggers, changes;
};

TEST(PhaseShiftedPwmOnModel, FollowerIsExactlyHalfAPeriodLater) {
  Board board;
  ASSERT_TRUE(board.start());
  for (unsigned step = 0; step < 20'000; ++step) {
    const std::uint32_t first = board.pwm1.counter();
    ASSERT_EQ(board.pwm8.counter(), 4200 - first) << board.now;
    ASSERT_NE(board.pwm8.counting_down(), board.pwm1.counting_down()) << board.now;
    board.run(3 * tick);
  }
}

// The interrupt that follows a trigger by 1 us tells whose underflow it was.
TEST(PhaseShiftedPwmOnModel, TriggersAlternateBetweenTheAxes) {
  Board board;
  ASSERT_TRUE(board.start());
  const BoardTime started = board.now;
  ASSERT_EQ(board.triggers, std::vector<BoardTime>{started}) << "one at the start, none from the loading";
  for (unsigned n = 1; n <= 10; ++n) {
    board.run_until(started + n * half_period);
    ASSERT_EQ(board.triggers.size(), n + 1);
    EXPECT_EQ(board.triggers.back(), board.now);
    const bool axis1 = n % 2 == 1;
    EXPECT_EQ((axis1 ? board.pwm8 : board.pwm1).counter(), 0U) << "underflow of the axis whose turn it is";
    board.run(units_per_microsecond);
    EXPECT_EQ(board.pwm1.counting_down(), axis1);
    board.run(23 * units_per_microsecond);
    EXPECT_EQ(board.pwm1.counting_down(), axis1) << "still right 24 us later";
  }
}

TEST(PhaseShiftedPwmOnModel, StartsAgainFromAnyPhaseInStep) {
  Board board;
  ASSERT_TRUE(board.start());
  for (const BoardTime pause : {half_period / 3, half_period, 5 * half_period / 3, 7 * half_period + 1}) {
    ASSERT_TRUE(board.pwm1.arm() && board.pwm8.arm());
    board.run(pause);
    ASSERT_TRUE(start_phase_shifted(board.pwm1, board.pwm8));
    EXPECT_FALSE(board.pwm1.armed() || board.pwm8.armed());
    board.run(1000 * tick);
    EXPECT_EQ(board.pwm1.counter(), 1000U);
    EXPECT_EQ(board.pwm8.counter(), 3200U);
    ASSERT_TRUE(board.start()) << "configured again";
    board.run(1000 * tick);
    EXPECT_EQ(board.pwm8.counter(), 3200U);
  }
}

TEST(PhaseShiftedPwmOnModel, DutyBecomesActiveAtTheNextTurnOnly) {
  Board board;
  ASSERT_TRUE(board.start());
  ASSERT_TRUE(board.pwm1.arm());
  EXPECT_EQ(board.tim1.outputs()[0].high_duty, 0.0);
  board.changes.clear();
  const BoardTime started = board.now;
  board.run(units_per_microsecond);
  ASSERT_TRUE(board.pwm1.ISR_set_duty({0.5F, 0.25F, 1.0F}));
  board.run_until(started + half_period - 1);
  EXPECT_EQ(board.tim1.outputs()[0].high_duty, 0.0);
  EXPECT_TRUE(board.changes.empty());
  board.run(1);
  EXPECT_EQ(board.tim1.outputs()[0].high_duty, 0.5);
  EXPECT_EQ(board.tim1.outputs()[1].high_duty, 0.25);
  EXPECT_DOUBLE_EQ(board.tim1.outputs()[2].high_duty, 0.94);
  EXPECT_EQ(board.changes, std::vector<BoardTime>{started + half_period}) << "all legs together";
  EXPECT_DOUBLE_EQ(board.tim1.outputs()[0].dead_time, 21.0 / 168e6);
}

TEST(PhaseShiftedPwmOnModel, DisarmSwitchesOffAtOnceAndOneAxisOnly) {
  Board board;
  ASSERT_TRUE(board.start());
  EXPECT_FALSE(board.tim1.outputs()[0].enabled);
  ASSERT_TRUE(board.pwm1.arm() && board.pwm8.arm());
  EXPECT_TRUE(board.tim1.outputs()[0].enabled);
  board.run(1234);
  board.changes.clear();
  board.pwm1.disarm();
  for (const PwmLegOutput& leg : board.tim1.outputs()) EXPECT_FALSE(leg.enabled);
  EXPECT_EQ(board.changes, std::vector<BoardTime>{board.now});
  EXPECT_TRUE(board.tim8.moe());
  board.run(10 * half_period);
  EXPECT_FALSE(board.pwm1.armed()) << "no update event brings it back";
}

TEST(PhaseShiftedPwmOnModel, ClockFailureDisarmsAndArmingAgainIsSoftwares) {
  Board board;
  ASSERT_TRUE(board.start());
  ASSERT_TRUE(board.pwm8.arm());
  board.run(999);
  board.tim8.clock_failure_break(board.now);
  EXPECT_FALSE(board.pwm8.armed());
  board.run(4 * half_period);
  EXPECT_FALSE(board.pwm8.armed());
  EXPECT_TRUE(board.pwm8.arm());
}

TEST(PhaseShiftedPwmOnModel, BrushedMotorLeavesLegAOff) {
  Board board;
  ASSERT_TRUE(board.start());
  ASSERT_TRUE(board.pwm1.enable_legs({.a = false}));
  ASSERT_TRUE(board.pwm1.arm());
  EXPECT_FALSE(board.tim1.outputs()[0].enabled);
  EXPECT_TRUE(board.tim1.outputs()[1].enabled);
  EXPECT_TRUE(board.tim1.outputs()[2].enabled);
}

TEST(PhaseShiftedPwmOnModel, LockProtectsTheDeadTime) {
  Board board;
  ASSERT_TRUE(board.start());
  board.timer1.bdtr = 0;
  EXPECT_EQ(static_cast<std::uint32_t>(board.timer1.bdtr) & 0xFFU, 21U);
  ThreePhasePwm<TimerOnModel> other{board.timer1, {4200, 40, 252}};
  EXPECT_FALSE(other.configure()) << "another dead time needs a reset";
  EXPECT_TRUE(board.pwm1.configure());
  board.tim1.reset(board.now);
  EXPECT_TRUE(other.configure());
}

RC_GTEST_PROP(PhaseShiftedPwmOnModel, OutputIsTheDutyThatWasSet, ()) {
  const auto half = *rc::gen::inRange<std::uint16_t>(300, 60000);
  const auto high = *rc::gen::inRange<std::uint16_t>(0, 65535);
  Board board({half, 21, 252});
  RC_ASSERT(board.start());
  RC_ASSERT(board.pwm1.arm());
  board.pwm1.ISR_set_ticks({high, 0, 0});
  board.run(half * tick);
  const double expected = static_cast<double>(std::min<int>(high, half - 252)) / half;
  RC_ASSERT(std::abs(board.tim1.outputs()[0].high_duty - expected) < 1e-12);
  RC_ASSERT(board.tim1.outputs()[1].high_duty == 0.0);
}

// Both axes armed, a new duty for each in each period: what the virtual board pays.
TEST(PhaseShiftedPwmOnModel, ThreeEventsForEachPeriod) {
  Board board;
  ASSERT_TRUE(board.start());
  ASSERT_TRUE(board.pwm1.arm() && board.pwm8.arm());
  const unsigned before = board.events;
  for (unsigned n = 0; n < 200; ++n) {
    const float duty = 0.3F + 0.001F * static_cast<float>(n);
    ASSERT_TRUE((n % 2 == 0 ? board.pwm1 : board.pwm8).ISR_set_duty({duty, duty, duty}));
    board.run(half_period);
  }
  EXPECT_EQ(board.events - before, 200U) << "TIM8's updates fall on those of TIM1";
}

}  // namespace kmax::virtual_board::phase_shifted_pwm_on_model_test
