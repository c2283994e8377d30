#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// Data watchpoint and trace unit of the Cortex-M4, its cycle counter only. ARMv7-M architecture reference
// manual, C1.8. Dead until DEMCR.TRCENA is set (registers/core_debug.hpp).

namespace kmax::drivers::stm32f4 {

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

}  // namespace kmax::drivers::stm32f4
