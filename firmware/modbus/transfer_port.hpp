// A Modbus server behind USB transfers: transfer_receiver.hpp and unit_server.hpp. A reply may leave as soon
// as it is there; USB is no bus of several units, but the unit is looked at all the same, so that one client
// works on either line.
//
// Before the reply has left, a client sends nothing that is carried out: what comes while it is being sent is
// counted and shows that the host is alive; what comes while it waits means that the client has given up on
// it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "firmware/modbus/transfer_receiver.hpp"
#include "firmware/modbus/unit_server.hpp"

namespace kmax::firmware::modbus {

template <RegisterBank Bank>
class TransferPort {
 public:
  // `unit`: 1..247; takes effect with the next request, so that a write to the unit is answered under the old
  // one.
  explicit TransferPort(Bank& bank, std::uint8_t unit) : server_(bank), unit_(unit) {}

  void receive(std::span<const std::uint8_t> packet, std::uint32_t time_us) {
    const std::optional<RtuFrame> frame = receiver_.receive(packet, time_us);
    if (!frame) return;
    server_.drop_reply();
    server_.handle(*frame, unit_, receiver_.counters());
  }
  // The line begins anew: neither the request nor the reply under way goes on.
  void restart() {
    receiver_.restart();
    server_.drop_reply();
    server_.reply_sent();
  }
  void set_unit(std::uint8_t unit) { unit_ = unit; }

  // The bytes to send, once per reply, valid up to reply_sent(); empty if none waits.
  [[nodiscard]] std::span<const std::uint8_t> take_reply() { return server_.take_reply(); }
  void reply_sent() { server_.reply_sent(); }

  // End of the latest frame for this unit or for all; nothing before the first. See RtuPort.
  [[nodiscard]] std::optional<std::uint32_t> last_valid_request_time() const {
    return server_.last_valid_request_time();
  }
  [[nodiscard]] const RtuPortCounters& counters() const { return server_.counters(); }
  [[nodiscard]] const RtuReceiverCounters& receiver_counters() const { return receiver_.counters(); }

 private:
  UnitServer<Bank> server_;
  TransferReceiver receiver_;
  std::uint8_t unit_;
};

}  // namespace kmax::firmware::modbus
