#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// General-purpose I/O, RM0090 chapter on GPIO. The fields repeat once per pin (two bits each, four in AFR),
// so their position is a run-time number and drivers/stm32f4/gpio.hpp shifts by itself.

namespace kmax::drivers::stm32f4 {

struct GpioRegisters {
  volatile std::uint32_t moder;
  volatile std::uint32_t otyper;
  volatile std::uint32_t ospeedr;
  volatile std::uint32_t pupdr;
  volatile std::uint32_t idr;
  volatile std::uint32_t odr;
  volatile std::uint32_t bsrr;
  volatile std::uint32_t lckr;
  volatile std::uint32_t afr[2];
};
static_assert(offsetof(GpioRegisters, moder) == 0x00);
static_assert(offsetof(GpioRegisters, otyper) == 0x04);
static_assert(offsetof(GpioRegisters, ospeedr) == 0x08);
static_assert(offsetof(GpioRegisters, pupdr) == 0x0C);
static_assert(offsetof(GpioRegisters, idr) == 0x10);
static_assert(offsetof(GpioRegisters, odr) == 0x14);
static_assert(offsetof(GpioRegisters, bsrr) == 0x18);
static_assert(offsetof(GpioRegisters, lckr) == 0x1C);
static_assert(offsetof(GpioRegisters, afr) == 0x20);

enum class GpioPort : std::uint8_t { a, b, c, d };

constexpr std::uint32_t gpio_base(GpioPort port) {
  return 0x4002'0000U + 0x400U * static_cast<std::uint32_t>(port);
}

inline GpioRegisters& gpio(GpioPort port) {
  return peripheral_at<GpioRegisters>(gpio_base(port));
}

}  // namespace kmax::drivers::stm32f4
