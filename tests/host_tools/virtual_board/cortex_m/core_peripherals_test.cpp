// The small blocks of the core: ARMv7-M architecture reference manual, C1.6 (DHCSR and DEMCR) and C1.8 (DWT);
// PM0214, floating-point unit and memory protection unit.

#include "host_tools/virtual_board/cortex_m/core_peripherals.hpp"

#include <gtest/gtest.h>

#include <cstddef>

#include "drivers/cortex_m/cycle_counter.hpp"
#include "drivers/cortex_m/interrupt_controller.hpp"
#include "drivers/cortex_m/system_tick.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::core_peripherals_test {

using namespace drivers::cortex_m;

constexpr std::uint32_t demcr = offsetof(CoreDebugRegisters, demcr);

TEST(CoreDebug, SwitchesTraceOnAndKeepsItOverAReset_Demcr) {
  CoreDebug debug;
  EXPECT_FALSE(debug.trace_enabled());
  debug.write({demcr, 4, 0}, core_debug_demcr::TraceEnable::mask);
  EXPECT_TRUE(debug.trace_enabled());
  EXPECT_EQ(debug.read({demcr, 4, 0}), 1U << 24);
  debug.reset(0);
  EXPECT_TRUE(debug.trace_enabled());
}

TEST(CoreDebug, HasNoDebugger_Dhcsr) {
  CoreDebug debug;
  EXPECT_EQ(debug.read({offsetof(CoreDebugRegisters, dhcsr), 4, 0}), 0U);
  EXPECT_THROW(debug.write({offsetof(CoreDebugRegisters, dhcsr), 4, 0}, 1), RefusedAccess);
  EXPECT_THROW(debug.write({demcr, 4, 0}, 1), RefusedAccess);
  EXPECT_THROW(debug.read({offsetof(CoreDebugRegisters, dcrdr), 4, 0}), RefusedAccess);
}

using testing::RegisterOnModel;

struct DwtOnModel {
  RegisterOnModel ctrl, cyccnt;
};
struct CycleCounting : testing::ModelBench {
  CycleCounting() : ModelBench({&model}) {}
  std::uint32_t count() { return static_cast<std::uint32_t>(dwt.cyccnt); }

  std::uint64_t cycles = 5'000'000'000;
  bool trace = true;
  DwtModel model{[this] { return cycles; }, [this] { return trace; }};
  DwtOnModel dwt = block_on_model<DwtOnModel>(*this, model);
};

