#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// System control block of the Cortex-M4: PM0214, system control block. Includes CPACR, which switches the FPU
// on.

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

inline ScbRegisters& scb() {
  return peripheral_at<ScbRegisters>(0xE000'ED00);
}

namespace scb_icsr {
using ActiveVector = Field<0, 9>;     // VECTACTIVE: 0 in thread mode, else the exception number
using SystemTickPending = Field<26>;  // PENDSTSET
}  // namespace scb_icsr

namespace scb_aircr {
using SystemResetRequest = Field<2>;
using Key = Field<16, 16>;
inline constexpr std::uint32_t key = 0x05FA;  // a write without it is ignored
}  // namespace scb_aircr

namespace scb_cpacr {
using FpuAccess = Field<20, 4>;  // CP10 and CP11; 0xF = full access
}  // namespace scb_cpacr

}  // namespace kmax::drivers::stm32f4
