#pragma once

#include <cstdint>

#include "drivers/cortex_m/interrupt_controller.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/usart.hpp"

namespace kmax::board {

/// One of the chip's USARTs and its interrupt, behind a SerialLink.
template <drivers::stm32f4::Interrupt interrupt>
class SerialHardware : public drivers::stm32f4::Usart<> {
 public:
  SerialHardware(drivers::stm32f4::UsartRegisters& registers,
                 drivers::cortex_m::InterruptController<>& interrupts, std::uint32_t kernel_clock_hz)
      : Usart(registers), interrupts_(interrupts), kernel_clock_hz_(kernel_clock_hz) {}

  /// A rate that this clock cannot make leaves the USART as it was: false.
  [[nodiscard]] bool configure(std::uint32_t baud_rate) {
    interrupts_.disable(interrupt);
    const bool configured =
        Usart::configure({baud_rate, drivers::stm32f4::UsartParity::even}, kernel_clock_hz_);
    interrupts_.enable(interrupt);
    return configured;
  }

 private:
  drivers::cortex_m::InterruptController<>& interrupts_;
  std::uint32_t kernel_clock_hz_;
};

}  // namespace kmax::board
