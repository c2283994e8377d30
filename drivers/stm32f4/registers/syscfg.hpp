#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// System configuration controller, RM0090 chapter on SYSCFG: which memory appears at address 0, and which
// port feeds an EXTI line. Four bits per line, four lines per register, so their position is a run-time
// number.

namespace kmax::drivers::stm32f4 {

struct SyscfgRegisters {
  volatile std::uint32_t memrmp;
  volatile std::uint32_t pmc;
  volatile std::uint32_t exticr[4];
  std::uint32_t reserved_18[2];
  volatile std::uint32_t cmpcr;
};
static_assert(offsetof(SyscfgRegisters, memrmp) == 0x00);
static_assert(offsetof(SyscfgRegisters, pmc) == 0x04);
static_assert(offsetof(SyscfgRegisters, exticr) == 0x08);
static_assert(offsetof(SyscfgRegisters, cmpcr) == 0x20);

inline constexpr std::uint32_t syscfg_base = 0x4001'3800;

inline SyscfgRegisters& syscfg() {
  return peripheral_at<SyscfgRegisters>(syscfg_base);
}

namespace syscfg_memrmp {
using MemoryAt0 = Field<0, 2>;
inline constexpr std::uint32_t main_flash = 0, system_flash = 1, sram1 = 3;
}  // namespace syscfg_memrmp

namespace syscfg_exticr {
inline constexpr std::uint32_t port_mask = 0xF;  // the port's number: A 0, B 1, C 2, D 3
/// Index of the register and position in it for lines 0 to 15.
constexpr unsigned index(unsigned line) {
  return line / 4;
}
constexpr unsigned position(unsigned line) {
  return 4 * (line % 4);
}
}  // namespace syscfg_exticr

}  // namespace kmax::drivers::stm32f4
