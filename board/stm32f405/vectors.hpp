#pragma once

#include <cstddef>

#include "drivers/cortex_m/vectors.hpp"
#include "drivers/stm32f4/interrupts.hpp"

// The vector table of the STM32F405 and the names of its interrupts' handlers: RM0090, vector table.
//
// A program handles an interrupt by defining the function of that name. All the others end in
// `stop_on_unexpected_interrupt`, the faults in the fault handler. Include this header where a handler is
// defined: a misspelt name then has C++ linkage and never reaches the table, which the check after linking
// reports for the handlers that the board says it has.

namespace kmax::board {

struct VectorTable : drivers::cortex_m::VectorTable<drivers::stm32f4::interrupt_count> {
  using drivers::cortex_m::VectorTable<drivers::stm32f4::interrupt_count>::at;
  constexpr drivers::cortex_m::InterruptHandler at(drivers::stm32f4::Interrupt interrupt) const {
    return at(16 + static_cast<std::size_t>(interrupt));
  }
};
static_assert(sizeof(VectorTable) == 98 * sizeof(drivers::cortex_m::InterruptHandler));

extern const VectorTable vector_table;

}  // namespace kmax::board

/// Interrupts 0 to 81 in their order: HANDLER(name) for ISR_name, RESERVED() for a number without one.
// clang-format off
#define KMAX_STM32F405_INTERRUPTS(HANDLER, RESERVED) \
  HANDLER(window_watchdog) \
  HANDLER(voltage_detector) \
  HANDLER(tamper_stamp) \
  HANDLER(rtc_wakeup) \
  HANDLER(flash) \
  HANDLER(rcc) \
  HANDLER(exti0) \
  HANDLER(exti1) \
  HANDLER(exti2) \
  HANDLER(exti3) \
  HANDLER(exti4) \
  HANDLER(dma1_stream0) \
  HANDLER(dma1_stream1) \
  HANDLER(dma1_stream2) \
  HANDLER(dma1_stream3) \
  HANDLER(dma1_stream4) \
  HANDLER(dma1_stream5) \
  HANDLER(dma1_stream6) \
  HANDLER(adc) \
  HANDLER(can1_tx) \
  HANDLER(can1_rx0) \
  HANDLER(can1_rx1) \
  HANDLER(can1_sce) \
  HANDLER(exti9_5) \
  HANDLER(tim1_brk_tim9) \
  HANDLER(tim1_up_tim10) \
  HANDLER(tim1_trg_com_tim11) \
  HANDLER(tim1_cc) \
  HANDLER(tim2) \
  HANDLER(tim3) \
  HANDLER(tim4) \
  HANDLER(i2c1_event) \
  HANDLER(i2c1_error) \
  HANDLER(i2c2_event) \
  HANDLER(i2c2_error) \
  HANDLER(spi1) \
  HANDLER(spi2) \
  HANDLER(usart1) \
  HANDLER(usart2) \
  HANDLER(usart3) \
  HANDLER(exti15_10) \
  HANDLER(rtc_alarm) \
  HANDLER(otg_fs_wakeup) \
  HANDLER(tim8_brk_tim12) \
  HANDLER(tim8_up_tim13) \
  HANDLER(tim8_trg_com_tim14) \
  HANDLER(tim8_cc) \
  HANDLER(dma1_stream7) \
  HANDLER(fsmc) \
  HANDLER(sdio) \
  HANDLER(tim5) \
  HANDLER(spi3) \
  HANDLER(uart4) \
  HANDLER(uart5) \
  HANDLER(tim6_dac) \
  HANDLER(tim7) \
  HANDLER(dma2_stream0) \
  HANDLER(dma2_stream1) \
  HANDLER(dma2_stream2) \
  HANDLER(dma2_stream3) \
  HANDLER(dma2_stream4) \
  RESERVED() \
  RESERVED() \
  HANDLER(can2_tx) \
  HANDLER(can2_rx0) \
  HANDLER(can2_rx1) \
  HANDLER(can2_sce) \
  HANDLER(otg_fs) \
  HANDLER(dma2_stream5) \
  HANDLER(dma2_stream6) \
  HANDLER(dma2_stream7) \
  HANDLER(usart6) \
  HANDLER(i2c3_event) \
  HANDLER(i2c3_error) \
  HANDLER(otg_hs_ep1_out) \
  HANDLER(otg_hs_ep1_in) \
  HANDLER(otg_hs_wakeup) \
  HANDLER(otg_hs) \
  RESERVED() \
  RESERVED() \
  HANDLER(random) \
  HANDLER(fpu)
// clang-format on

extern "C" {
#define KMAX_DECLARE(name) void ISR_##name();
#define KMAX_NOTHING()
KMAX_STM32F405_INTERRUPTS(KMAX_DECLARE, KMAX_NOTHING)
#undef KMAX_DECLARE
#undef KMAX_NOTHING
}
