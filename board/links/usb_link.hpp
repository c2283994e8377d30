#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "drivers/can_frame.hpp"
#include "firmware/application.hpp"
#include "firmware/board_interface/usb_port.hpp"
#include "firmware/exchange/interrupt_queue.hpp"
#include "firmware/exchange/interrupt_signal.hpp"
#include "firmware/usb/device.hpp"
#include "firmware/usb/functions.hpp"

namespace kmax::board {

/// A USB device (stm32f405/usb_hardware.hpp is one), between its interrupt and what is behind it: the serial
/// port's Modbus server, and the CAN adapter.
///
/// Channel 0 of the adapter joins the board's node alone. A host on it is to the node what one on the bus is:
/// it hears all that the node sends, and sends to it. Channel 1 joins the bus as well: what a host sends
/// there goes to the node and, as long as half of the transmit slots are left to the node, to the bus; what
/// the bus brings, and what the node sends there, it hears. Without such a host the bus hears and sends
/// nothing more.
///
/// While a bus takes what is sent, it sets the pace at which the node sends; a bus that is off, or where
/// nobody acknowledges, or that is full of what is more urgent, does not: then the adapter does, and the bus
/// gets what it has room for. A host that fetches its frames sets it too; one that does not for 10 ms loses
/// them, hears so with the next one, and holds up nobody. What a host has for the bus waits apart, so that
/// what it has for the node alone goes on; and what others say on the bus, it hears as long as there is room
/// left for the node.
///
/// Without a host none of this is called but the interrupt, now and then, and due(), one look at a flag.
template <typename Hardware, typename Clock>
class UsbLink {
 public:
  /// With what the hardware is made of at the end.
  template <typename... Facts>
  UsbLink(firmware::UsbModbusEdge& server, const Clock& clock, const firmware::usb::DeviceIdentity& identity,
          std::uint32_t can_clock_hz, bool boot_loader_is_safe, Facts&&... facts)
      : clock_(clock),
        boot_loader_is_safe_(boot_loader_is_safe),
        hardware_(std::forward<Facts>(facts)...),
        functions_(hardware_, server, clock, can_clock_hz),
        device_(hardware_, functions_, identity) {}

  /// Clock and pins are on, the interrupt has its priority, 48 MHz come from the crystal.
  void start() { hardware_.start(); }

  /// Main loop: there is something for poll().
  [[gnu::always_inline]] bool due() { return due_.take(); }
  /// Main loop, behind the application's and before the CAN link sends. As long as a host is there it is due
  /// in every turn.
  template <typename Bus>
  void poll(firmware::Application& application, Bus& bus) {
    const bool attended = attended_.load(std::memory_order_relaxed);
    functions_.allow_restart(may_restart(application));
    application.usb().set_readings(readings());
    bool moved = exchange_frames(application.can(), bus);
    if (functions_.serial().reply_sent()) application.usb().reply_sent();
    moved = application.usb().poll() || moved;
    // What that request began, a save for one, keeps the boot loader away at once.
    functions_.allow_restart(may_restart(application));
    if (const auto reply = application.usb().reply_due(); !reply.empty()) {
      functions_.serial().send(reply);
      moved = true;
    }
    if (moved) hardware_.pend();
    if (attended) due_.ISR_raise();
  }
  /// Main loop, behind poll(): a host asks for a restart into the boot loader, and nothing stands against it.
  bool boot_loader_wanted(firmware::Application& application) {
    return functions_.boot_loader_wanted() && may_restart(application);
  }
  /// The host sees the device leave.
  void disconnect() { hardware_.disconnect(); }

  /// Its interrupt. True: it has left something for the main loop.
  bool ISR_serve() {
    const bool some = hardware_.ISR_serve(device_);
    functions_.ISR_serve();
    attended_.store(device_.ISR_attended(), std::memory_order_relaxed);
    if (some) due_.ISR_raise();
    return some;
  }
  /// Of the bus, from the CAN interrupt, which has the same priority.
  void ISR_bus_frame(const drivers::CanFrame& frame) {
    const auto& can = functions_.can();
    if (can.is_open(Channel::bus)) from_bus_.ISR_push(can.to_host(Channel::bus, frame));
  }

 private:
  using Functions = firmware::usb::Functions<Hardware, firmware::UsbModbusEdge, Clock>;
  using Channel = firmware::usb::CanChannel;
  static constexpr std::size_t frames_per_poll = 8;
  static constexpr std::uint32_t host_patience_us = 10'000;

  bool may_restart(firmware::Application& application) const {
    return boot_loader_is_safe_ && !application.store_busy() && application.usb().may_leave_firmware();
  }

  firmware::UsbReadings readings() {
    const auto device = device_.counters();
    const auto adapter = functions_.can().counters();
    return {.resets = device.resets,
            .suspensions = device.suspensions,
            .refused_requests = device.refused_requests,
            .frames_lost = adapter.lost + from_bus_.overflows(),
            .frames_not_sent = frames_not_sent_,
            .frames_refused = adapter.refused};
  }

