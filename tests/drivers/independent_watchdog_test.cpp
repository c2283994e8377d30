#include "drivers/stm32f4/independent_watchdog.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>

#include "tests/drivers/fake_register.hpp"

// On the model: tests/host_tools/virtual_board/stm32f4/iwdg_test.cpp.

namespace kmax::drivers::stm32f4::independent_watchdog_test {

struct FakeIwdg {
  FakeRegister kr, pr, rlr, sr;
};
struct FakeDbgmcu {
  FakeRegister apb1_fz;
};

struct Chip {
  FakeIwdg iwdg;
  FakeDbgmcu dbgmcu;
  std::string order;
  IndependentWatchdog<FakeIwdg, FakeDbgmcu> watchdog{iwdg, dbgmcu, 30};

  Chip() {
    iwdg.kr.on_write = [this](std::uint32_t key) {
      order += key == 0xCCCC ? "S" : key == 0x5555 ? "U" : key == 0xAAAA ? "F" : "?";
    };
    iwdg.pr.on_write = [this](std::uint32_t) { order += "p"; };
    iwdg.rlr.on_write = [this](std::uint32_t) { order += "r"; };
  }
};

TEST(IndependentWatchdogTiming, TableOfTheHeader) {
  constexpr IndependentWatchdogTiming fast = independent_watchdog_timing(100);
  static_assert(fast.usable);
  EXPECT_EQ(fast.prescaler_code, 0U);
  EXPECT_EQ(fast.reload, 1175U);
  EXPECT_EQ(fast.guaranteed_not_before_us, 100'000U);
  EXPECT_NEAR(fast.fires_at_latest_us, 277e3, 1e3);
  const IndependentWatchdogTiming slow = independent_watchdog_timing(1000);
  EXPECT_EQ(slow.prescaler_code, 2U);
  EXPECT_GE(slow.guaranteed_not_before_us, 1'000'000U);
  EXPECT_NEAR(slow.fires_at_latest_us, 2.77e6, 0.01e6);
}

TEST(IndependentWatchdogTiming, Limits) {
  EXPECT_FALSE(independent_watchdog_timing(0).usable);
  EXPECT_TRUE(independent_watchdog_timing(1).usable);
  EXPECT_TRUE(independent_watchdog_timing(22'000).usable);
  EXPECT_FALSE(independent_watchdog_timing(22'001).usable);
  EXPECT_FALSE(independent_watchdog_timing(0xFFFF'FFFF).usable) << "no overflow into a short period";
}

RC_GTEST_PROP(IndependentWatchdogTiming, BoundsHoldForEveryOscillator, ()) {
  const auto period = *rc::gen::inRange<std::uint32_t>(1, 22'001);
  const auto hz = *rc::gen::inRange<std::uint32_t>(17'000, 47'001);
  const IndependentWatchdogTiming timing = independent_watchdog_timing(period);
  RC_ASSERT(timing.usable);
  RC_ASSERT(timing.reload >= 1U && timing.reload <= 4095U);
  const double divider = 4 << timing.prescaler_code;
  const double shortest = timing.reload * divider / hz;
  const double longest = ((timing.reload + 1) * divider + 1) / hz;
  RC_ASSERT(shortest * 1e6 >= timing.guaranteed_not_before_us);
  RC_ASSERT(longest * 1e6 <= timing.fires_at_latest_us);
  RC_ASSERT(timing.guaranteed_not_before_us >= period * 1000);
  // The finest prescaler that reaches that far.
  if (timing.prescaler_code > 0) RC_ASSERT(period * 47 > 4095 * divider / 2);
}

TEST(IndependentWatchdog, StartSequence) {
  Chip chip;
  EXPECT_TRUE(chip.watchdog.start(1000));
  EXPECT_EQ(chip.order, "SUprF");
  EXPECT_EQ(chip.iwdg.pr.value, 2U);
  EXPECT_EQ(chip.iwdg.rlr.value, 2938U);
  EXPECT_EQ(chip.dbgmcu.apb1_fz.value, 1U << 12) << "stands still while a debugger halts the core";
  chip.watchdog.feed();
  EXPECT_EQ(chip.order, "SUprFF");
}

TEST(IndependentWatchdog, OtherFreezeBitsStay) {
  Chip chip;
  chip.dbgmcu.apb1_fz.value = 0x0200'000F;
  EXPECT_TRUE(chip.watchdog.start(1));
  EXPECT_EQ(chip.dbgmcu.apb1_fz.value, 0x0200'100FU);
}

TEST(IndependentWatchdog, PeriodThatCannotBeHadStartsNothing) {
  Chip chip;
  EXPECT_FALSE(chip.watchdog.start(0));
  EXPECT_FALSE(chip.watchdog.start(60'000));
  EXPECT_EQ(chip.order, "");
}

TEST(IndependentWatchdog, UpdateThatNeverEndsIsReportedAndStillFed) {
  Chip chip;
  chip.iwdg.pr.on_write = [&](std::uint32_t) { chip.iwdg.sr.value = 1; };
  EXPECT_FALSE(chip.watchdog.start(1000));
  EXPECT_EQ(chip.order.back(), 'F');
  EXPECT_LE(chip.iwdg.sr.reads, 31U);
  Chip busy_before;
  busy_before.iwdg.sr.value = 2;
  EXPECT_FALSE(busy_before.watchdog.start(1000));
  EXPECT_EQ(busy_before.order, "S") << "RLR may not be written while RVU is set";
}

}  // namespace kmax::drivers::stm32f4::independent_watchdog_test
