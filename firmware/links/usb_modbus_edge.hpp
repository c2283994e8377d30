#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "firmware/board_interface/usb_port.hpp"
#include "firmware/exchange/interrupt_queue.hpp"
#include "firmware/links/modbus_registers.hpp"
#include "firmware/modbus/transfer_port.hpp"

namespace kmax::firmware {

/// The serial port over USB: packets in and replies out, behind which the device is a Modbus server, with the
/// unit number of the serial line. The link's host is another one than the serial line's (Link::usb): it has
/// transactions, a commander's number and signs of life of its own.
///
/// The USB interrupt calls the functions named ISR_, which the tick may preempt; all else is the main loop's.
/// Without a host nothing of this has to be called.
class UsbModbusEdge {
 public:
  explicit UsbModbusEdge(const LinkSources& sources);
  UsbModbusEdge(const UsbModbusEdge&) = delete;
  UsbModbusEdge& operator=(const UsbModbusEdge&) = delete;

  /// Another packet would be taken: only then may one come.
  bool ISR_has_room() const { return queue_.ISR_has_room(); }
  /// At most modbus::TransferReceiver::packet_bytes.
  void ISR_packet(std::span<const std::uint8_t> bytes, std::uint32_t time_us) {
    Packet packet{
        .time_us = time_us, .length = static_cast<std::uint8_t>(bytes.size()), .begins_anew = begins_anew_};
    begins_anew_ = false;
    std::copy(bytes.begin(), bytes.end(), packet.bytes.begin());
    queue_.ISR_push(packet);
  }
  /// Host and device have lost each other, or the host has opened the port anew: what came before belongs to
  /// no request that comes from now on, and no reply is under way.
  void ISR_restart() { begins_anew_ = true; }

  /// What has come; at most as many packets as one request has. True if there was any: then there is room for
  /// more. Behind Application::poll(), and behind what came over USB as CAN frames (CanopenEdge::take()):
  /// what either of them set acts at its end.
  bool poll();
  /// A reply to send now, once; the bytes stay valid until reply_sent().
  std::span<const std::uint8_t> reply_due() { return port_.take_reply(); }
  void reply_sent() { port_.reply_sent(); }

  /// A host may have another program started: no axis makes force, and the write lock is open, since that
  /// program could write all.
  bool may_leave_firmware() const { return !axes_.any_armed() && !parameters_.locked(); }
  /// Main loop, as often as they change.
  void set_readings(const UsbReadings& readings) { readings_ = readings; }
  /// Writes the readings counters.usb_* into `values`.
  void publish(ParameterValues& values) const;

 private:
  struct Packet {
    std::uint32_t time_us = 0;
    std::uint8_t length = 0;
    bool begins_anew = false;
    std::array<std::uint8_t, modbus::TransferReceiver::packet_bytes> bytes{};
  };
  static constexpr std::size_t packets = modbus::adu_size_max / modbus::TransferReceiver::packet_bytes;

  const ParameterAccess& parameters_;
  Axes& axes_;
  LinkState& state_;
  ModbusRegisters registers_;
  modbus::TransferPort<ModbusRegisters> port_;
  UsbReadings readings_;
  InterruptQueue<Packet, packets> queue_;
  bool begins_anew_ = false;  ///< the interrupt's alone
};

}  // namespace kmax::firmware
