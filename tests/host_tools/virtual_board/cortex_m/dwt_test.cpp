#include "host_tools/virtual_board/cortex_m/dwt.hpp"

#include <gtest/gtest.h>

#include <cstddef>

#include "drivers/cortex_m/cycle_counter.hpp"
#include "tests/host_tools/virtual_board/stm32f4/register_on_model.hpp"

// ARMv7-M architecture reference manual, C1.8 (DWT).

namespace kmax::virtual_board::dwt_test {
namespace {

namespace stm32 = drivers::stm32f4;
using testing::RegisterOnModel;

struct Core {
  std::uint64_t cycles = 5'000'000'000;
  bool trace = true;
  BoardTime now = 0;
  DwtModel model{[this] { return cycles; }, [this] { return trace; }};
  RegisterOnModel ctrl{model, offsetof(drivers::cortex_m::DwtRegisters, ctrl), now};
  RegisterOnModel cyccnt{model, offsetof(drivers::cortex_m::DwtRegisters, cyccnt), now};
  std::uint32_t count() { return static_cast<std::uint32_t>(cyccnt); }
};

TEST(Dwt, CountsCoreCyclesWhileEnabledAndWraps) {
  Core core;
  EXPECT_EQ(static_cast<std::uint32_t>(core.ctrl), 0x4000'0000U);
  core.cycles += 10;
  EXPECT_EQ(core.count(), 0U);
  core.ctrl = 1;
  core.cycles += 10;
  EXPECT_EQ(core.count(), 10U);
  core.cyccnt = 0xFFFF'FFFE;
  core.cycles += 5;
  EXPECT_EQ(core.count(), 3U);
  core.ctrl = 0;
  core.cycles += 100;
  EXPECT_EQ(core.count(), 3U);
  core.ctrl = 1;
  core.cycles += 1;
  EXPECT_EQ(core.count(), 4U) << "goes on from where it stood";
}

TEST(Dwt, NeedsTraceAndRefusesTheRest) {
  Core core;
  EXPECT_THROW(core.ctrl = 1U << 12, RefusedAccess) << "PCSAMPLENA";
  EXPECT_THROW(core.model.read({8, 4, 0}), RefusedAccess) << "CPICNT";
  core.trace = false;
  EXPECT_THROW(core.count(), RefusedAccess);
  EXPECT_THROW(core.ctrl = 1, RefusedAccess);
}

TEST(Dwt, DriverMeasures) {
  Core core;
  struct {
    RegisterOnModel ctrl, cyccnt;
  } dwt{core.ctrl, core.cyccnt};
  struct {
    std::uint32_t demcr = 0;
  } core_debug;
  drivers::cortex_m::CycleCounter counter{dwt, core_debug};
  ASSERT_TRUE(counter.start());
  const std::uint32_t start = counter.now();
  core.cycles += 8'400;
  EXPECT_EQ(counter.since(start), 8'400U);
}

}  // namespace
}  // namespace kmax::virtual_board::dwt_test
