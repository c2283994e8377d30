// drivers/stm32f4/independent_watchdog.hpp on the model of the watchdog.
#include "drivers/stm32f4/independent_watchdog.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstddef>
#include <optional>

#include "host_tools/virtual_board/stm32f4/device_identity.hpp"
#include "host_tools/virtual_board/stm32f4/iwdg.hpp"
#include "tests/host_tools/virtual_board/stm32f4/timed_register.hpp"

namespace kmax::virtual_board::independent_watchdog_on_model_test {
namespace {

namespace stm32 = drivers::stm32f4;
using testing::TimedBus;
using testing::TimedRegister;

struct IwdgOnModel {
  TimedRegister kr, pr, rlr, sr;
};
struct DbgmcuOnModel {
  TimedRegister apb1_fz;
};

struct Chip {
  IwdgModel model;
  DbgmcuModel debug;
  TimedBus bus{{&model}};
  IwdgOnModel registers{{bus, model, offsetof(stm32::IwdgRegisters, kr)},
                        {bus, model, offsetof(stm32::IwdgRegisters, pr)},
                        {bus, model, offsetof(stm32::IwdgRegisters, rlr)},
                        {bus, model, offsetof(stm32::IwdgRegisters, sr)}};
  DbgmcuOnModel debug_registers{{bus, debug, offsetof(stm32::DbgmcuRegisters, apb1_fz)}};
  stm32::IndependentWatchdog<IwdgOnModel, DbgmcuOnModel> watchdog{registers, debug_registers};
  std::optional<BoardTime> fired;

  explicit Chip(std::uint32_t lsi_hz = 32'000) {
    model.set_oscillator_hz(lsi_hz);
    model.on_reset([this](BoardTime at) { fired = at; });
  }
};

TEST(IndependentWatchdogOnModel, FiresAtTheComputedTimeAndNotBefore) {
  Chip chip;
  ASSERT_TRUE(chip.watchdog.start(1000));
  const BoardTime fed = chip.bus.now - chip.bus.access_time;
  const BoardTime due = fed + (2938 + 1) * 16 * BoardTime{10'500};
  chip.bus.pass(due - chip.bus.now - 1);
  EXPECT_FALSE(chip.fired);
  chip.bus.pass(1);
  EXPECT_EQ(chip.fired, due);
}

RC_GTEST_PROP(IndependentWatchdogOnModel, FedInTimeItNeverFiresAndUnfedItFiresInTime, ()) {
  const auto hz = *rc::gen::inRange<std::uint32_t>(17'000, 47'001);
  const auto period = *rc::gen::inRange<std::uint32_t>(1, 22'001);
  const stm32::IndependentWatchdogTiming timing = stm32::independent_watchdog_timing(period);
  Chip chip{hz};
  RC_ASSERT(chip.watchdog.start(timing));
  for (int feed = 0; feed < 4; ++feed) {
    chip.bus.pass(timing.guaranteed_not_before_us * units_per_microsecond - chip.bus.access_time);
    RC_ASSERT(!chip.fired);
    chip.watchdog.feed();
  }
  const BoardTime fed = chip.bus.now - chip.bus.access_time;
  chip.bus.pass(timing.fires_at_latest_us * units_per_microsecond);
  RC_ASSERT(chip.fired.has_value());
  RC_ASSERT(*chip.fired - fed >= timing.guaranteed_not_before_us * units_per_microsecond);
  RC_ASSERT(*chip.fired - fed <= timing.fires_at_latest_us * units_per_microsecond);
}

TEST(IndependentWatchdogOnModel, StartedAgainWithAnotherPeriod) {
  Chip chip;
  ASSERT_TRUE(chip.watchdog.start(10'000));
  ASSERT_TRUE(chip.watchdog.start(100));
  chip.bus.pass(150 * 1000 * units_per_microsecond);
  EXPECT_TRUE(chip.fired) << "1176 x 4 cycles: 147 ms";
}

TEST(IndependentWatchdogOnModel, StartIsOverWithinAMillisecond) {
  for (const std::uint32_t hz : {17'000U, 47'000U}) {
    Chip chip{hz};
    ASSERT_TRUE(chip.watchdog.start(22'000));
    EXPECT_LT(seconds(chip.bus.now), 1e-3);
  }
}

}  // namespace
}  // namespace kmax::virtual_board::independent_watchdog_on_model_test
