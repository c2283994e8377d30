#pragma once

#include <atomic>

// The core instructions that C++ has no word for. On any other architecture (unit tests) they only keep the
// compiler from moving memory accesses across them.

namespace kmax::drivers::cortex_m {

/// Completes all earlier memory accesses before the next instruction (PM0214, DSB).
inline void data_synchronization_barrier() {
#if defined(__arm__)
  asm volatile("dsb" ::: "memory");
#else
  std::atomic_signal_fence(std::memory_order_seq_cst);
#endif
}

/// Makes earlier changes to the core's configuration visible to the instructions that follow (PM0214, ISB).
inline void instruction_synchronization_barrier() {
#if defined(__arm__)
  asm volatile("isb" ::: "memory");
#else
  std::atomic_signal_fence(std::memory_order_seq_cst);
#endif
}

/// No interrupt is taken between the two, but for the NMI (PM0214, CPS); what comes meanwhile is taken within
/// unmask_interrupts().
inline void mask_interrupts() {
#if defined(__arm__)
  asm volatile("cpsid i" ::: "memory");
#else
  std::atomic_signal_fence(std::memory_order_seq_cst);
#endif
}
inline void unmask_interrupts() {
#if defined(__arm__)
  asm volatile("cpsie i\n\tisb" ::: "memory");
#else
  std::atomic_signal_fence(std::memory_order_seq_cst);
#endif
}

/// In no exception's handler and with interrupts unmasked, as a reset leaves the core (PM0214, IPSR,
/// PRIMASK).
inline bool takes_interrupts() {
#if defined(__arm__)
  unsigned exception = 0, masked = 0;
  asm volatile("mrs %0, ipsr\n\tmrs %1, primask" : "=r"(exception), "=r"(masked));
  return (exception | masked) == 0;
#else
  return true;
#endif
}

/// Sleeps until an interrupt is pending, masked or not. Returns at once when one already is.
inline void wait_for_interrupt() {
#if defined(__arm__)
  asm volatile("dsb\n\twfi" ::: "memory");
#else
  std::atomic_signal_fence(std::memory_order_seq_cst);
#endif
}

}  // namespace kmax::drivers::cortex_m
