#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// Control of the floating-point context over exceptions, and what the unit can do: PM0214, floating-point
// unit.

namespace kmax::drivers::stm32f4 {

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

}  // namespace kmax::drivers::stm32f4
