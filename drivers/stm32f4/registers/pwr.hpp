#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Power control, RM0090 chapter on PWR.

namespace kmax::drivers::stm32f4 {

struct PwrRegisters {
  volatile std::uint32_t cr;
  volatile std::uint32_t csr;
};
static_assert(offsetof(PwrRegisters, cr) == 0x00);
static_assert(offsetof(PwrRegisters, csr) == 0x04);

inline constexpr std::uint32_t pwr_base = 0x4000'7000;

inline PwrRegisters& pwr() {
  return peripheral_at<PwrRegisters>(pwr_base);
}

namespace pwr_cr {
/// VOS: 1 = scale 1, needed above 144 MHz. One bit on the F405 (the two-bit field is that of later parts).
using VoltageScale1 = Field<14>;
}  // namespace pwr_cr

namespace pwr_csr {
using VoltageScaleReady = Field<14>;  // VOSRDY
}  // namespace pwr_csr

}  // namespace kmax::drivers::stm32f4
