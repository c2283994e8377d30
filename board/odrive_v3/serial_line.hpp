#pragma once

#include <cstdint>
#include <span>

#include "board/odrive_v3/pins.hpp"
#include "drivers/cortex_m/interrupt_controller.hpp"
#include "drivers/stm32f4/clock_tree.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/usart.hpp"
#include "firmware/exchange/interrupt_signal.hpp"
#include "firmware/links/modbus_edge.hpp"

namespace kmax::board::odrive_v3 {

/// USART2 on GPIO3 and GPIO4, between its interrupt and the link behind it.
///
/// Follows the link's wish for a baud rate, but not in the middle of a reply. A rate that this clock
/// cannot make leaves the line as it was.
class SerialLine {
 public:
  SerialLine(drivers::cortex_m::InterruptController<>& interrupts, std::uint32_t kernel_clock_hz)
      : interrupts_(interrupts), kernel_clock_hz_(kernel_clock_hz) {}

  /// Pins and clock are on, the interrupt has its priority.
  void start(const firmware::ModbusEdge& link) {
    settings_ = link.settings();
    if (!configure()) {
      settings_ = {115'200};
      static_cast<void>(configure());
    }
  }

  /// Main loop, after the link's poll().
  void poll(firmware::ModbusEdge& link, std::uint32_t now_us) {
    if (reply_sent_.take()) {
      link.reply_sent();
      replying_ = false;
    }
    if (replying_) return;
    const std::span<const std::uint8_t> reply = link.reply_due(now_us);
    if (!reply.empty()) {
      replying_ = usart_.transmit(reply);
      if (replying_) return;
    }
    const firmware::SerialSettings wanted = link.settings();
    if (wanted == settings_) return;
    settings_ = wanted;
    static_cast<void>(configure());
  }

  /// The USART's interrupt. True: it has left something for the main loop.
  template <typename Clock>
  bool ISR_serve(firmware::ModbusEdge& link, const Clock& clock) {
    const drivers::stm32f4::UsartEvent event = usart_.ISR_serve();
    if (!event.received && !event.line_error && !event.transmission_complete) return false;
    if (event.received || event.line_error) link.ISR_byte(event.byte, event.line_error, clock.now_us());
    if (event.transmission_complete) reply_sent_.ISR_raise();
    return true;
  }

  /// A reply is under way.
  bool transmitting() const { return usart_.transmitting(); }

 private:
  bool configure() {
    using drivers::stm32f4::Interrupt;
    interrupts_.disable(Interrupt::usart2);
    const bool configured =
        usart_.configure({settings_.baud_rate, drivers::stm32f4::UsartParity::even}, kernel_clock_hz_);
    interrupts_.enable(Interrupt::usart2);
    return configured;
  }

  drivers::cortex_m::InterruptController<>& interrupts_;
  std::uint32_t kernel_clock_hz_;
  drivers::stm32f4::Usart<> usart_{drivers::stm32f4::usart2()};
  firmware::SerialSettings settings_{};
  firmware::InterruptSignal reply_sent_;
  bool replying_ = false;  ///< the main loop's: until reply_sent_, which it looks at in every turn
};

}  // namespace kmax::board::odrive_v3
