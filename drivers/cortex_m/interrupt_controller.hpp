#pragma once

#include <concepts>
#include <cstdint>
#include <type_traits>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/registers.hpp"

// Priorities, enable and pend of the NVIC and of the system exceptions that have a settable priority. PM0214,
// NVIC and SCB.
//
// Parts with 16 levels (all STM32) implement the upper four of the eight priority bits: 0 is the most urgent,
// 15 the least. All four bits pre-empt (PRIGROUP stays 0). Priorities are set once at start-up, from one
// context; `enable`, `disable` and `pend` are single stores and may be called from any.

namespace kmax::drivers::cortex_m {

enum class SystemException : std::uint8_t {
  memory_management = 4,
  bus_fault = 5,
  usage_fault = 6,
  supervisor_call = 11,
  pend_supervisor = 14,
  system_tick = 15,
};

/// A chip's names for its interrupts; the values are the positions in the vector table minus 16.
template <typename Candidate>
concept InterruptName = std::is_enum_v<Candidate> && !std::same_as<Candidate, SystemException>;

template <typename Nvic = NvicRegisters, typename Scb = ScbRegisters>
class InterruptController {
 public:
  constexpr InterruptController(Nvic& nvic, Scb& scb) : nvic_(nvic), scb_(scb) {}

  void set_priority(InterruptName auto interrupt, std::uint8_t priority) {
    write_byte(nvic_.ipr[index(interrupt) / 4], index(interrupt) % 4, priority);
  }

  void set_priority(SystemException exception, std::uint8_t priority) {
    const auto number = static_cast<unsigned>(exception);
    write_byte(scb_.shpr[number / 4 - 1], number % 4, priority);
  }

  void enable(InterruptName auto interrupt) { nvic_.iser[index(interrupt) / 32] = bit(interrupt); }

  /// The handler does not start after this returns (PM0214 asks for both barriers).
  void disable(InterruptName auto interrupt) {
    nvic_.icer[index(interrupt) / 32] = bit(interrupt);
    data_synchronization_barrier();
    instruction_synchronization_barrier();
  }

  /// Runs the handler as if the peripheral had asked for it.
  void pend(InterruptName auto interrupt) { nvic_.ispr[index(interrupt) / 32] = bit(interrupt); }

  void clear_pending(InterruptName auto interrupt) { nvic_.icpr[index(interrupt) / 32] = bit(interrupt); }

 private:
  static constexpr unsigned index(InterruptName auto interrupt) { return static_cast<unsigned>(interrupt); }
  static constexpr std::uint32_t bit(InterruptName auto interrupt) { return 1U << (index(interrupt) % 32); }

  static void write_byte(Register auto& word, unsigned byte, std::uint8_t priority) {
    const unsigned shift = 8 * byte;
    const std::uint32_t level = (priority > 15U ? 15U : priority) << 4;
    word = (static_cast<std::uint32_t>(word) & ~(0xFFU << shift)) | (level << shift);
  }

  Nvic& nvic_;
  Scb& scb_;
};

}  // namespace kmax::drivers::cortex_m
