#pragma once

#include <array>
#include <cstdint>

#include "drivers/stm32f4/core_instructions.hpp"
#include "drivers/stm32f4/registers/nvic.hpp"

// Interrupts of the self-test. No peripheral raises them, the test pends them in the NVIC; what a handler
// does beyond noting that it ran is set by the test.

namespace kmax::core_self_test {

struct Line {
  std::uint32_t number;

  std::uint32_t bit() const { return 1U << (number % 32); }
  void enable() const { drivers::stm32f4::nvic().iser[number / 32] = bit(); }
  void disable() const { drivers::stm32f4::nvic().icer[number / 32] = bit(); }
  void pend() const { drivers::stm32f4::nvic().ispr[number / 32] = bit(); }
  void clear_pending() const { drivers::stm32f4::nvic().icpr[number / 32] = bit(); }
  bool pending() const { return (drivers::stm32f4::nvic().ispr[number / 32] & bit()) != 0; }
  bool active() const { return (drivers::stm32f4::nvic().iabr[number / 32] & bit()) != 0; }
  /// 0 to 15; by a byte access, as firmware does it.
  void set_priority(std::uint32_t priority) const {
    auto* bytes = reinterpret_cast<volatile std::uint8_t*>(&drivers::stm32f4::nvic().ipr[0]);
    bytes[number] = static_cast<std::uint8_t>(priority << 4);
  }
};

/// TIM3, TIM4, TIM5, SPI3, UART4: in both halves of the NVIC's words, none of them in use here.
inline constexpr std::array<Line, 5> lines{{{29}, {30}, {50}, {51}, {52}}};

/// What the handler of lines[n] does. Reset to nothing by prepare_lines().
extern void (*volatile line_action[lines.size()])();

/// All lines enabled, none pending, priority of lines[n] = 3 n + 1, no actions.
void prepare_lines();

inline void synchronize() {
  drivers::stm32f4::data_synchronization_barrier();
  drivers::stm32f4::instruction_synchronization_barrier();
}

inline void pend_and_wait(const Line& line) {
  line.pend();
  synchronize();
}

}  // namespace kmax::core_self_test
