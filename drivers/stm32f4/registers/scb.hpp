#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// System control block of the Cortex-M4: PM0214, system control block. Includes CPACR, which switches the FPU
// on. The other blocks of the core stand in mpu.hpp, floating_point_unit.hpp and core_debug.hpp.

namespace kmax::drivers::stm32f4 {

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
using NoCoprocessor = Field<18>;    // NOCP
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

}  // namespace kmax::drivers::stm32f4
