#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "firmware/exchange/interrupt_signal.hpp"
#include "firmware/links/modbus_edge.hpp"

namespace kmax::board {

/// A serial port (stm32f405/serial_hardware.hpp is one), between its interrupt and the server behind it.
///
/// Follows the server's wish for a baud rate, but not in the middle of a reply. A rate that the port cannot
/// make leaves it as it was.
template <typename Hardware>
class SerialLink {
 public:
  /// With what the hardware is made of.
  template <typename... Facts>
  explicit SerialLink(Facts&&... facts) : hardware_(std::forward<Facts>(facts)...) {}

  /// Pins and clock are on, the interrupt has its priority.
  void start(const firmware::ModbusEdge& server) {
    settings_ = server.settings();
    if (!configure()) {
      settings_ = {115'200};
      static_cast<void>(configure());
    }
  }

  /// Main loop, after the server's poll().
  void poll(firmware::ModbusEdge& server, std::uint32_t now_us) {
    if (reply_sent_.take()) {
      server.reply_sent();
      replying_ = false;
    }
    if (replying_) return;
    const std::span<const std::uint8_t> reply = server.reply_due(now_us);
    if (!reply.empty()) {
      replying_ = hardware_.transmit(reply);
      if (replying_) return;
    }
    const firmware::SerialSettings wanted = server.settings();
    if (wanted == settings_) return;
    settings_ = wanted;
    static_cast<void>(configure());
  }

  /// The port's interrupt. True: it has left something for the main loop.
  template <typename Clock>
  bool ISR_serve(firmware::ModbusEdge& server, const Clock& clock) {
    const auto event = hardware_.ISR_serve();
    if (!event.received && !event.line_error && !event.transmission_complete) return false;
    if (event.received || event.line_error) server.ISR_byte(event.byte, event.line_error, clock.now_us());
    if (event.transmission_complete) reply_sent_.ISR_raise();
    return true;
  }

  /// A reply is under way.
  bool transmitting() const { return hardware_.transmitting(); }

 private:
  bool configure() { return hardware_.configure(settings_.baud_rate); }

  Hardware hardware_;
  firmware::SerialSettings settings_{};
  firmware::InterruptSignal reply_sent_;
  bool replying_ = false;  ///< the main loop's: until reply_sent_, which it looks at in every turn
};

}  // namespace kmax::board
