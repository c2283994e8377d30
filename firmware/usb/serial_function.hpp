#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/exchange/interrupt_signal.hpp"
#include "firmware/exchange/queue_to_interrupt.hpp"
#include "firmware/usb/descriptors.hpp"
#include "firmware/usb/endpoint_controller.hpp"

namespace kmax::firmware::usb {

/// The serial port (CDC ACM, PSTN 1.2) between the USB interrupt and a link of packets behind it.
///
/// `Link`: ISR_has_room(), ISR_packet(bytes, time_us), ISR_restart(), see UsbModbusEdge; `Clock`: now_us().
/// There is no line behind the port: a line coding is kept and given back, and has no effect; breaks and the
/// control lines have none either, but that a host which raises or drops DTR opens or closes the port.
///
/// While the link has no room the endpoint answers NAK, and the host waits. A reply leaves in packets of 64
/// bytes, with an empty one behind a reply that fills its last.
template <EndpointController Controller, typename Link, typename Clock>
class SerialFunction {
 public:
  SerialFunction(Controller& controller, Link& link, const Clock& clock)
      : controller_(controller), link_(link), clock_(clock) {}

  /// Main loop: a reply, whose bytes stay as they are until reply_sent(). One at a time. The caller pends the
  /// interrupt.
  void send(std::span<const std::uint8_t> reply) { static_cast<void>(replies_.push(reply)); }
  /// Main loop, once for each: the host has the whole reply, or nobody is there to take it.
  bool reply_sent() { return reply_sent_.take(); }

  void ISR_start() {
    running_ = true;
    in_flight_ = receiving_ = false;
    ISR_serve();
  }
  void ISR_stop() {
    running_ = in_flight_ = receiving_ = false;
    ISR_begin_anew();
    ISR_serve();
  }
  /// What the main loop has left: a reply, or room for the next packet.
  void ISR_serve() {
    if (std::span<const std::uint8_t> next; !left_ && replies_.ISR_pop(next)) left_ = next;
    if (left_ && !running_) ISR_end_reply();
    if (!running_) return;
    if (!in_flight_ && (left_ || owes_empty_)) ISR_send_packet();
    if (!receiving_ && link_.ISR_has_room()) {
      receiving_ = true;
      controller_.ISR_receive(number_of(serial_from_host.address));
    }
  }

  std::optional<std::span<const std::uint8_t>> ISR_answer(const SetupPacket& setup) const {
    if (setup.request != get_line_coding || setup.value != 0) return std::nullopt;
    return std::span<const std::uint8_t>(line_coding_);
  }
  bool ISR_accepts(const SetupPacket& setup) const {
    return setup.request == set_line_coding && setup.value == 0 && setup.length == line_coding_.size();
  }
  bool ISR_take(const SetupPacket& setup, std::span<const std::uint8_t> data) {
    switch (setup.request) {
      case set_line_coding:
        if (data.size() != line_coding_.size()) return false;
        std::copy(data.begin(), data.end(), line_coding_.begin());
        return true;
      case set_control_line_state:
        ISR_follow_terminal((setup.value & terminal_ready_bit) != 0);
        return data.empty();
      case send_break:
        return data.empty();
      default:
        return false;
    }
  }

  void ISR_received(std::span<const std::uint8_t> data) {
    receiving_ = false;
    link_.ISR_packet(data, clock_.now_us());
    ISR_serve();
  }
  void ISR_sent() {
    in_flight_ = false;
    if (left_ && left_->empty()) ISR_end_reply();
    ISR_serve();
  }
  /// A packet that was lost with the halt is not sent again: its reply is cut, and the client asks again.
  void ISR_reopened(std::uint8_t address) {
    if (address == serial_to_host.address) {
      in_flight_ = owes_empty_ = false;
      if (left_) ISR_end_reply();
    }
    if (address == serial_from_host.address) receiving_ = false;
    ISR_serve();
  }

 private:
  // PSTN 1.2, table 13.
  static constexpr std::uint8_t set_line_coding = 0x20, get_line_coding = 0x21, set_control_line_state = 0x22,
                                send_break = 0x23;
  static constexpr std::uint16_t terminal_ready_bit = 1;

  /// The empty one that the reply before ends with comes first; it is no part of that any more: the client
  /// has all of it, and may ask again before the empty one is fetched.
  void ISR_send_packet() {
    in_flight_ = true;
    std::span<const std::uint8_t> packet;
    if (owes_empty_) {
      owes_empty_ = false;
    } else {
      packet = left_->first(std::min(left_->size(), full_packet));
      left_ = left_->subspan(packet.size());
      owes_empty_ = left_->empty() && packet.size() == full_packet;
    }
    controller_.ISR_send(number_of(serial_to_host.address), packet);
  }
  void ISR_end_reply() {
    left_.reset();
    reply_sent_.ISR_raise();
  }
  /// Nobody gets what was for the client before: its reply in the endpoint neither.
  void ISR_begin_anew() {
    link_.ISR_restart();
    if (in_flight_) controller_.ISR_take_back(number_of(serial_to_host.address));
    in_flight_ = owes_empty_ = false;
    if (left_) ISR_end_reply();
  }
  void ISR_follow_terminal(bool ready) {
    if (ready == terminal_ready_) return;
    terminal_ready_ = ready;
    ISR_begin_anew();
  }

  Controller& controller_;
  Link& link_;
  const Clock& clock_;
  QueueToInterrupt<std::span<const std::uint8_t>, 1> replies_;
  InterruptSignal reply_sent_;
  std::optional<std::span<const std::uint8_t>> left_;  ///< of the reply under way, not yet sent
  /// 115200 baud, one stop bit, even parity, eight bits: what the serial line has.
  std::array<std::uint8_t, 7> line_coding_{0x00, 0xC2, 0x01, 0x00, 0, 2, 8};
  bool running_ = false, in_flight_ = false, receiving_ = false, terminal_ready_ = false, owes_empty_ = false;
};

}  // namespace kmax::firmware::usb
