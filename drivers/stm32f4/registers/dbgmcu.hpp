#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Debug support for the peripherals, RM0090 chapter on debug support (DBGMCU): what stops when a debugger
// halts the core. Cleared by power-on reset only.

namespace kmax::drivers::stm32f4 {

struct DbgmcuRegisters {
  volatile std::uint32_t idcode;
  volatile std::uint32_t cr;
  volatile std::uint32_t apb1_fz;
  volatile std::uint32_t apb2_fz;
};
static_assert(offsetof(DbgmcuRegisters, idcode) == 0x00);
static_assert(offsetof(DbgmcuRegisters, cr) == 0x04);
static_assert(offsetof(DbgmcuRegisters, apb1_fz) == 0x08);
static_assert(offsetof(DbgmcuRegisters, apb2_fz) == 0x0C);

inline constexpr std::uint32_t dbgmcu_base = 0xE004'2000;

inline DbgmcuRegisters& dbgmcu() {
  return peripheral_at<DbgmcuRegisters>(dbgmcu_base);
}

namespace dbgmcu_idcode {
using Device = Field<0, 12>;     // DEV_ID
using Revision = Field<16, 16>;  // REV_ID
inline constexpr std::uint32_t stm32f405 = 0x413;
}  // namespace dbgmcu_idcode

namespace dbgmcu_apb1_fz {
using Timer2 = Field<0>;
using Timer3 = Field<1>;
using Timer4 = Field<2>;
using Timer5 = Field<3>;
using IndependentWatchdog = Field<12>;
using Can1 = Field<25>;
}  // namespace dbgmcu_apb1_fz

namespace dbgmcu_apb2_fz {
using Timer1 = Field<0>;
using Timer8 = Field<1>;
}  // namespace dbgmcu_apb2_fz

}  // namespace kmax::drivers::stm32f4
