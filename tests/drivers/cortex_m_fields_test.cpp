// The fields of each of the core's registers lie apart, and where PM0214 and the ARMv7-M manual have them.
#include <gtest/gtest.h>

#include "drivers/cortex_m/registers.hpp"

namespace kmax::drivers::cortex_m::cortex_m_fields_test {
namespace {

/// All bits of the fields; none if two of them overlap.
template <typename... Fields>
constexpr std::uint32_t bits_of() {
  std::uint32_t all = 0;
  bool apart = true;
  ((apart = apart && (all & Fields::mask) == 0, all |= Fields::mask), ...);
  return apart ? all : 0;
}

TEST(CortexMFields, CoverTheBitsOfTheManual) {
  {
    using namespace nvic_stir;
    EXPECT_EQ((bits_of<InterruptNumber>()), 0x0000'01FFU);
  }
  {
    using namespace scb_icsr;
    EXPECT_EQ((bits_of<ActiveVector, ReturnToBase, PendingVector, InterruptPending, SystemTickPendingClear,
                       SystemTickPending, SupervisorPendingClear, SupervisorPending, NonMaskablePending>()),
              0x9E5F'F9FFU);
  }
  {
    using namespace scb_vtor;
    EXPECT_EQ((bits_of<TableOffset>()), 0x3FFF'FE00U);
  }
  {
    using namespace scb_aircr;
    EXPECT_EQ((bits_of<SystemResetRequest, Key>()), 0xFFFF'0004U);
  }
  {
    using namespace scb_ccr;
    EXPECT_EQ((bits_of<ThreadFromAnyLevel, UserTrigger, TrapUnaligned, TrapDivisionByZero, IgnoreBusFaults,
                       AlignStack>()),
              0x0000'031BU);
  }
  {
    using namespace scb_shcsr;
    EXPECT_EQ((bits_of<MemoryFaultActive, BusFaultActive, UsageFaultActive, SupervisorCallActive,
                       PendSupervisorActive, SystemTickActive, MemoryFaultEnable, BusFaultEnable,
                       UsageFaultEnable>()),
              0x0007'0C8BU);
  }
  {
    using namespace scb_cfsr;
    EXPECT_EQ((bits_of<FetchViolation, DataViolation, MemoryFaultUnstacking, MemoryFaultStacking,
                       MemoryFaultLazyFloat, MemoryFaultAddressValid, FetchBusFault, PreciseBusFault,
                       ImpreciseBusFault, BusFaultUnstacking, BusFaultStacking, BusFaultLazyFloat,
                       BusFaultAddressValid, UndefinedInstruction, InvalidState, InvalidReturn, NoCoprocessor,
                       UnalignedAccess, DivisionByZero>()),
              0x030F'BFBBU);
  }
  {
    using namespace scb_hfsr;
    EXPECT_EQ((bits_of<VectorTableRead, Forced>()), 0x4000'0002U);
  }
  {
    using namespace scb_cpacr;
    EXPECT_EQ((bits_of<FpuAccess>()), 0x00F0'0000U);
  }
  {
    using namespace system_tick_ctrl;
    EXPECT_EQ((bits_of<Enable, TickInterrupt, ProcessorClock, CountFlag>()), 0x0001'0007U);
  }
  {
    using namespace system_tick_load;
    EXPECT_EQ((bits_of<Reload>()), 0x00FF'FFFFU);
  }
  {
    using namespace system_tick_calib;
    EXPECT_EQ((bits_of<TenMilliseconds, Skewed, NoReference>()), 0xC0FF'FFFFU);
  }
  {
    using namespace mpu_type;
    EXPECT_EQ((bits_of<RegionCount>()), 0x0000'FF00U);
  }
  {
    using namespace mpu_ctrl;
    EXPECT_EQ((bits_of<Enable, InFaultHandlers, PrivilegedDefault>()), 0x0000'0007U);
  }
  {
    using namespace mpu_rbar;
    EXPECT_EQ((bits_of<Region, Valid, Address>()), 0xFFFF'FFFFU);
  }
  {
    using namespace mpu_rasr;
    EXPECT_EQ((bits_of<Enable, Size, SubregionDisable, Bufferable, Cacheable, Shareable, TypeExtension,
                       Permission, ExecuteNever>()),
              0x173F'FF3FU);
  }
  {
    using namespace floating_point_fpccr;
    EXPECT_EQ((bits_of<LazyActive, LazyPreservation, AutomaticPreservation>()), 0xC000'0001U);
  }
  {
    using namespace core_debug_dhcsr;
    EXPECT_EQ((bits_of<DebuggerAttached>()), 0x0000'0001U);
  }
  {
    using namespace core_debug_demcr;
    EXPECT_EQ((bits_of<TraceEnable>()), 0x0100'0000U);
  }
  {
    using namespace dwt_ctrl;
    EXPECT_EQ((bits_of<CycleCounterEnable, NoCycleCounter, Comparators>()), 0xF200'0001U);
  }
}

}  // namespace
}  // namespace kmax::drivers::cortex_m::cortex_m_fields_test