  /// Frames of the host that wait for the bus: more than Linux sends before it has their echoes, which is 10.
  class Guests {
   public:
    bool empty() const { return waiting_ == 0; }
    bool full() const { return waiting_ == frames_.size(); }
    firmware::usb::gs::HostFrame& next_place() { return frames_[(first_ + waiting_) % frames_.size()]; }
    void take_in() { ++waiting_; }
    const firmware::usb::gs::HostFrame& first() const { return frames_[first_]; }
    void drop_first() {
      first_ = (first_ + 1) % frames_.size();
      --waiting_;
    }

   private:
    std::array<firmware::usb::gs::HostFrame, 16> frames_{};
    std::size_t first_ = 0, waiting_ = 0;
  };

  /// True if frames have moved either way.
  template <typename Bus>
  bool exchange_frames(firmware::CanopenEdge& node, Bus& bus) {
    auto& can = functions_.can();
    const bool there = attended_.load(std::memory_order_relaxed);
    const bool with_node = there && can.is_open(Channel::node), with_bus = there && can.is_open(Channel::bus);
    node.set_reached_over_usb(with_node);
    bus.set_listening_to_all(with_bus);
    // All that the node sends is shown here, also what the bus has room for at once.
    bus.set_fed_by_adapter(with_node || with_bus);
    bool moved = false;
    if (const std::uint32_t overflows = from_bus_.overflows(); overflows != overflows_) {
      overflows_ = overflows;
      can.note_loss(Channel::bus);
    }
    firmware::usb::gs::HostFrame of_bus;
    for (std::size_t i = 0; i < frames_per_poll && from_bus_.pop(of_bus); ++i) {
      can.show_of_others(of_bus);
      moved = true;
    }
    if (!with_node && !with_bus) return moved;
    const std::uint32_t now_us = clock_.now_us();
    const bool bus_sets_pace = bus.keeps_pace(now_us), host_sets_pace = host_keeps_pace(now_us);
    moved = take_from_host(node) || moved;
    moved = pass_guests(node, bus, bus_sets_pace) || moved;
    drivers::CanFrame frame;
    for (std::size_t i = 0; i < frames_per_poll; ++i) {
      const bool waits = (bus_sets_pace && !bus.has_room()) || (host_sets_pace && !can.has_room());
      if (waits || !node.next_frame(frame)) break;
      if (!bus.put(frame)) ++frames_not_sent_;
      can.show(Channel::node, frame);
      can.show(Channel::bus, frame);
      moved = true;
    }
    return moved;
  }

  /// It fetches what there is for it, or nothing is.
  bool host_keeps_pace(std::uint32_t now_us) {
    const std::uint32_t fetched = functions_.can().fetched();
    if (fetched != paced_fetched_ || functions_.can().nothing_waits()) {
      paced_fetched_ = fetched;
      paced_us_ = now_us;
    }
    return now_us - paced_us_ < host_patience_us;
  }

  bool take_from_host(firmware::CanopenEdge& node) {
    auto& can = functions_.can();
    bool moved = false;
    for (std::size_t i = 0; i < frames_per_poll && !guests_.full(); ++i) {
      firmware::usb::gs::HostFrame& frame = guests_.next_place();
      if (!can.next_from_host(frame)) break;
      moved = true;
      if (!can.is_current(frame)) continue;
      if (frame.channel == static_cast<std::uint8_t>(Channel::bus)) {
        guests_.take_in();
      } else {
        node.take(frame.frame);
        can.done(frame);
      }
    }
    return moved;
  }

  /// To the bus and to the node, when the bus has room for them or is not waited for.
  template <typename Bus>
  bool pass_guests(firmware::CanopenEdge& node, Bus& bus, bool bus_sets_pace) {
    auto& can = functions_.can();
    bool moved = false;
    for (std::size_t i = 0; i < frames_per_poll && !guests_.empty(); ++i) {
      const firmware::usb::gs::HostFrame& frame = guests_.first();
      if (can.is_current(frame)) {
        const bool fits = bus.has_room_for_guests();
        if ((bus_sets_pace && !fits) || !can.has_room_for_echo()) break;
        if (!fits || !bus.put(frame.frame)) ++frames_not_sent_;
        node.take(frame.frame);
        can.done(frame);
      }
      guests_.drop_first();
      moved = true;
    }
    return moved;
  }

  const Clock& clock_;
  const bool boot_loader_is_safe_;
  Hardware hardware_;
  Functions functions_;
  firmware::usb::Device<Hardware, Functions> device_;
  firmware::InterruptSignal due_;
  std::atomic<bool> attended_{false};  ///< the interrupt writes it
  firmware::InterruptQueue<firmware::usb::gs::HostFrame, 16> from_bus_;
  Guests guests_;
  std::uint32_t frames_not_sent_ = 0, overflows_ = 0;
  std::uint32_t paced_us_ = 0, paced_fetched_ = 0;  ///< when the host fetched something last
};

}  // namespace kmax::board
