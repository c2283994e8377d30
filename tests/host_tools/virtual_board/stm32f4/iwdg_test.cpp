#include "host_tools/virtual_board/stm32f4/iwdg.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstddef>
#include <optional>
#include <stdexcept>

#include "drivers/stm32f4/independent_watchdog.hpp"
#include "host_tools/virtual_board/stm32f4/device_identity.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

// RM0090, chapter Independent watchdog (IWDG).

namespace kmax::virtual_board::iwdg_test {

namespace stm32 = drivers::stm32f4;
using stm32::IwdgRegisters;

constexpr BoardTime lsi_cycle = units_per_second / 32'000;  // 10,500: exact
constexpr std::uint32_t start = 0xCCCC, unlock = 0x5555, reload = 0xAAAA;

struct Watchdog : testing::ModelBench {
  Watchdog() : ModelBench({&model}, 777) {
    model.on_reset([this](BoardTime at) { fired = at; });
  }
  void key(std::uint32_t word) { write(offsetof(IwdgRegisters, kr), word); }
  std::uint32_t status() { return read(offsetof(IwdgRegisters, sr)); }

  IwdgModel model;
  std::optional<BoardTime> fired;
};

TEST(Iwdg, ResetValuesAndNothingHappensUnstarted) {
  Watchdog watchdog;
  EXPECT_EQ(watchdog.read(offsetof(IwdgRegisters, pr)), 0U);
  EXPECT_EQ(watchdog.read(offsetof(IwdgRegisters, rlr)), 0xFFFU);
  EXPECT_EQ(watchdog.status(), 0U);
  EXPECT_EQ(watchdog.model.next_event(), never);
  watchdog.run(100 * units_per_second);
  EXPECT_FALSE(watchdog.fired);
}

// Table Min/max IWDG timeout period at 32 kHz (LSI): 512 ms with PR 0 and RLR 0xFFF.
TEST(Iwdg, FiresAtTheExactCycleAndNotBefore) {
  Watchdog watchdog;
  watchdog.key(start);
  const BoardTime due = watchdog.now + 4096 * 4 * lsi_cycle;
  EXPECT_EQ(watchdog.model.next_event(), due);
  EXPECT_DOUBLE_EQ(seconds(due - watchdog.now), 0.512);
  watchdog.run(due - watchdog.now - 1);
  EXPECT_FALSE(watchdog.fired);
  watchdog.run(1);
  EXPECT_EQ(watchdog.fired, due);
  EXPECT_EQ(watchdog.model.next_event(), never) << "once";
}

TEST(Iwdg, ReloadStartsThePeriodAnew) {
  Watchdog watchdog;
  watchdog.key(start);
  for (int feed = 0; feed < 10; ++feed) {
    watchdog.run(4095 * 4 * lsi_cycle);
    watchdog.key(reload);
  }
  EXPECT_FALSE(watchdog.fired);
  watchdog.key(start);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now + 4096 * 4 * lsi_cycle) << "starting twice is no feed";
  watchdog.run(1000);
  watchdog.key(start);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now - 1000 + 4096 * 4 * lsi_cycle);
}

// Section Register access protection.
TEST(Iwdg, SettingsNeedTheKeyAndAnyOtherKeyTakesItBack) {
  Watchdog watchdog;
  EXPECT_THROW(watchdog.write(offsetof(IwdgRegisters, pr), 1), RefusedAccess);
  watchdog.key(unlock);
  EXPECT_NO_THROW(watchdog.write(offsetof(IwdgRegisters, pr), 1));
  watchdog.key(reload);
  EXPECT_THROW(watchdog.write(offsetof(IwdgRegisters, rlr), 1), RefusedAccess);
  EXPECT_THROW(watchdog.key(0x1234), RefusedAccess);
  EXPECT_THROW(watchdog.read(offsetof(IwdgRegisters, kr)), RefusedAccess);
  watchdog.key(unlock);
  EXPECT_THROW(watchdog.write(offsetof(IwdgRegisters, rlr), 0x1000), RefusedAccess);
}

// Section Status register (IWDG_SR).
TEST(Iwdg, UpdateTakesFiveCyclesOfARunningOscillator) {
  Watchdog watchdog;
  watchdog.key(unlock);
  watchdog.write(offsetof(IwdgRegisters, pr), 3);
  watchdog.write(offsetof(IwdgRegisters, rlr), 99);
  watchdog.run(units_per_second);
  EXPECT_EQ(watchdog.status(), 3U) << "not started, no oscillator";
  EXPECT_THROW(watchdog.write(offsetof(IwdgRegisters, rlr), 98), RefusedAccess);
  watchdog.key(start);
  watchdog.run(5 * lsi_cycle - 1);
  EXPECT_EQ(watchdog.status(), 3U);
  watchdog.run(1);
  EXPECT_EQ(watchdog.status(), 0U);
  watchdog.key(reload);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now + 100 * 32 * lsi_cycle);
}

TEST(Iwdg, ReloadDuringTheUpdateStillTakesTheOldValue) {
  Watchdog watchdog;
  watchdog.key(start);
  watchdog.key(unlock);
  watchdog.write(offsetof(IwdgRegisters, rlr), 9);
  watchdog.key(reload);
  watchdog.run(6 * lsi_cycle);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now - 6 * lsi_cycle + 4096 * 4 * lsi_cycle);
}

TEST(Iwdg, NewPrescalerKeepsTheCount) {
  Watchdog watchdog;
  watchdog.key(start);
  watchdog.run(2000 * 4 * lsi_cycle);
  watchdog.key(unlock);
  watchdog.write(offsetof(IwdgRegisters, pr), 6);
  watchdog.run(5 * lsi_cycle);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now + (4096 - 2001) * 256 * lsi_cycle);
}

