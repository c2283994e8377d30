#pragma once

#include <array>
#include <cstdint>

#include "drivers/cortex_m/core_instructions.hpp"
#include "drivers/cortex_m/registers.hpp"

// Interrupts of the self-test. No peripheral raises them, the test pends them in the NVIC; what a handler
// does beyond noting that it ran is set by the test.

namespace kmax::core_self_test {

struct Line {
  std::uint32_t number;

  std::uint32_t bit() const { return 1U << (number % 32); }
  void enable() const { drivers::cortex_m::nvic().iser[number / 32] = bit(); }
  void disable() const { drivers::cortex_m::nvic().icer[number / 32] = bit(); }
  void pend() const { drivers::cortex_m::nvic().ispr[number / 32] = bit(); }
  void clear_pending() const { drivers::cortex_m::nvic().icpr[number / 32] = bit(); }
  bool pending() const { return (drivers::cortex_m::nvic().ispr[number / 32] & bit()) != 0; }
  bool active() const { return (drivers::cortex_m::nvic().iabr[number / 32] & bit()) != 0; }
  /// 0 to 15; by a byte access, as firmware does it.
  void set_priority(std::uint32_t priority) const {
    auto* bytes = reinterpret_cast<volatile std::uint8_t*>(&drivers::cortex_m::nvic().ipr[0]);
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
  drivers::cortex_m::data_synchronization_barrier();
  drivers::cortex_m::instruction_synchronization_barrier();
}

inline void pend_and_wait(const Line& line) {
  line.pend();
  synchronize();
}

}  // namespace kmax::core_self_test
