#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// Debug control of the Cortex-M4, as far as firmware uses it: DEMCR switches the cycle counter's block on.
// ARMv7-M architecture reference manual, C1.6.

namespace kmax::drivers::stm32f4 {

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

}  // namespace kmax::drivers::stm32f4
