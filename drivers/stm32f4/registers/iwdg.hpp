#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// Independent watchdog, RM0090 chapter on IWDG. Runs on the low-speed oscillator (LSI) alone, which it starts
// by itself.

namespace kmax::drivers::stm32f4 {

struct IwdgRegisters {
  volatile std::uint32_t kr;
  volatile std::uint32_t pr;
  volatile std::uint32_t rlr;
  volatile std::uint32_t sr;
};
static_assert(offsetof(IwdgRegisters, kr) == 0x00);
static_assert(offsetof(IwdgRegisters, pr) == 0x04);
static_assert(offsetof(IwdgRegisters, rlr) == 0x08);
static_assert(offsetof(IwdgRegisters, sr) == 0x0C);

inline constexpr std::uint32_t iwdg_base = 0x4000'3000;

inline IwdgRegisters& iwdg() {
  return peripheral_at<IwdgRegisters>(iwdg_base);
}

namespace iwdg_kr {  // write only
inline constexpr std::uint32_t start = 0xCCCC;
inline constexpr std::uint32_t unlock = 0x5555;  // opens PR and RLR; any other key closes them
inline constexpr std::uint32_t reload = 0xAAAA;
}  // namespace iwdg_kr

namespace iwdg_pr {
using Prescaler = Field<0, 3>;  // 0 to 6 for 4 << code; 7 is 256 like 6
constexpr std::uint32_t divider(std::uint32_t code) {
  return 4U << (code < 6 ? code : 6);
}
}  // namespace iwdg_pr

namespace iwdg_rlr {
using Reload = Field<0, 12>;
}  // namespace iwdg_rlr

namespace iwdg_sr {
using PrescalerUpdating = Field<0>;  // PVU
using ReloadUpdating = Field<1>;     // RVU
}  // namespace iwdg_sr

/// Frequency of the LSI (STM32F405 data sheet, LSI oscillator characteristics).
inline constexpr std::uint32_t lsi_minimum_hz = 17'000;
inline constexpr std::uint32_t lsi_typical_hz = 32'000;
inline constexpr std::uint32_t lsi_maximum_hz = 47'000;

}  // namespace kmax::drivers::stm32f4
