#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "firmware/exchange/interrupt_queue.hpp"
#include "firmware/links/modbus_registers.hpp"
#include "firmware/modbus/rtu_port.hpp"

namespace kmax::firmware {

struct SerialSettings {
  std::uint32_t baud_rate;
  friend constexpr bool operator==(const SerialSettings&, const SerialSettings&) = default;
};

/// The serial link: bytes in and replies out, behind which the device is a Modbus server.
///
/// The receive interrupt calls ISR_byte(), which the tick may preempt; all else is the main loop's.
class ModbusEdge {
 public:
  explicit ModbusEdge(const LinkSources& sources);
  ModbusEdge(const ModbusEdge&) = delete;
  ModbusEdge& operator=(const ModbusEdge&) = delete;

  void ISR_byte(std::uint8_t byte, bool line_error, std::uint32_t time_us) {
    queue_.ISR_push({time_us, byte, line_error});
  }
  void poll(std::uint32_t now_us);
  /// Unit and baud rate as they are now; in force at once, or behind the reply under way.
  void follow_parameters();

  /// A reply that may be sent now, once; the bytes stay valid until reply_sent().
  std::span<const std::uint8_t> reply_due(std::uint32_t now_us) { return port_.reply_due(now_us); }
  /// The reply's last stop bit has left.
  void reply_sent() { port_.reply_sent(); }
  /// What the line must be set to; changes only while no reply is under way.
  SerialSettings settings() const { return {port_.config().baud_rate}; }

  /// When the latest frame for this unit or for all had come; nothing: none has.
  std::optional<std::uint32_t> heard_us() const { return port_.last_valid_request_time(); }

  /// Writes the readings counters.* of this link into `values`.
  void publish(ParameterValues& values) const;

 private:
  struct Byte {
    std::uint32_t time_us;
    std::uint8_t byte;
    bool line_error;
  };

  const ParameterAccess& parameters_;
  LinkState& state_;
  std::uint32_t followed_changes_ = 0;
  ModbusRegisters registers_;
  modbus::RtuPort<ModbusRegisters> port_;
  InterruptQueue<Byte, 512> queue_;
};

}  // namespace kmax::firmware
