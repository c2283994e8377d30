#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/register_field.hpp"
#include "drivers/stm32f4/interrupts.hpp"

// External interrupt/event controller, RM0090 chapter on interrupts and events, section EXTI. One bit per
// line in each register; lines 0 to 15 are the pins of that number of one port each (see syscfg.hpp).

namespace kmax::drivers::stm32f4 {

struct ExtiRegisters {
  volatile std::uint32_t imr;
  volatile std::uint32_t emr;
  volatile std::uint32_t rtsr;
  volatile std::uint32_t ftsr;
  volatile std::uint32_t swier;
  volatile std::uint32_t pr;  // write 1 clears
};
static_assert(offsetof(ExtiRegisters, imr) == 0x00);
static_assert(offsetof(ExtiRegisters, emr) == 0x04);
static_assert(offsetof(ExtiRegisters, rtsr) == 0x08);
static_assert(offsetof(ExtiRegisters, ftsr) == 0x0C);
static_assert(offsetof(ExtiRegisters, swier) == 0x10);
static_assert(offsetof(ExtiRegisters, pr) == 0x14);

inline constexpr std::uint32_t exti_base = 0x4001'3C00;

inline ExtiRegisters& exti() {
  return peripheral_at<ExtiRegisters>(exti_base);
}

inline constexpr unsigned exti_pin_lines = 16;

/// The vector of a pin line; none for lines that the firmware has no vector for (0, 1, 3, and 16 upwards).
constexpr std::optional<Interrupt> exti_interrupt(unsigned line) {
  if (line == 2) return Interrupt::exti2;
  if (line == 4) return Interrupt::exti4;
  if (line >= 5 && line <= 9) return Interrupt::exti9_5;
  if (line >= 10 && line <= 15) return Interrupt::exti15_10;
  return std::nullopt;
}

}  // namespace kmax::drivers::stm32f4
