// PM0214, system control block.

#include "host_tools/virtual_board/cortex_m/system_control.hpp"

#include <gtest/gtest.h>

#include <cstddef>

#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::system_control_test {

using namespace drivers::cortex_m;
namespace number = exception_number;

struct Block : testing::ModelBench {
  Block() : ModelBench({&control}, 77) {
    exceptions.reset();
    control.reset(0);
  }
  ExceptionTable exceptions{82};
  SystemControl control{exceptions};
};

constexpr std::size_t icsr = offsetof(ScbRegisters, icsr);
constexpr std::size_t vtor = offsetof(ScbRegisters, vtor);
constexpr std::size_t aircr = offsetof(ScbRegisters, aircr);
constexpr std::size_t shpr = offsetof(ScbRegisters, shpr);
constexpr std::size_t shcsr = offsetof(ScbRegisters, shcsr);
constexpr std::size_t cfsr = offsetof(ScbRegisters, cfsr);
constexpr std::size_t hfsr = offsetof(ScbRegisters, hfsr);
constexpr std::size_t cpacr = offsetof(ScbRegisters, cpacr);

TEST(SystemControl, IsACortexM4_Cpuid) {
  Block block;
  EXPECT_EQ(block.read(0), 0x410F'C241U);
  EXPECT_THROW(block.write(0, 1), RefusedAccess);
}

TEST(SystemControl, PendsAndClearsSystemExceptions_Icsr) {
  Block block;
  block.write(icsr, scb_icsr::SupervisorPending::mask | scb_icsr::SystemTickPending::mask);
  EXPECT_TRUE(block.exceptions.pending(number::pend_supervisor));
  EXPECT_TRUE(block.exceptions.pending(number::system_tick));
  const std::uint32_t state = block.read(icsr);
  EXPECT_EQ(scb_icsr::SupervisorPending::of(state), 1U);
  EXPECT_EQ(scb_icsr::SystemTickPending::of(state), 1U);
  EXPECT_EQ(scb_icsr::PendingVector::of(state), number::pend_supervisor);
  EXPECT_EQ(scb_icsr::InterruptPending::of(state), 0U);
  block.write(icsr, scb_icsr::SupervisorPendingClear::mask | scb_icsr::SystemTickPendingClear::mask);
  EXPECT_EQ(scb_icsr::PendingVector::of(block.read(icsr)), 0U);
}

TEST(SystemControl, ShowsWhatIsActiveAndPending_Icsr) {
  Block block;
  block.exceptions.set_enabled(54, true);
  block.exceptions.pend(54);
  EXPECT_EQ(scb_icsr::InterruptPending::of(block.read(icsr)), 1U);
  EXPECT_EQ(scb_icsr::PendingVector::of(block.read(icsr)), 54U);
  block.exceptions.activate(54);
  block.control.set_active_exception(54);
  EXPECT_EQ(scb_icsr::ActiveVector::of(block.read(icsr)), 54U);
  EXPECT_EQ(scb_icsr::ReturnToBase::of(block.read(icsr)), 1U);
  block.exceptions.pend(number::system_tick);
  block.exceptions.activate(number::system_tick);
  EXPECT_EQ(scb_icsr::ReturnToBase::of(block.read(icsr)), 0U);
}

TEST(SystemControl, TakesAnAlignedVectorTable_Vtor) {
  Block block;
  EXPECT_EQ(block.read(vtor), 0U);
  block.write(vtor, 0x2000'0200);
  EXPECT_EQ(block.control.vector_table(), 0x2000'0200U);
  EXPECT_THROW(block.write(vtor, 0x2000'0100), RefusedAccess);
  EXPECT_EQ(block.read(vtor), 0x2000'0200U);
}

TEST(SystemControl, WantsTheKeyForGroupingAndReset_Aircr) {
  Block block;
  EXPECT_EQ(block.read(aircr), 0xFA05'0000U);
  block.write(aircr, 0x05FA'0500);
  EXPECT_EQ(block.read(aircr), 0xFA05'0500U);
  EXPECT_EQ(block.exceptions.priority_group(), 5U);
  EXPECT_THROW(block.write(aircr, 0x0000'0004), RefusedAccess);
  EXPECT_THROW(block.write(aircr, 0x05FA'0001), RefusedAccess);
  EXPECT_FALSE(block.control.reset_requested());
  BoardTime requested = 0;
  block.control.on_reset_request([&](BoardTime now) { requested = now; });
  block.write(aircr, 0x05FA'0004);
  EXPECT_TRUE(block.control.reset_requested());
  EXPECT_EQ(requested, 77U);
  block.control.reset(100);
  EXPECT_FALSE(block.control.reset_requested());
}

TEST(SystemControl, TakesPrioritiesAsBytesAndWords_Shpr) {
  Block block;
  block.write(shpr + 11, 0xF0, 1);  // SysTick
  EXPECT_EQ(block.exceptions.priority(number::system_tick), 0xF0);
  block.write(shpr + 8, 0x1234'0000);
  EXPECT_EQ(block.read(shpr + 8), 0x1030'0000U);
  EXPECT_EQ(block.exceptions.priority(number::pend_supervisor), 0x30);
  EXPECT_EQ(block.read(shpr + 11, 1), 0x10U);
  block.write(shpr + 4, 0x7000'0000);
  EXPECT_EQ(block.exceptions.priority(number::supervisor_call), 0x70);
  EXPECT_THROW(block.write(shpr + 4, 0x0000'0010), RefusedAccess) << "exception 8 is reserved";
  EXPECT_THROW(block.write(shpr + 3, 0x10, 1), RefusedAccess);
}

TEST(SystemControl, EnablesConfigurableFaults_Shcsr) {
  Block block;
  block.write(shcsr, scb_shcsr::BusFaultEnable::mask);
  EXPECT_TRUE(block.exceptions.enabled(number::bus_fault));
  EXPECT_FALSE(block.exceptions.enabled(number::usage_fault));
  EXPECT_EQ(block.read(shcsr), scb_shcsr::BusFaultEnable::mask);
  EXPECT_THROW(block.write(shcsr, scb_shcsr::SystemTickActive::mask), RefusedAccess);
  block.exceptions.pend(number::system_tick);
  block.exceptions.activate(number::system_tick);
  EXPECT_EQ(block.read(shcsr), scb_shcsr::BusFaultEnable::mask | scb_shcsr::SystemTickActive::mask);
}

TEST(SystemControl, EscalatesFaults_FaultEscalation) {
  Block block;
  EXPECT_TRUE(block.control.raise_fault(number::usage_fault, scb_cfsr::UndefinedInstruction::mask,
                                        ExceptionTable::base_level));
  EXPECT_TRUE(block.exceptions.pending(number::hard_fault));
  EXPECT_EQ(block.read(hfsr), scb_hfsr::Forced::mask);
  EXPECT_EQ(block.read(cfsr), scb_cfsr::UndefinedInstruction::mask);
  block.write(hfsr, scb_hfsr::Forced::mask);
  block.write(cfsr, 0xFFFF'FFFF);
  EXPECT_EQ(block.read(hfsr) | block.read(cfsr), 0U);

  Block enabled;
  enabled.write(shcsr, scb_shcsr::BusFaultEnable::mask);
  enabled.write(shpr + 1, 0x20, 1);
  EXPECT_TRUE(enabled.control.raise_fault(number::bus_fault, scb_cfsr::PreciseBusFault::mask, 0x30));
  EXPECT_TRUE(enabled.exceptions.pending(number::bus_fault));
  EXPECT_FALSE(enabled.exceptions.pending(number::hard_fault));
  EXPECT_TRUE(enabled.control.raise_fault(number::bus_fault, scb_cfsr::PreciseBusFault::mask, 0x20))
      << "not urgent enough";
  EXPECT_TRUE(enabled.exceptions.pending(number::hard_fault));
  EXPECT_FALSE(enabled.control.raise_fault(number::bus_fault, 0, -1)) << "lock-up";
}

TEST(SystemControl, SwitchesTheFpu_Cpacr) {
  Block block;
  EXPECT_FALSE(block.control.fpu_enabled());
  block.write(cpacr, 0xFU << 20);
  EXPECT_TRUE(block.control.fpu_enabled());
  EXPECT_THROW(block.write(cpacr, 0x5U << 20), RefusedAccess) << "privileged access only";
  EXPECT_THROW(block.write(cpacr, 0x3U << 20), RefusedAccess) << "one of the two coprocessors";
  EXPECT_THROW(block.write(cpacr, 1), RefusedAccess);
  block.control.reset(0);
  EXPECT_FALSE(block.control.fpu_enabled());
}

TEST(SystemControl, RefusesModesThatAreNotModelled) {
  Block block;
  EXPECT_NO_THROW(block.write(offsetof(ScbRegisters, scr), 0));
  for (const std::uint32_t bit : {1U << 1, 1U << 2, 1U << 4}) {
    EXPECT_THROW(block.write(offsetof(ScbRegisters, scr), bit), RefusedAccess);
  }
  EXPECT_EQ(block.read(offsetof(ScbRegisters, ccr)), 0x200U);
  EXPECT_NO_THROW(block.write(offsetof(ScbRegisters, ccr), 0x200));
  EXPECT_THROW(block.write(offsetof(ScbRegisters, ccr), 0x210), RefusedAccess);
  EXPECT_THROW(block.write(offsetof(ScbRegisters, ccr), 0), RefusedAccess);
  EXPECT_THROW(block.read(offsetof(ScbRegisters, reserved_3c)), RefusedAccess);
  EXPECT_THROW(block.read(icsr, 2), RefusedAccess);
}

}  // namespace kmax::virtual_board::system_control_test
