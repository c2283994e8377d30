#pragma once

#include <cstdint>

#include "drivers/stm32f4/gpio.hpp"
#include "drivers/stm32f4/registers/exti.hpp"
#include "drivers/stm32f4/registers/syscfg.hpp"

// Interrupts from edges on pins. RM0090, EXTI and SYSCFG.
//
// A line is a pin number: PC4 and PA4 cannot both be used. `configure` masks the line, routes the pin to it,
// selects the edges, forgets an edge seen before (changing the route can itself look like one) and leaves it
// masked; `enable` lets it through. An edge that falls between the two stays pending and comes at once.
//
// An edge that was over before `enable` is lost on purpose by `configure`: whoever needs the pin's level at
// start (emergency stop, fault) must read the pin after `enable`.
//
// Contexts: `configure` from one context at start-up (it reads, modifies and writes registers that all lines
// share); `enable` and `disable` likewise; `ISR_take` from any, it is one load and one store of one bit.
//
// The interrupt also has to be enabled in the NVIC (`exti_interrupt` names it); lines 5 to 9 and 10 to 15
// share a vector, so its handler asks `ISR_take` for each line that it owns. Ask first in the handler: a
// clear that is the last store before the return can reach the EXTI after the NVIC has looked again, and the
// handler runs once for nothing.

namespace kmax::drivers::stm32f4 {

enum class Edge : std::uint8_t { rising = 1, falling = 2, both = 3 };

template <typename Exti = ExtiRegisters, typename Syscfg = SyscfgRegisters>
class ExternalInterrupts {
 public:
  constexpr ExternalInterrupts(Exti& exti, Syscfg& syscfg) : exti_(exti), syscfg_(syscfg) {}

  /// False, and nothing touched, for a pin whose line has no vector (0, 1, 3) or does not exist (above 15).
  [[nodiscard]] bool configure(PinLocation pin, Edge edge) {
    const unsigned line = pin.number;
    if (!exti_interrupt(line)) return false;
    disable(line);
    auto& route = syscfg_.exticr[syscfg_exticr::index(line)];
    const unsigned position = syscfg_exticr::position(line);
    route = (static_cast<std::uint32_t>(route) & ~(syscfg_exticr::port_mask << position)) |
            (static_cast<std::uint32_t>(pin.port) << position);
    replace(exti_.rtsr, line, (static_cast<unsigned>(edge) & static_cast<unsigned>(Edge::rising)) != 0);
    replace(exti_.ftsr, line, (static_cast<unsigned>(edge) & static_cast<unsigned>(Edge::falling)) != 0);
    exti_.pr = 1U << line;
    return true;
  }

  void enable(unsigned line) { replace(exti_.imr, line, true); }
  void disable(unsigned line) { replace(exti_.imr, line, false); }

  /// True when the line has seen an edge since the last call, which this forgets. The store clears this line
  /// alone: a write of what was read would also clear edges of its neighbours that nobody has looked at.
  bool ISR_take(unsigned line) {
    const std::uint32_t bit = 1U << line;
    if ((static_cast<std::uint32_t>(exti_.pr) & bit) == 0) return false;
    exti_.pr = bit;
    return true;
  }

 private:
  static void replace(Register auto& target, unsigned line, bool value) {
    const std::uint32_t bit = 1U << line;
    const auto word = static_cast<std::uint32_t>(target);
    target = value ? word | bit : word & ~bit;
  }

  Exti& exti_;
  Syscfg& syscfg_;
};

}  // namespace kmax::drivers::stm32f4
