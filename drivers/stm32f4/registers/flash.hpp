#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// Embedded flash interface, RM0090 chapter on the flash memory interface.

namespace kmax::drivers::stm32f4 {

struct FlashRegisters {
  volatile std::uint32_t acr;
  volatile std::uint32_t keyr;
  volatile std::uint32_t optkeyr;
  volatile std::uint32_t sr;
  volatile std::uint32_t cr;
  volatile std::uint32_t optcr;
};
static_assert(offsetof(FlashRegisters, acr) == 0x00);
static_assert(offsetof(FlashRegisters, keyr) == 0x04);
static_assert(offsetof(FlashRegisters, optkeyr) == 0x08);
static_assert(offsetof(FlashRegisters, sr) == 0x0C);
static_assert(offsetof(FlashRegisters, cr) == 0x10);
static_assert(offsetof(FlashRegisters, optcr) == 0x14);

inline FlashRegisters& flash() {
  return peripheral_at<FlashRegisters>(0x4002'3C00);
}

namespace flash_acr {
using Latency = Field<0, 3>;  // wait states
using Prefetch = Field<8>;
using InstructionCache = Field<9>;
using DataCache = Field<10>;
}  // namespace flash_acr

}  // namespace kmax::drivers::stm32f4
