#pragma once

#include <cstddef>
#include <cstdint>

namespace kmax::drivers::stm32f4 {

/// Interrupts 0 to 81 exist on the F405 (vector table in RM0090); the table has 16 system entries before
/// them.
inline constexpr std::size_t interrupt_count = 82;

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
  otg_fs_wakeup = 42,
  tim8_brk_tim12 = 43,
  tim8_up_tim13 = 44,
  tim5 = 50,
  spi3 = 51,
  uart4 = 52,
  otg_fs = 67,
};

}  // namespace kmax::drivers::stm32f4
