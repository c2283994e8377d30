#include "board/stm32f405/vectors.hpp"

#include "board/stm32f405/fault_handler.hpp"

extern "C" {
extern std::uint32_t kmax_stack_top[];

[[gnu::section(".boot.unexpected_entry")]] void ISR_unexpected() {
  kmax::board::stop_on_unexpected_interrupt();
}

// Defined elsewhere, or the above.
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_non_maskable();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_supervisor_call();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_debug_monitor();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_pend_supervisor();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_system_tick();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_window_watchdog();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_voltage_detector();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tamper_stamp();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_rtc_wakeup();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_flash();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_rcc();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_exti0();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_exti1();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_exti2();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_exti3();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_exti4();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma1_stream0();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma1_stream1();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma1_stream2();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma1_stream3();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma1_stream4();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma1_stream5();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma1_stream6();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_adc();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_can1_tx();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_can1_rx0();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_can1_rx1();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_can1_sce();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_exti9_5();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim1_brk_tim9();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim1_up_tim10();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim1_trg_com_tim11();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim1_cc();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim2();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim3();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim4();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_i2c1_event();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_i2c1_error();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_i2c2_event();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_i2c2_error();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_spi1();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_spi2();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_usart1();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_usart2();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_usart3();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_exti15_10();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_rtc_alarm();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_otg_fs_wakeup();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim8_brk_tim12();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim8_up_tim13();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim8_trg_com_tim14();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim8_cc();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma1_stream7();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_fsmc();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_sdio();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim5();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_spi3();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_uart4();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_uart5();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim6_dac();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_tim7();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma2_stream0();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma2_stream1();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma2_stream2();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma2_stream3();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma2_stream4();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_can2_tx();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_can2_rx0();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_can2_rx1();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_can2_sce();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_otg_fs();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma2_stream5();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma2_stream6();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_dma2_stream7();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_usart6();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_i2c3_event();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_i2c3_error();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_otg_hs_ep1_out();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_otg_hs_ep1_in();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_otg_hs_wakeup();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_otg_hs();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_random();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_fpu();
}

namespace kmax::board {

[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable vector_table = {
    kmax_stack_top,
    {
        ISR_reset,
        ISR_non_maskable,
        ISR_hard_fault,
        ISR_hard_fault,  // 4: memory_management, escalated
        ISR_hard_fault,  // 5: bus_fault, escalated
        ISR_hard_fault,  // 6: usage_fault, escalated
        nullptr,         // 7: reserved
        nullptr,         // 8: reserved
        nullptr,         // 9: reserved
        nullptr,         // 10: reserved
        ISR_supervisor_call,
        ISR_debug_monitor,
        nullptr,  // 13: reserved
        ISR_pend_supervisor,
        ISR_system_tick,
        ISR_window_watchdog,
        ISR_voltage_detector,
        ISR_tamper_stamp,
        ISR_rtc_wakeup,
        ISR_flash,
        ISR_rcc,
        ISR_exti0,
        ISR_exti1,
        ISR_exti2,
        ISR_exti3,
        ISR_exti4,
        ISR_dma1_stream0,
        ISR_dma1_stream1,
        ISR_dma1_stream2,
        ISR_dma1_stream3,
        ISR_dma1_stream4,
        ISR_dma1_stream5,
        ISR_dma1_stream6,
        ISR_adc,
        ISR_can1_tx,
        ISR_can1_rx0,
        ISR_can1_rx1,
        ISR_can1_sce,
        ISR_exti9_5,
        ISR_tim1_brk_tim9,
        ISR_tim1_up_tim10,
        ISR_tim1_trg_com_tim11,
        ISR_tim1_cc,
        ISR_tim2,
        ISR_tim3,
        ISR_tim4,
        ISR_i2c1_event,
        ISR_i2c1_error,
        ISR_i2c2_event,
        ISR_i2c2_error,
        ISR_spi1,
        ISR_spi2,
        ISR_usart1,
        ISR_usart2,
        ISR_usart3,
        ISR_exti15_10,
        ISR_rtc_alarm,
        ISR_otg_fs_wakeup,
        ISR_tim8_brk_tim12,
        ISR_tim8_up_tim13,
        ISR_tim8_trg_com_tim14,
        ISR_tim8_cc,
        ISR_dma1_stream7,
        ISR_fsmc,
        ISR_sdio,
        ISR_tim5,
        ISR_spi3,
        ISR_uart4,
        ISR_uart5,
        ISR_tim6_dac,
        ISR_tim7,
        ISR_dma2_stream0,
        ISR_dma2_stream1,
        ISR_dma2_stream2,
        ISR_dma2_stream3,
        ISR_dma2_stream4,
        ISR_unexpected,  // 61: reserved
        ISR_unexpected,  // 62: reserved
        ISR_can2_tx,
        ISR_can2_rx0,
        ISR_can2_rx1,
        ISR_can2_sce,
        ISR_otg_fs,
        ISR_dma2_stream5,
        ISR_dma2_stream6,
        ISR_dma2_stream7,
        ISR_usart6,
        ISR_i2c3_event,
        ISR_i2c3_error,
        ISR_otg_hs_ep1_out,
        ISR_otg_hs_ep1_in,
        ISR_otg_hs_wakeup,
        ISR_otg_hs,
        ISR_unexpected,  // 78: reserved
        ISR_unexpected,  // 79: reserved
        ISR_random,
        ISR_fpu,
    }};

}  // namespace kmax::board
