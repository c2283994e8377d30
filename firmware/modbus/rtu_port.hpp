// A Modbus RTU server on one serial line: receiver, unit server (unit_server.hpp) and reply schedule.
// Chip-free; the application moves the characters:
//
//   RtuPort port(bank, RtuPortConfig{.unit = 1, .baud_rate = 115200});
//   loop:  now = clock;  for each received character: port.receive(byte, line_error, end_time);
//          port.poll(now);
//          if (auto reply = port.reply_due(now); !reply.empty()) send all of it;
//          when the last stop bit has left: port.reply_sent();
//
// Reply: reply_due() returns it once, at least t3.5 after the last stop bit of the request and never while
// characters come in. The span stays valid up to reply_sent(), which must be called.
//
// The line has a pair of wires for each direction, so that nothing comes back of what is sent: the next
// request may begin as soon as the client has the last character of the reply, which can be before the driver
// reports that it left. A request that is complete while the reply is still being sent is not carried out,
// but counted, and shows that the host is alive.
//
// A character that arrives while a reply waits to be fetched means that the client has given up on that reply
// (or does not keep the protocol). The reply is dropped, since sent now it would be taken for the answer to
// the next request; what the request wrote stays written. The character begins the next request, which is
// answered in the normal way.
//
// configure() during a request, or while its reply waits or is being sent, takes effect when the reply has
// left, so a write to the unit or the baud rate is still answered under the old ones. The application sets
// its USART to config() whenever that differs (after reply_sent(), poll() and configure()).
//
// Host supervision: last_valid_request_time() moves only with frames of good CRC that were meant for this
// unit or for all, whatever the server answers.
//
// Time and calling context as in rtu_receiver.hpp: all calls from one context, the bank's functions run
// inside receive(), poll() or reply_due(). Memory: about 650 bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/modbus/register_bank.hpp"
#include "firmware/modbus/rtu_receiver.hpp"
#include "firmware/modbus/rtu_timing.hpp"
#include "firmware/modbus/unit_server.hpp"

namespace kmax::firmware::modbus {

struct RtuPortConfig {
  std::uint8_t unit = 1;             // 1..247
  std::uint32_t baud_rate = 115200;  // baud_rate_min .. baud_rate_max
  CharacterFormat format{};

  [[nodiscard]] constexpr bool is_valid() const {
    return unit != broadcast_unit && unit <= unit_max && baud_rate >= baud_rate_min &&
           baud_rate <= baud_rate_max && (format.stop_bits == 1 || format.stop_bits == 2);
  }

  friend constexpr bool operator==(const RtuPortConfig&, const RtuPortConfig&) = default;
};

template <RegisterBank Bank>
class RtuPort {
 public:
  // An invalid `config` is replaced by the default one, see config().
  explicit RtuPort(Bank& bank, const RtuPortConfig& config = {})
      : server_(bank),
        config_(config.is_valid() ? config : RtuPortConfig{}),
        receiver_(rtu_timing(config_.baud_rate, config_.format)) {}

  // A character whose last stop bit ended at `time_us`; `line_error` for parity, framing or overrun.
  void receive(std::uint8_t byte, bool line_error, std::uint32_t time_us) {
    drop_reply();
    if (const std::optional<RtuFrame> frame = receiver_.receive(byte, line_error, time_us)) {
      handle(*frame);
      drop_reply();
    }
  }

  // At least once a second.
  void poll(std::uint32_t now_us) {
    if (server_.is_idle() && receiver_.is_idle()) return;
    if (const std::optional<RtuFrame> frame = receiver_.poll(now_us)) handle(*frame);
  }

  // The bytes to send, once per reply; empty if there is nothing to send at `now_us`. Polls first.
  [[nodiscard]] std::span<const std::uint8_t> reply_due(std::uint32_t now_us) {
    poll(now_us);
    // A frame is handled only when t3.5 has passed since its end, and no character has come since
    // (drop_reply).
    return server_.take_reply();
  }

  // The last stop bit of the reply has left.
  void reply_sent() {
    server_.reply_sent();
    apply_requested_config();
  }

  // Returns false and changes nothing if `config` is invalid. Takes effect at once, or after the reply under
  // way.
  bool configure(const RtuPortConfig& config) {
    if (!config.is_valid()) return false;
    requested_config_ = config;
    apply_requested_config();
    return true;
  }

  // What is in effect now.
  [[nodiscard]] const RtuPortConfig& config() const { return config_; }
  [[nodiscard]] const RtuTiming& timing() const { return receiver_.timing(); }

  // End of the latest frame for this unit or for all; nothing before the first. On a clock that wraps every
  // 71 minutes: whoever compares it with the present must do so more often.
  [[nodiscard]] std::optional<std::uint32_t> last_valid_request_time() const {
    return server_.last_valid_request_time();
  }

  [[nodiscard]] const RtuPortCounters& counters() const { return server_.counters(); }
  [[nodiscard]] const RtuReceiverCounters& receiver_counters() const { return receiver_.counters(); }

 private:
  void handle(const RtuFrame& frame) {
    server_.handle(frame, config_.unit, receiver_.counters());
    apply_requested_config();
  }

  void drop_reply() {
    server_.drop_reply();
    apply_requested_config();
  }

  void apply_requested_config() {
    if (!requested_config_ || !server_.is_idle()) return;
    const bool line_changes =
        requested_config_->baud_rate != config_.baud_rate || requested_config_->format != config_.format;
    config_ = *requested_config_;
    requested_config_.reset();
    if (line_changes) receiver_.set_timing(rtu_timing(config_.baud_rate, config_.format));
  }

  UnitServer<Bank> server_;
  RtuPortConfig config_;
  RtuReceiver receiver_;
  std::optional<RtuPortConfig> requested_config_;
};

}  // namespace kmax::firmware::modbus
