#pragma once

#include <cstddef>

// The vector table of a Cortex-M4 and the handlers of its system exceptions (PM0214, vector table). What the
// interrupts behind them are called is a fact of the chip.

namespace kmax::drivers::cortex_m {

using InterruptHandler = void (*)();

/// The initial stack pointer, 15 system exceptions (1 to 15), the chip's interrupts (16 upwards).
template <std::size_t interrupt_count>
struct VectorTable {
  const void* initial_stack_pointer;
  InterruptHandler exception[15 + interrupt_count];

  /// By exception number: 1 is reset, 15 is SysTick, 16 + n is interrupt n.
  constexpr InterruptHandler at(std::size_t exception_number) const {
    return exception[exception_number - 1];
  }
};

}  // namespace kmax::drivers::cortex_m

extern "C" {
/// From the reset to main(). All faults end in ISR_hard_fault.
[[noreturn]] void ISR_reset();
void ISR_non_maskable();
void ISR_hard_fault();
void ISR_supervisor_call();
void ISR_debug_monitor();
void ISR_pend_supervisor();
void ISR_system_tick();
}
