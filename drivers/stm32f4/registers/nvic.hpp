#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

// Nested vectored interrupt controller: PM0214, NVIC. The priority registers are bytes on the bus; they are
// declared as words (four interrupts each) so that the whole block is of one type and a test can stand in for
// it.

namespace kmax::drivers::stm32f4 {

/// Interrupts 0 to 81 exist on the F405 (vector table in RM0090); the table has 16 system entries before
/// them.
inline constexpr std::size_t interrupt_count = 82;

struct NvicRegisters {
  volatile std::uint32_t iser[8];
  std::uint32_t reserved_020[24];
  volatile std::uint32_t icer[8];
  std::uint32_t reserved_0a0[24];
  volatile std::uint32_t ispr[8];
  std::uint32_t reserved_120[24];
  volatile std::uint32_t icpr[8];
  std::uint32_t reserved_1a0[24];
  volatile std::uint32_t iabr[8];
  std::uint32_t reserved_220[56];
  volatile std::uint32_t ipr[60];
};
static_assert(offsetof(NvicRegisters, iser) == 0x000);
static_assert(offsetof(NvicRegisters, icer) == 0x080);
static_assert(offsetof(NvicRegisters, ispr) == 0x100);
static_assert(offsetof(NvicRegisters, icpr) == 0x180);
static_assert(offsetof(NvicRegisters, ipr) == 0x300);

inline constexpr std::uint32_t nvic_base = 0xE000'E100;

inline NvicRegisters& nvic() {
  return peripheral_at<NvicRegisters>(nvic_base);
}

/// STIR: pends the interrupt whose number is written; lies apart from the rest.
struct SoftwareTriggerRegisters {
  volatile std::uint32_t stir;
};

inline constexpr std::uint32_t software_trigger_base = 0xE000'EF00;

inline SoftwareTriggerRegisters& software_trigger() {
  return peripheral_at<SoftwareTriggerRegisters>(software_trigger_base);
}

namespace nvic_stir {
using InterruptNumber = Field<0, 9>;
}  // namespace nvic_stir

/// Those that the firmware uses or is about to; the numbers are the positions in the vector table minus 16.
enum class Interrupt : std::uint8_t {
  flash = 4,
  rcc = 5,
  exti2 = 8,
  exti4 = 10,
  adc = 18,
  can1_tx = 19,
  can1_rx0 = 20,
  can1_rx1 = 21,
  can1_sce = 22,
  exti9_5 = 23,
  tim1_brk_tim9 = 24,
  tim1_up_tim10 = 25,
  tim2 = 28,
  tim3 = 29,
  tim4 = 30,
  usart2 = 38,
  exti15_10 = 40,
  tim8_brk_tim12 = 43,
  tim8_up_tim13 = 44,
  tim5 = 50,
  spi3 = 51,
  uart4 = 52,
};

}  // namespace kmax::drivers::stm32f4
