#include "host_tools/virtual_board/stm32f4/iwdg.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <optional>
#include <stdexcept>

// RM0090, chapter Independent watchdog (IWDG).

namespace kmax::virtual_board::iwdg_test {
namespace {

namespace stm32 = drivers::stm32f4;
using stm32::IwdgRegisters;

constexpr BoardTime lsi_cycle = units_per_second / 32'000;  // 10,500: exact
constexpr std::uint32_t start = 0xCCCC, unlock = 0x5555, reload = 0xAAAA;

struct Watchdog {
  IwdgModel model;
  BoardTime now = 777;
  std::optional<BoardTime> fired;
  Watchdog() {
    model.on_reset([this](BoardTime at) { fired = at; });
  }
  void put(std::size_t offset, std::uint32_t word) {
    model.write({static_cast<std::uint32_t>(offset), 4, now}, word);
  }
  std::uint32_t get(std::size_t offset) { return model.read({static_cast<std::uint32_t>(offset), 4, now}); }
  void key(std::uint32_t word) { put(offsetof(IwdgRegisters, kr), word); }
  std::uint32_t status() { return get(offsetof(IwdgRegisters, sr)); }
  void pass(BoardTime duration) {
    now += duration;
    model.advance(now);
  }
};

TEST(Iwdg, ResetValuesAndNothingHappensUnstarted) {
  Watchdog watchdog;
  EXPECT_EQ(watchdog.get(offsetof(IwdgRegisters, pr)), 0U);
  EXPECT_EQ(watchdog.get(offsetof(IwdgRegisters, rlr)), 0xFFFU);
  EXPECT_EQ(watchdog.status(), 0U);
  EXPECT_EQ(watchdog.model.next_event(), never);
  watchdog.pass(100 * units_per_second);
  EXPECT_FALSE(watchdog.fired);
}

// Table Min/max IWDG timeout period at 32 kHz (LSI): 512 ms with PR 0 and RLR 0xFFF.
TEST(Iwdg, FiresAtTheExactCycleAndNotBefore) {
  Watchdog watchdog;
  watchdog.key(start);
  const BoardTime due = watchdog.now + 4096 * 4 * lsi_cycle;
  EXPECT_EQ(watchdog.model.next_event(), due);
  EXPECT_DOUBLE_EQ(seconds(due - watchdog.now), 0.512);
  watchdog.pass(due - watchdog.now - 1);
  EXPECT_FALSE(watchdog.fired);
  watchdog.pass(1);
  EXPECT_EQ(watchdog.fired, due);
  EXPECT_EQ(watchdog.model.next_event(), never) << "once";
}

TEST(Iwdg, ReloadStartsThePeriodAnew) {
  Watchdog watchdog;
  watchdog.key(start);
  for (int feed = 0; feed < 10; ++feed) {
    watchdog.pass(4095 * 4 * lsi_cycle);
    watchdog.key(reload);
  }
  EXPECT_FALSE(watchdog.fired);
  watchdog.key(start);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now + 4096 * 4 * lsi_cycle) << "starting twice is no feed";
  watchdog.pass(1000);
  watchdog.key(start);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now - 1000 + 4096 * 4 * lsi_cycle);
}

// Section Register access protection.
TEST(Iwdg, SettingsNeedTheKeyAndAnyOtherKeyTakesItBack) {
  Watchdog watchdog;
  EXPECT_THROW(watchdog.put(offsetof(IwdgRegisters, pr), 1), RefusedAccess);
  watchdog.key(unlock);
  EXPECT_NO_THROW(watchdog.put(offsetof(IwdgRegisters, pr), 1));
  watchdog.key(reload);
  EXPECT_THROW(watchdog.put(offsetof(IwdgRegisters, rlr), 1), RefusedAccess);
  EXPECT_THROW(watchdog.key(0x1234), RefusedAccess);
  EXPECT_THROW(watchdog.get(offsetof(IwdgRegisters, kr)), RefusedAccess);
  watchdog.key(unlock);
  EXPECT_THROW(watchdog.put(offsetof(IwdgRegisters, rlr), 0x1000), RefusedAccess);
}

// Section Status register (IWDG_SR).
TEST(Iwdg, UpdateTakesFiveCyclesOfARunningOscillator) {
  Watchdog watchdog;
  watchdog.key(unlock);
  watchdog.put(offsetof(IwdgRegisters, pr), 3);
  watchdog.put(offsetof(IwdgRegisters, rlr), 99);
  watchdog.pass(units_per_second);
  EXPECT_EQ(watchdog.status(), 3U) << "not started, no oscillator";
  EXPECT_THROW(watchdog.put(offsetof(IwdgRegisters, rlr), 98), RefusedAccess);
  watchdog.key(start);
  watchdog.pass(5 * lsi_cycle - 1);
  EXPECT_EQ(watchdog.status(), 3U);
  watchdog.pass(1);
  EXPECT_EQ(watchdog.status(), 0U);
  watchdog.key(reload);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now + 100 * 32 * lsi_cycle);
}

TEST(Iwdg, ReloadDuringTheUpdateStillTakesTheOldValue) {
  Watchdog watchdog;
  watchdog.key(start);
  watchdog.key(unlock);
  watchdog.put(offsetof(IwdgRegisters, rlr), 9);
  watchdog.key(reload);
  watchdog.pass(6 * lsi_cycle);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now - 6 * lsi_cycle + 4096 * 4 * lsi_cycle);
}

TEST(Iwdg, NewPrescalerKeepsTheCount) {
  Watchdog watchdog;
  watchdog.key(start);
  watchdog.pass(2000 * 4 * lsi_cycle);
  watchdog.key(unlock);
  watchdog.put(offsetof(IwdgRegisters, pr), 6);
  watchdog.pass(5 * lsi_cycle);
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

TEST(Iwdg, AResetStopsIt) {
  Watchdog watchdog;
  watchdog.key(start);
  watchdog.pass(4096 * 4 * lsi_cycle);
  ASSERT_TRUE(watchdog.fired);
  watchdog.model.reset(watchdog.now);
  EXPECT_FALSE(watchdog.model.running());
  EXPECT_EQ(watchdog.model.next_event(), never);
  EXPECT_EQ(watchdog.get(offsetof(IwdgRegisters, rlr)), 0xFFFU);
  watchdog.key(start);
  EXPECT_EQ(watchdog.model.fires_at(), watchdog.now + 4096 * 4 * lsi_cycle);
}

}  // namespace
}  // namespace kmax::virtual_board::iwdg_test
