#pragma once

#include <cstdint>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/registers/syscfg.hpp"
#include "firmware/board_interface/retained_count.hpp"

namespace kmax::board {

/// Kept over a reset: that the start behind it is the boot loader's in ROM, which speaks DFU over USB
/// (AN2606).
inline constexpr std::uint32_t asks_for_boot_loader = 0xB007'10AD;

/// Leaves the firmware for good: what runs then has the stack for itself.
[[noreturn, gnu::noinline, gnu::cold]] inline void start_boot_loader() {
#if defined(__arm__)
  // System memory begins with a vector table (RM0090, boot configuration): stack pointer, start.
  constexpr std::uint32_t system_memory = 0x1FFF'0000;
  // NOLINTNEXTLINE(performance-no-int-to-ptr)
  const auto* table = reinterpret_cast<const volatile std::uint32_t*>(system_memory);
  const std::uint32_t stack = table[0], program = table[1];
  // As if the boot pins had started it.
  drivers::stm32f4::syscfg().memrmp =
      drivers::stm32f4::syscfg_memrmp::MemoryAt0::bits(drivers::stm32f4::syscfg_memrmp::system_flash);
  drivers::cortex_m::scb().vtor = system_memory;
  drivers::cortex_m::data_synchronization_barrier();
  asm volatile("msr msp, %0\n\tbx %1" : : "r"(stack), "r"(program) : "memory");
#endif
  __builtin_unreachable();
}

/// First of all that main does, while clocks and peripherals but SYSCFG are as a reset leaves them, which the
/// boot loader counts on. Returns if nobody has asked for it; another reset, or the boot loader's own
/// "leave", comes back here and starts the firmware.
inline void enter_boot_loader_if_asked(firmware::RetainedCount& asked) {
  if (asked.value() != asks_for_boot_loader) return;
  asked.set(0);
  start_boot_loader();
}

}  // namespace kmax::board