TEST(Dwt, CountsCoreCyclesWhileEnabledAndWraps) {
  CycleCounting core;
  EXPECT_EQ(static_cast<std::uint32_t>(core.dwt.ctrl), 0x4000'0000U);
  core.cycles += 10;
  EXPECT_EQ(core.count(), 0U);
  core.dwt.ctrl = 1;
  core.cycles += 10;
  EXPECT_EQ(core.count(), 10U);
  core.dwt.cyccnt = 0xFFFF'FFFE;
  core.cycles += 5;
  EXPECT_EQ(core.count(), 3U);
  core.dwt.ctrl = 0;
  core.cycles += 100;
  EXPECT_EQ(core.count(), 3U);
  core.dwt.ctrl = 1;
  core.cycles += 1;
  EXPECT_EQ(core.count(), 4U) << "goes on from where it stood";
}

TEST(Dwt, NeedsTraceAndRefusesTheRest) {
  CycleCounting core;
  EXPECT_THROW(core.dwt.ctrl = 1U << 12, RefusedAccess) << "PCSAMPLENA";
  EXPECT_THROW(core.read(8), RefusedAccess) << "CPICNT";
  core.trace = false;
  EXPECT_THROW(core.count(), RefusedAccess);
  EXPECT_THROW(core.dwt.ctrl = 1, RefusedAccess);
}

TEST(Dwt, DriverMeasures) {
  CycleCounting core;
  struct {
    std::uint32_t demcr = 0;
  } core_debug;
  CycleCounter counter{core.dwt, core_debug};
  ASSERT_TRUE(counter.start());
  const std::uint32_t start = counter.now();
  core.cycles += 8'400;
  EXPECT_EQ(counter.since(start), 8'400U);
}

constexpr std::uint32_t fpccr = offsetof(FloatingPointRegisters, fpccr);
constexpr std::uint32_t fpcar = offsetof(FloatingPointRegisters, fpcar);

TEST(FloatingPointControl, PreservesLazilyAfterReset_Fpccr) {
  FloatingPointControl control;
  EXPECT_EQ(control.read({fpccr, 4, 0}), 0xC000'0000U);
  EXPECT_TRUE(control.lazy());
  control.write({fpccr, 4, 0}, 0x8000'0000);
  EXPECT_FALSE(control.lazy());
  control.reset(0);
  EXPECT_TRUE(control.lazy());
}

TEST(FloatingPointControl, ShowsThePendingFrame_Fpcar) {
  FloatingPointControl control;
  control.begin_lazy_frame(0x2000'0F38);
  EXPECT_EQ(control.read({fpccr, 4, 0}), 0xC000'0001U);
  EXPECT_EQ(control.read({fpcar, 4, 0}), 0x2000'0F38U);
  control.end_lazy_frame();
  EXPECT_EQ(control.read({fpccr, 4, 0}), 0xC000'0000U);
}

TEST(FloatingPointControl, RefusesOtherModes) {
  FloatingPointControl control;
  EXPECT_THROW(control.write({fpccr, 4, 0}, 0), RefusedAccess);
  EXPECT_THROW(control.write({fpccr, 4, 0}, 0x4000'0000), RefusedAccess);
  EXPECT_THROW(control.write({fpcar, 4, 0}, 0), RefusedAccess);
  EXPECT_NO_THROW(control.write({offsetof(FloatingPointRegisters, fpdscr), 4, 0}, 0));
  EXPECT_THROW(control.write({offsetof(FloatingPointRegisters, fpdscr), 4, 0}, 1U << 24), RefusedAccess);
  EXPECT_THROW(control.read({fpccr, 1, 0}), RefusedAccess);
  EXPECT_EQ(control.read({offsetof(FloatingPointRegisters, mvfr0), 4, 0}), 0x1011'0021U);
  EXPECT_EQ(control.read({offsetof(FloatingPointRegisters, mvfr1), 4, 0}), 0x1100'0011U);
}

constexpr std::uint32_t mpu_control = offsetof(MpuRegisters, ctrl);
constexpr std::uint32_t rnr = offsetof(MpuRegisters, rnr);
constexpr std::uint32_t rbar = offsetof(MpuRegisters, rbar);
constexpr std::uint32_t rasr = offsetof(MpuRegisters, rasr);

struct Unit : testing::ModelBench {
  Unit() : ModelBench({&mpu}) {}
  MemoryProtection mpu;
};

std::uint32_t attributes(std::uint32_t size) {
  return mpu_rasr::Enable::mask | mpu_rasr::Size::bits(size);
}

TEST(MemoryProtection, KeepsEightRegions_RbarRasr) {
  Unit unit;
  EXPECT_EQ(unit.read(0), 8U << 8);
  for (std::uint32_t region = 0; region < 8; ++region) {
    unit.write(rnr, region);
    unit.write(rbar, 0x2000'0000 + 0x100 * region);
    unit.write(rasr, attributes(7));
  }
  for (std::uint32_t region = 0; region < 8; ++region) {
    unit.write(rnr, region);
    EXPECT_EQ(unit.read(rbar), 0x2000'0000 + 0x100 * region + region);
    EXPECT_EQ(unit.read(rasr), attributes(7));
  }
}

TEST(MemoryProtection, SelectsTheRegionThroughRbar_Valid) {
  Unit unit;
  unit.write(rbar, 0x1000'0000 | mpu_rbar::Valid::mask | 5);
  unit.write(rasr, attributes(15));
  EXPECT_EQ(unit.read(rnr), 5U);
  EXPECT_EQ(unit.mpu.region(5).address, 0x1000'0000U);
  unit.write(rbar + 8, 0x2000'0000 | mpu_rbar::Valid::mask | 6);  // RBAR_A1, RASR_A1
  unit.write(rasr + 8, attributes(4));
  EXPECT_EQ(unit.mpu.region(6).address, 0x2000'0000U);
  EXPECT_EQ(unit.mpu.region(6).attributes, attributes(4));
  EXPECT_EQ(unit.mpu.region(5).attributes, attributes(15));
}

TEST(MemoryProtection, AcceptsBeingEnabled_Ctrl) {
  Unit unit;
  EXPECT_FALSE(unit.mpu.enabled());
  unit.write(mpu_control, mpu_ctrl::Enable::mask | mpu_ctrl::PrivilegedDefault::mask);
  EXPECT_TRUE(unit.mpu.enabled());
  EXPECT_THROW(unit.write(mpu_control, mpu_ctrl::InFaultHandlers::mask), RefusedAccess);
  EXPECT_THROW(unit.write(mpu_control, 8), RefusedAccess);
  unit.mpu.reset(0);
  EXPECT_FALSE(unit.mpu.enabled());
}

TEST(MemoryProtection, RefusesRegionsThatTheUnitCannotHave) {
  Unit unit;
  EXPECT_THROW(unit.write(rnr, 8), RefusedAccess);
  EXPECT_THROW(unit.write(rbar, mpu_rbar::Valid::mask | 9), RefusedAccess);
  EXPECT_THROW(unit.write(0, 0), RefusedAccess);
  unit.write(rbar, 0x2000'0020);
  EXPECT_NO_THROW(unit.write(rasr, attributes(4)));
  EXPECT_THROW(unit.write(rasr, attributes(3)), RefusedAccess) << "16 bytes";
  EXPECT_THROW(unit.write(rasr, attributes(5)), RefusedAccess) << "not aligned to 64 bytes";
  unit.write(rbar, 0);
  EXPECT_NO_THROW(unit.write(rasr, attributes(31))) << "all of the address space";
  EXPECT_THROW(unit.read(0, 2), RefusedAccess);
}

// drivers/cortex_m/system_tick.hpp and interrupt_controller.hpp on the models.
struct NvicOnModel {
  RegisterOnModel iser[32], icer[32], ispr[32], icpr[32], iabr[64], ipr[21];
};
struct ScbOnModel {
  RegisterOnModel cpuid, icsr, vtor, aircr, scr, ccr, shpr[3];
};
struct SystemTickOnModel {
  RegisterOnModel ctrl, load, val;
};

struct Core : testing::ModelBench {
  Core() : ModelBench({}, 0) {
    add(peripherals.system_tick);
    clocks.core = 2;
    peripherals.reset(0);
  }
  Bus bus;
  CorePeripherals peripherals{bus, clocks, 82};
  NvicOnModel nvic = block_on_model<NvicOnModel>(*this, peripherals.nvic);
  ScbOnModel scb = block_on_model<ScbOnModel>(*this, peripherals.system_control);
  SystemTickOnModel system_tick = block_on_model<SystemTickOnModel>(*this, peripherals.system_tick);
};

TEST(InterruptControllerOnModel, SetsPrioritiesEnablesAndPends) {
  Core core;
  InterruptController<NvicOnModel, ScbOnModel> controller(core.nvic, core.scb);
  ExceptionTable& table = core.peripherals.exceptions;
  controller.set_priority(drivers::stm32f4::Interrupt::adc, 1);
  controller.set_priority(drivers::stm32f4::Interrupt::usart2, 9);
  controller.set_priority(SystemException::system_tick, 14);
  controller.enable(drivers::stm32f4::Interrupt::adc);
  controller.enable(drivers::stm32f4::Interrupt::usart2);
  EXPECT_EQ(table.priority(16 + 18), 0x10);
  EXPECT_EQ(table.priority(16 + 38), 0x90);
  EXPECT_EQ(table.priority(exception_number::system_tick), 0xE0);
  controller.pend(drivers::stm32f4::Interrupt::usart2);
  EXPECT_EQ(table.candidate(), 16U + 38);
  controller.pend(drivers::stm32f4::Interrupt::adc);
  EXPECT_EQ(table.candidate(), 16U + 18);
  controller.clear_pending(drivers::stm32f4::Interrupt::adc);
  controller.disable(drivers::stm32f4::Interrupt::usart2);
  EXPECT_EQ(table.candidate(), 0U);
}

TEST(SystemTickOnModel, GivesMicroseconds) {
  Core core;
  drivers::cortex_m::SystemTick<SystemTickOnModel, ScbOnModel> driver(core.system_tick, core.scb);
  ASSERT_TRUE(driver.start(168'000'000, 1000));
  std::uint32_t served = 0;
  for (std::uint32_t microsecond = 1; microsecond < 5000; ++microsecond) {
    core.run(2 * 168);
    ASSERT_EQ(driver.now_us(), microsecond) << "pending ticks included";
    if (core.peripherals.exceptions.pending(exception_number::system_tick) && microsecond % 7 == 0) {
      core.peripherals.exceptions.clear_pending(exception_number::system_tick);
      driver.ISR_count();
      ++served;
      ASSERT_EQ(driver.now_us(), microsecond);
    }
  }
  EXPECT_EQ(served, 4U);
}

}  // namespace kmax::virtual_board::core_peripherals_test
