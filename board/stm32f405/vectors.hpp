#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/interrupts.hpp"

// The vector table of the STM32F405 and the names of its handlers. Vector table in RM0090; exceptions in
// PM0214.
//
// A program handles an interrupt by defining the function of that name. All the others end in
// `stop_on_unexpected_interrupt`, the faults in the fault handler. Include this header where a handler is
// defined: a misspelt name then has C++ linkage and never reaches the table, which the check after linking
// reports for the handlers that the board says it has.

namespace kmax::board {

using InterruptHandler = void (*)();

/// 98 words: the initial stack pointer, 15 system exceptions (1 to 15), 82 interrupts (16 to 97).
struct VectorTable {
  const void* initial_stack_pointer;
  InterruptHandler exception[15 + drivers::stm32f4::interrupt_count];

  /// By exception number: 1 is reset, 15 is SysTick, 16 + n is interrupt n.
  constexpr InterruptHandler at(std::size_t exception_number) const {
    return exception[exception_number - 1];
  }
  constexpr InterruptHandler at(drivers::stm32f4::Interrupt interrupt) const {
    return at(16 + static_cast<std::size_t>(interrupt));
  }
};
static_assert(sizeof(VectorTable) == 98 * sizeof(InterruptHandler));

extern const VectorTable vector_table;

}  // namespace kmax::board

extern "C" {
[[noreturn]] void ISR_reset();
void ISR_non_maskable();
void ISR_hard_fault();
void ISR_supervisor_call();
void ISR_debug_monitor();
void ISR_pend_supervisor();
void ISR_system_tick();
void ISR_window_watchdog();
void ISR_voltage_detector();
void ISR_tamper_stamp();
void ISR_rtc_wakeup();
void ISR_flash();
void ISR_rcc();
void ISR_exti0();
void ISR_exti1();
void ISR_exti2();
void ISR_exti3();
void ISR_exti4();
void ISR_dma1_stream0();
void ISR_dma1_stream1();
void ISR_dma1_stream2();
void ISR_dma1_stream3();
void ISR_dma1_stream4();
void ISR_dma1_stream5();
void ISR_dma1_stream6();
void ISR_adc();
void ISR_can1_tx();
void ISR_can1_rx0();
void ISR_can1_rx1();
void ISR_can1_sce();
void ISR_exti9_5();
void ISR_tim1_brk_tim9();
void ISR_tim1_up_tim10();
void ISR_tim1_trg_com_tim11();
void ISR_tim1_cc();
void ISR_tim2();
void ISR_tim3();
void ISR_tim4();
void ISR_i2c1_event();
void ISR_i2c1_error();
void ISR_i2c2_event();
void ISR_i2c2_error();
void ISR_spi1();
void ISR_spi2();
void ISR_usart1();
void ISR_usart2();
void ISR_usart3();
void ISR_exti15_10();
void ISR_rtc_alarm();
void ISR_otg_fs_wakeup();
void ISR_tim8_brk_tim12();
void ISR_tim8_up_tim13();
void ISR_tim8_trg_com_tim14();
void ISR_tim8_cc();
void ISR_dma1_stream7();
void ISR_fsmc();
void ISR_sdio();
void ISR_tim5();
void ISR_spi3();
void ISR_uart4();
void ISR_uart5();
void ISR_tim6_dac();
void ISR_tim7();
void ISR_dma2_stream0();
void ISR_dma2_stream1();
void ISR_dma2_stream2();
void ISR_dma2_stream3();
void ISR_dma2_stream4();
void ISR_can2_tx();
void ISR_can2_rx0();
void ISR_can2_rx1();
void ISR_can2_sce();
void ISR_otg_fs();
void ISR_dma2_stream5();
void ISR_dma2_stream6();
void ISR_dma2_stream7();
void ISR_usart6();
void ISR_i2c3_event();
void ISR_i2c3_error();
void ISR_otg_hs_ep1_out();
void ISR_otg_hs_ep1_in();
void ISR_otg_hs_wakeup();
void ISR_otg_hs();
void ISR_random();
void ISR_fpu();
}
