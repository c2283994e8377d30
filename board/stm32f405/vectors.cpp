#include "board/stm32f405/vectors.hpp"

#include "drivers/cortex_m/fault_handler.hpp"

extern "C" {
extern std::uint32_t kmax_stack_top[];

[[gnu::section(".boot.unexpected_entry")]] void ISR_unexpected() {
  kmax::drivers::cortex_m::stop_on_unexpected_interrupt();
}

// Defined elsewhere, or the above.
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_non_maskable();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_supervisor_call();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_debug_monitor();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_pend_supervisor();
[[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_system_tick();
#define KMAX_DEFAULT(name) [[gnu::weak, gnu::alias("ISR_unexpected")]] void ISR_##name();
#define KMAX_NOTHING()
KMAX_STM32F405_INTERRUPTS(KMAX_DEFAULT, KMAX_NOTHING)
}

namespace kmax::board {

[[gnu::section(".vectors"), gnu::used]] constinit const VectorTable vector_table = {
    {kmax_stack_top,
     {ISR_reset, ISR_non_maskable, ISR_hard_fault,
      ISR_hard_fault,  // 4: memory_management, escalated
      ISR_hard_fault,  // 5: bus_fault, escalated
      ISR_hard_fault,  // 6: usage_fault, escalated
      nullptr,         // 7: reserved
      nullptr,         // 8: reserved
      nullptr,         // 9: reserved
      nullptr,         // 10: reserved
      ISR_supervisor_call, ISR_debug_monitor,
      nullptr,  // 13: reserved
      ISR_pend_supervisor, ISR_system_tick,
#define KMAX_ENTRY(name) ISR_##name,
#define KMAX_UNEXPECTED() ISR_unexpected,
      KMAX_STM32F405_INTERRUPTS(KMAX_ENTRY, KMAX_UNEXPECTED)}}};

}  // namespace kmax::board