TEST(Iwdg, OscillatorSpread) {
  for (const std::uint32_t hz : {17'000U, 32'000U, 47'000U}) {
    Watchdog watchdog;
    watchdog.model.set_oscillator_hz(hz);
    watchdog.key(start);
    EXPECT_NEAR(seconds(watchdog.model.fires_at() - watchdog.now), 16384.0 / hz, 1e-8);
    EXPECT_THROW(watchdog.model.set_oscillator_hz(hz), std::logic_error);
  }
  IwdgModel model;
  EXPECT_THROW(model.set_oscillator_hz(16'999), std::invalid_argument);
  EXPECT_THROW(model.set_oscillator_hz(47'001), std::invalid_argument);
}

// DBGMCU_APB1_FZ, DBG_IWDG_STOP.
TEST(Iwdg, StandsWhileItIsFrozen) {
  Watchdog watchdog;
  watchdog.key(start);
  const BoardTime due = watchdog.model.fires_at();
  watchdog.run(1000 * lsi_cycle);
  watchdog.model.freeze(true, watchdog.now);
  watchdog.run(10 * units_per_second);
  EXPECT_FALSE(watchdog.fired);
  watchdog.model.freeze(false, watchdog.now);
  EXPECT_EQ(watchdog.model.fires_at(), due + 10 * units_per_second);
  watchdog.run(3096 * 4 * lsi_cycle + units_per_second);
  EXPECT_EQ(watchdog.fired, due + 10 * units_per_second);
}

TEST(Iwdg, AResetStopsIt) {
  Watchdog watchdog;
  watchdog.key(start);
  watchdog.run(4096 * 4 * lsi_cycle);
  ASSERT_TRUE(watchdog.fired);
  watchdog.model.reset(watchdog.now);
  EXPECT_FALSE(watchdog.model.running());
  EXPECT_EQ(watchdog.model.next_event(), never);
  EXPECT_EQ(watchdog.read(offsetof(IwdgRegisters, rlr)), 0xFFFU);
  watchdog.key(start);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now + 4096 * 4 * lsi_cycle);
}

// drivers/stm32f4/independent_watchdog.hpp on the models.
struct IwdgOnModel {
  testing::RegisterOnModel kr, pr, rlr, sr;
};
struct DbgmcuOnModel {
  testing::RegisterOnModel idcode, cr, apb1_fz;
};

struct Chip : Watchdog {
  explicit Chip(std::uint32_t lsi_hz = 32'000) {
    now = 0;
    access_time = 20;
    model.set_oscillator_hz(lsi_hz);
  }
  DbgmcuModel debug;
  IwdgOnModel registers = block_on_model<IwdgOnModel>(*this, model);
  DbgmcuOnModel debug_registers = block_on_model<DbgmcuOnModel>(*this, debug);
  stm32::IndependentWatchdog<IwdgOnModel, DbgmcuOnModel> watchdog{registers, debug_registers};
};

TEST(IndependentWatchdogOnModel, FiresAtTheComputedTimeAndNotBefore) {
  Chip chip;
  ASSERT_TRUE(chip.watchdog.start(1000));
  const BoardTime fed = chip.now - chip.access_time;
  const BoardTime due = fed + (2938 + 1) * 16 * BoardTime{10'500};
  chip.run(due - chip.now - 1);
  EXPECT_FALSE(chip.fired);
  chip.run(1);
  EXPECT_EQ(chip.fired, due);
}

RC_GTEST_PROP(IndependentWatchdogOnModel, FedInTimeItNeverFiresAndUnfedItFiresInTime, ()) {
  const auto hz = *rc::gen::inRange<std::uint32_t>(17'000, 47'001);
  const auto period = *rc::gen::inRange<std::uint32_t>(1, 22'001);
  const stm32::IndependentWatchdogTiming timing = stm32::independent_watchdog_timing(period);
  Chip chip{hz};
  RC_ASSERT(chip.watchdog.start(timing));
  for (int feed = 0; feed < 4; ++feed) {
    chip.run(timing.guaranteed_not_before_us * units_per_microsecond - chip.access_time);
    RC_ASSERT(!chip.fired);
    chip.watchdog.feed();
  }
  const BoardTime fed = chip.now - chip.access_time;
  chip.run(timing.fires_at_latest_us * units_per_microsecond);
  RC_ASSERT(chip.fired.has_value());
  RC_ASSERT(*chip.fired - fed >= timing.guaranteed_not_before_us * units_per_microsecond);
  RC_ASSERT(*chip.fired - fed <= timing.fires_at_latest_us * units_per_microsecond);
}

TEST(IndependentWatchdogOnModel, StartedAgainWithAnotherPeriod) {
  Chip chip;
  ASSERT_TRUE(chip.watchdog.start(10'000));
  ASSERT_TRUE(chip.watchdog.start(100));
  chip.run(150 * 1000 * units_per_microsecond);
  EXPECT_TRUE(chip.fired) << "1176 x 4 cycles: 147 ms";
}

TEST(IndependentWatchdogOnModel, StartIsOverWithinAMillisecond) {
  for (const std::uint32_t hz : {17'000U, 47'000U}) {
    Chip chip{hz};
    ASSERT_TRUE(chip.watchdog.start(22'000));
    EXPECT_LT(seconds(chip.now), 1e-3);
  }
}

}  // namespace kmax::virtual_board::iwdg_test
