#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/exchange/interrupt_signal.hpp"
#include "firmware/usb/can_function.hpp"
#include "firmware/usb/serial_function.hpp"

namespace kmax::firmware::usb {

/// A vendor request to the device (bmRequestType 0x40) without data: restart into the boot loader in ROM, for
/// an update by dfu-util. Refused while any axis makes force. wValue keeps a request out that was meant for
/// another device: "DF".
inline constexpr std::uint8_t request_boot_loader = 0xDF;
inline constexpr std::uint16_t boot_loader_value = 0x4446;

/// What this device does over USB: a CAN adapter, a serial port, and the way into the boot loader. Which
/// request and which endpoint belongs to which. See DeviceFunctions.
template <EndpointController Controller, typename Link, typename Clock>
class Functions {
 public:
  /// `can_clock_hz`: see CanFunction.
  Functions(Controller& controller, Link& link, const Clock& clock, std::uint32_t can_clock_hz)
      : can_(controller, can_clock_hz), serial_(controller, link, clock) {}

  CanFunction<Controller>& can() { return can_; }
  SerialFunction<Controller, Link, Clock>& serial() { return serial_; }

  /// Main loop, as often as it changes. At the start: no restart is allowed.
  void allow_restart(bool allowed) { restart_allowed_.store(allowed, std::memory_order_relaxed); }
  /// Main loop, once: a host asks for the boot loader, and knows that it was heard. Whether an axis makes
  /// force now is the caller's to look at again.
  bool boot_loader_wanted() { return boot_loader_wanted_.take(); }

  void ISR_start() {
    can_.ISR_start();
    serial_.ISR_start();
  }
  void ISR_stop() {
    can_.ISR_stop();
    serial_.ISR_stop();
  }
  void ISR_serve() {
    can_.ISR_serve();
    serial_.ISR_serve();
  }

  std::optional<std::span<const std::uint8_t>> ISR_answer(const SetupPacket& setup,
                                                          std::span<std::uint8_t, full_packet> room) const {
    if (is_for_can(setup)) return can_.ISR_answer(setup, room);
    if (is_for_serial(setup)) return serial_.ISR_answer(setup);
    return std::nullopt;
  }
  bool ISR_accepts(const SetupPacket& setup) const {
    return (is_for_can(setup) && can_.ISR_accepts(setup)) ||
           (is_for_serial(setup) && serial_.ISR_accepts(setup));
  }
  bool ISR_take(const SetupPacket& setup, std::span<const std::uint8_t> data) {
    if (is_for_can(setup)) return can_.ISR_take(setup, data);
    if (is_for_serial(setup)) return serial_.ISR_take(setup, data);
    return asks_for_boot_loader(setup) && restart_allowed_.load(std::memory_order_relaxed);
  }
  void ISR_finished(const SetupPacket& setup) {
    if (asks_for_boot_loader(setup)) boot_loader_wanted_.ISR_raise();
  }

  void ISR_received(std::uint8_t number, std::span<const std::uint8_t> data) {
    if (number == number_of(can_from_host.address)) can_.ISR_received(data);
    if (number == number_of(serial_from_host.address)) serial_.ISR_received(data);
  }
  void ISR_sent(std::uint8_t number) {
    if (number == number_of(can_to_host.address)) can_.ISR_sent();
    if (number == number_of(serial_to_host.address)) serial_.ISR_sent();
  }
  void ISR_reopened(std::uint8_t address) {
    can_.ISR_reopened(address);
    serial_.ISR_reopened(address);
  }

 private:
  static bool is_for_can(const SetupPacket& setup) {
    return setup.kind() == RequestKind::vendor && setup.is_for(Recipient::interface) &&
           setup.index == can_interface;
  }
  static bool is_for_serial(const SetupPacket& setup) {
    return setup.kind() == RequestKind::of_class && setup.is_for(Recipient::interface) &&
           setup.index == serial_interface;
  }
  static bool asks_for_boot_loader(const SetupPacket& setup) {
    return setup.kind() == RequestKind::vendor && setup.is_for(Recipient::device) && !setup.to_host() &&
           setup.request == request_boot_loader && setup.value == boot_loader_value && setup.index == 0 &&
           setup.length == 0;
  }

  CanFunction<Controller> can_;
  SerialFunction<Controller, Link, Clock> serial_;
  InterruptSignal boot_loader_wanted_;
  std::atomic<bool> restart_allowed_{false};
};

}  // namespace kmax::firmware::usb
