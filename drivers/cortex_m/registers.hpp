#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// The core's own peripherals of a Cortex-M4, whoever built the chip around it.

namespace kmax::drivers::cortex_m {

// Nested vectored interrupt controller: PM0214, NVIC. The priority registers are bytes on the bus; they are
// declared as words (four interrupts each) so that the whole block is of one type and a test can stand in for
// it.

struct NvicRegisters {
  volatile std::uint32_t iser[8];
  std::uint32_t reserved_020[24];
  volatile std::uint32_t icer[8];
  std::uint32_t reserved_0a0[24];
  volatile std::uint32_t ispr[8];
  std::uint32_t reserved_120[24];
  volatile std::uint32_t icpr[8];
  std::uint32_t reserved_1a0[24];
  volatile std::uint32_t iabr[8];
  std::uint32_t reserved_220[56];
  volatile std::uint32_t ipr[60];
};
static_assert(offsetof(NvicRegisters, iser) == 0x000);
static_assert(offsetof(NvicRegisters, icer) == 0x080);
static_assert(offsetof(NvicRegisters, ispr) == 0x100);
static_assert(offsetof(NvicRegisters, icpr) == 0x180);
static_assert(offsetof(NvicRegisters, ipr) == 0x300);

inline constexpr std::uint32_t nvic_base = 0xE000'E100;

inline NvicRegisters& nvic() {
  return peripheral_at<NvicRegisters>(nvic_base);
}

/// STIR: pends the interrupt whose number is written; lies apart from the rest.
struct SoftwareTriggerRegisters {
  volatile std::uint32_t stir;
};

inline constexpr std::uint32_t software_trigger_base = 0xE000'EF00;

inline SoftwareTriggerRegisters& software_trigger() {
  return peripheral_at<SoftwareTriggerRegisters>(software_trigger_base);
}

namespace nvic_stir {
using InterruptNumber = Field<0, 9>;
}  // namespace nvic_stir

// System control block of the Cortex-M4: PM0214, system control block. Includes CPACR, which switches the FPU
// on.

struct ScbRegisters {
  volatile std::uint32_t cpuid;
  volatile std::uint32_t icsr;
  volatile std::uint32_t vtor;
  volatile std::uint32_t aircr;
  volatile std::uint32_t scr;
  volatile std::uint32_t ccr;
  volatile std::uint32_t shpr[3];
  volatile std::uint32_t shcsr;
  volatile std::uint32_t cfsr;
  volatile std::uint32_t hfsr;
  volatile std::uint32_t dfsr;
  volatile std::uint32_t mmfar;
  volatile std::uint32_t bfar;
  std::uint32_t reserved_3c[19];
  volatile std::uint32_t cpacr;
};
static_assert(offsetof(ScbRegisters, icsr) == 0x04);
static_assert(offsetof(ScbRegisters, vtor) == 0x08);
static_assert(offsetof(ScbRegisters, aircr) == 0x0C);
static_assert(offsetof(ScbRegisters, ccr) == 0x14);
static_assert(offsetof(ScbRegisters, shpr) == 0x18);
static_assert(offsetof(ScbRegisters, shcsr) == 0x24);
static_assert(offsetof(ScbRegisters, cfsr) == 0x28);
static_assert(offsetof(ScbRegisters, hfsr) == 0x2C);
static_assert(offsetof(ScbRegisters, mmfar) == 0x34);
static_assert(offsetof(ScbRegisters, bfar) == 0x38);
static_assert(offsetof(ScbRegisters, cpacr) == 0x88);

inline constexpr std::uint32_t scb_base = 0xE000'ED00;

inline ScbRegisters& scb() {
  return peripheral_at<ScbRegisters>(scb_base);
}

namespace scb_icsr {
using ActiveVector = Field<0, 9>;          // VECTACTIVE: 0 in thread mode, else the exception number
using ReturnToBase = Field<11>;            // RETTOBASE: no other exception is active
using PendingVector = Field<12, 9>;        // VECTPENDING: the most urgent one that is pending and enabled
using InterruptPending = Field<22>;        // ISRPENDING
using SystemTickPendingClear = Field<25>;  // PENDSTCLR
using SystemTickPending = Field<26>;       // PENDSTSET
using SupervisorPendingClear = Field<27>;  // PENDSVCLR
using SupervisorPending = Field<28>;       // PENDSVSET
using NonMaskablePending = Field<31>;      // NMIPENDSET
}  // namespace scb_icsr

namespace scb_vtor {
using TableOffset = Field<9, 21>;  // the table is aligned to 512 bytes
}  // namespace scb_vtor

namespace scb_aircr {
using SystemResetRequest = Field<2>;
using PriorityGroup =
    Field<8, 3>;  // PRIGROUP: bits 7 to PRIGROUP + 1 of a priority pre-empt, the rest is order
using Key = Field<16, 16>;
inline constexpr std::uint32_t key = 0x05FA;       // a write without it is ignored
inline constexpr std::uint32_t key_read = 0xFA05;  // what the field reads as
}  // namespace scb_aircr

namespace scb_ccr {
using ThreadFromAnyLevel = Field<0>;  // NONBASETHRDENA
using UserTrigger = Field<1>;         // USERSETMPEND: STIR from unprivileged code
using TrapUnaligned = Field<3>;
using TrapDivisionByZero = Field<4>;
using IgnoreBusFaults = Field<8>;  // BFHFNMIGN
using AlignStack = Field<9>;       // STKALIGN: frames begin at a multiple of 8
}  // namespace scb_ccr

namespace scb_shcsr {
using MemoryFaultActive = Field<0>;
using BusFaultActive = Field<1>;
using UsageFaultActive = Field<3>;
using SupervisorCallActive = Field<7>;
using PendSupervisorActive = Field<10>;
using SystemTickActive = Field<11>;
using MemoryFaultEnable = Field<16>;
using BusFaultEnable = Field<17>;
using UsageFaultEnable = Field<18>;
}  // namespace scb_shcsr

/// All three fault status registers in one word: MMFSR 7:0, BFSR 15:8, UFSR 31:16. Cleared by writing ones.
namespace scb_cfsr {
using FetchViolation = Field<0>;           // IACCVIOL: fetch from where no code may be
using DataViolation = Field<1>;            // DACCVIOL: data access that the memory protection forbids
using MemoryFaultUnstacking = Field<3>;    // MUNSTKERR
using MemoryFaultStacking = Field<4>;      // MSTKERR
using MemoryFaultLazyFloat = Field<5>;     // MLSPERR
using MemoryFaultAddressValid = Field<7>;  // MMARVALID
using FetchBusFault = Field<8>;            // IBUSERR
using PreciseBusFault = Field<9>;          // PRECISERR: BFAR and the stacked PC belong to the access
using ImpreciseBusFault = Field<10>;       // IMPRECISERR: noticed some instructions later
using BusFaultUnstacking = Field<11>;      // UNSTKERR
using BusFaultStacking = Field<12>;        // STKERR
using BusFaultLazyFloat = Field<13>;       // LSPERR
using BusFaultAddressValid = Field<15>;    // BFARVALID
using UndefinedInstruction = Field<16>;
using InvalidState = Field<17>;
using InvalidReturn = Field<18>;    // INVPC: an exception return that does not fit
using NoCoprocessor = Field<19>;    // NOCP
using UnalignedAccess = Field<24>;  // UNALIGNED
using DivisionByZero = Field<25>;   // DIVBYZERO
}  // namespace scb_cfsr

namespace scb_hfsr {
using VectorTableRead = Field<1>;  // VECTTBL: bus fault on reading the vector table
using Forced = Field<30>;          // a fault whose own handler is disabled or not urgent enough
}  // namespace scb_hfsr

namespace scb_cpacr {
using FpuAccess = Field<20, 4>;  // CP10 and CP11; 0xF = full access
}  // namespace scb_cpacr

// SysTick, the core's own 24-bit down-counter: PM0214, system timer.

struct SystemTickRegisters {
  volatile std::uint32_t ctrl;
  volatile std::uint32_t load;
  volatile std::uint32_t val;
  volatile std::uint32_t calib;
};
static_assert(offsetof(SystemTickRegisters, ctrl) == 0x00);
static_assert(offsetof(SystemTickRegisters, load) == 0x04);
static_assert(offsetof(SystemTickRegisters, val) == 0x08);

static_assert(offsetof(SystemTickRegisters, calib) == 0x0C);

inline constexpr std::uint32_t system_tick_base = 0xE000'E010;

inline SystemTickRegisters& system_tick() {
  return peripheral_at<SystemTickRegisters>(system_tick_base);
}

namespace system_tick_ctrl {
using Enable = Field<0>;
using TickInterrupt = Field<1>;
using ProcessorClock = Field<2>;  // CLKSOURCE: 0 counts every eighth cycle of AHB
using CountFlag = Field<16>;      // COUNTFLAG: counted to 0 since the last read of this register
}  // namespace system_tick_ctrl

namespace system_tick_load {
using Reload = Field<0, 24>;
}  // namespace system_tick_load

namespace system_tick_calib {
using TenMilliseconds = Field<0, 24>;
using Skewed = Field<30>;       // the value above is not exact
using NoReference = Field<31>;  // no clock of its own
}  // namespace system_tick_calib

// Memory protection unit of the Cortex-M4, eight regions: PM0214, memory protection unit.

inline constexpr unsigned mpu_region_count = 8;

struct MpuRegisters {
  volatile std::uint32_t type;
  volatile std::uint32_t ctrl;
  volatile std::uint32_t rnr;
  volatile std::uint32_t rbar;
  volatile std::uint32_t rasr;
  volatile std::uint32_t alias[6];  // RBAR and RASR three times more, for block writes
};
static_assert(offsetof(MpuRegisters, ctrl) == 0x04);
static_assert(offsetof(MpuRegisters, rnr) == 0x08);
static_assert(offsetof(MpuRegisters, rbar) == 0x0C);
static_assert(offsetof(MpuRegisters, rasr) == 0x10);
static_assert(sizeof(MpuRegisters) == 0x2C);

inline constexpr std::uint32_t mpu_base = 0xE000'ED90;

inline MpuRegisters& mpu() {
  return peripheral_at<MpuRegisters>(mpu_base);
}

namespace mpu_type {
using RegionCount = Field<8, 8>;  // DREGION
}  // namespace mpu_type

namespace mpu_ctrl {
using Enable = Field<0>;
using InFaultHandlers = Field<1>;    // HFNMIENA
using PrivilegedDefault = Field<2>;  // PRIVDEFENA: privileged code sees the rest of the map unprotected
}  // namespace mpu_ctrl

namespace mpu_rbar {
using Region = Field<0, 4>;  // taken over into RNR when Valid is written as 1
using Valid = Field<4>;
using Address = Field<5, 27>;
}  // namespace mpu_rbar

namespace mpu_rasr {
using Enable = Field<0>;
using Size = Field<1, 5>;  // the region has 2^(Size + 1) bytes, at least 32
using SubregionDisable = Field<8, 8>;
using Bufferable = Field<16>;
using Cacheable = Field<17>;
using Shareable = Field<18>;
using TypeExtension = Field<19, 3>;
using Permission = Field<24, 3>;  // AP
using ExecuteNever = Field<28>;
}  // namespace mpu_rasr

// Control of the floating-point context over exceptions, and what the unit can do: PM0214, floating-point
// unit.

struct FloatingPointRegisters {
  volatile std::uint32_t fpccr;
  volatile std::uint32_t fpcar;
  volatile std::uint32_t fpdscr;
  volatile std::uint32_t mvfr0;
  volatile std::uint32_t mvfr1;
};
static_assert(offsetof(FloatingPointRegisters, fpcar) == 0x04);
static_assert(offsetof(FloatingPointRegisters, fpdscr) == 0x08);
static_assert(offsetof(FloatingPointRegisters, mvfr1) == 0x10);

inline constexpr std::uint32_t floating_point_base = 0xE000'EF34;

inline FloatingPointRegisters& floating_point() {
  return peripheral_at<FloatingPointRegisters>(floating_point_base);
}

namespace floating_point_fpccr {
using LazyActive = Field<0>;         // LSPACT: room is reserved on the stack, the registers not yet written
using LazyPreservation = Field<30>;  // LSPEN
using AutomaticPreservation = Field<31>;  // ASPEN: an FP instruction sets CONTROL.FPCA
}  // namespace floating_point_fpccr

// Debug control of the Cortex-M4, as far as firmware uses it: DEMCR switches the cycle counter's block on.
// ARMv7-M architecture reference manual, C1.6.

struct CoreDebugRegisters {
  volatile std::uint32_t dhcsr;
  volatile std::uint32_t dcrsr;
  volatile std::uint32_t dcrdr;
  volatile std::uint32_t demcr;
};
static_assert(offsetof(CoreDebugRegisters, demcr) == 0x0C);

inline constexpr std::uint32_t core_debug_base = 0xE000'EDF0;

inline CoreDebugRegisters& core_debug() {
  return peripheral_at<CoreDebugRegisters>(core_debug_base);
}

namespace core_debug_dhcsr {
using DebuggerAttached = Field<0>;  // C_DEBUGEN
}  // namespace core_debug_dhcsr

namespace core_debug_demcr {
using TraceEnable = Field<24>;  // TRCENA: clocks DWT and ITM
}  // namespace core_debug_demcr

// Data watchpoint and trace unit of the Cortex-M4, its cycle counter only. ARMv7-M architecture reference
// manual, C1.8. Dead until DEMCR.TRCENA is set (core_debug_demcr, above).

struct DwtRegisters {
  volatile std::uint32_t ctrl;
  volatile std::uint32_t cyccnt;
};
static_assert(offsetof(DwtRegisters, ctrl) == 0x00);
static_assert(offsetof(DwtRegisters, cyccnt) == 0x04);

inline constexpr std::uint32_t dwt_base = 0xE000'1000;

inline DwtRegisters& dwt() {
  return peripheral_at<DwtRegisters>(dwt_base);
}

namespace dwt_ctrl {
using CycleCounterEnable = Field<0>;  // CYCCNTENA
using NoCycleCounter = Field<25>;     // NOCYCCNT; read only
using Comparators = Field<28, 4>;     // NUMCOMP; read only
}  // namespace dwt_ctrl

}  // namespace kmax::drivers::cortex_m
