// A Modbus RTU server on one serial line: receiver, server, unit filter and reply schedule. Chip-free; the
// application moves the characters:
//
//   RtuPort port(bank, RtuPortConfig{.unit = 1, .baud_rate = 115200});
//   loop:  now = clock;  for each received character: port.receive(byte, line_error, end_time);
//          port.poll(now);
//          if (auto reply = port.reply_due(now); !reply.empty()) enable the driver, send all of it;
//          when the last stop bit has left: disable the driver, port.reply_sent(now);
//
// Units: 1..247 are served if equal to the configured unit. Unit 0 is the broadcast: writes (6, 16, 22, 23)
// are executed, everything else is ignored, and there is never a reply. All other units are silent.
//
// Reply: reply_due() returns it once, at least t3.5 after the last stop bit of the request and never while
// characters come in. The span stays valid up to reply_sent(), which must be called. Everything that is
// received in between, and every character that began before reply_sent(), is the line's echo of the reply
// (RS-485, two wires) and is dropped.
//
// On a full-duplex line (half_duplex = false) there is no echo, and nothing is dropped: the next request may
// begin as soon as the client has the last character of the reply, which can be before the driver reports
// that it left. A request that is complete while the reply is still being sent is not carried out, but
// counted, and shows that the host is alive.
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
// A tagged write (server.hpp) that comes a second time, byte for byte and with no other request in between,
// is answered again as it was, and not carried out again.
//
// Host supervision: last_valid_request_time() moves only with frames of good CRC that were meant for this
// unit or for all, whatever the server answers.
//
// Time and calling context as in rtu_receiver.hpp: all calls from one context, the bank's functions run
// inside receive(), poll() or reply_due(). Memory: about 650 bytes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/modbus/crc.hpp"
#include "firmware/modbus/register_bank.hpp"
#include "firmware/modbus/rtu_receiver.hpp"
#include "firmware/modbus/rtu_timing.hpp"
#include "firmware/modbus/server.hpp"

namespace kmax::firmware::modbus {

inline constexpr std::uint8_t broadcast_unit = 0;
inline constexpr std::uint8_t unit_max = 247;

struct RtuPortConfig {
  std::uint8_t unit = 1;             // 1..247
  std::uint32_t baud_rate = 115200;  // baud_rate_min .. baud_rate_max
  CharacterFormat format{};
  bool half_duplex = true;  // RS-485 on two wires: what is received while sending is our own echo

  [[nodiscard]] constexpr bool is_valid() const {
    return unit != broadcast_unit && unit <= unit_max && baud_rate >= baud_rate_min &&
           baud_rate <= baud_rate_max && (format.stop_bits == 1 || format.stop_bits == 2);
  }

  friend constexpr bool operator==(const RtuPortConfig&, const RtuPortConfig&) = default;
};

// They wrap. Frames that were no frames are in RtuReceiverCounters.
struct RtuPortCounters {
  std::uint32_t other_units = 0;
  std::uint32_t requests = 0;    // to this unit or to all
  std::uint32_t broadcasts = 0;  // of them
  std::uint32_t replies = 0;     // handed out by reply_due()
  std::uint32_t exceptions = 0;  // requests answered with an exception
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
    if (is_echo(time_us)) return;
    drop_reply();
    if (const std::optional<RtuFrame> frame = receiver_.receive(byte, line_error, time_us)) {
      handle(*frame);
      drop_reply();
    }
  }

  // At least once a second.
  void poll(std::uint32_t now_us) {
    if (state_ == State::listening && receiver_.is_idle()) return;
    if (state_ == State::after_reply &&
        elapsed_us(now_us, reply_end_us_) >= receiver_.timing().character_us) {
      state_ = State::listening;
    }
    if (const std::optional<RtuFrame> frame = receiver_.poll(now_us)) handle(*frame);
  }

  // The bytes to send, once per reply; empty if there is nothing to send at `now_us`. Polls first.
  [[nodiscard]] std::span<const std::uint8_t> reply_due(std::uint32_t now_us) {
    poll(now_us);
    // A frame is handled only when t3.5 has passed since its end, and no character has come since
    // (drop_reply).
    if (state_ != State::reply_waiting) return {};
    state_ = State::sending;
    ++counters_.replies;
    return std::span(reply_).first(reply_size_);
  }

  // The last stop bit of the reply left at `now_us`.
  void reply_sent(std::uint32_t now_us) {
    if (state_ != State::sending) return;
    state_ = State::after_reply;
    reply_end_us_ = now_us;
    apply_requested_config();
  }

  // Returns false and changes nothing if `config` is invalid. Takes effect at once, or after the reply under
  // way.
  bool configure(const RtuPortConfig& config) {
    if (!config.is_valid()) return false;
    requested_config_ = config;
    if (state_ == State::listening || state_ == State::after_reply) apply_requested_config();
    return true;
  }

  // What is in effect now.
  [[nodiscard]] const RtuPortConfig& config() const { return config_; }
  [[nodiscard]] const RtuTiming& timing() const { return receiver_.timing(); }

  // End of the latest frame for this unit or for all; nothing before the first. On a clock that wraps every
  // 71 minutes: whoever compares it with the present must do so more often.
  [[nodiscard]] std::optional<std::uint32_t> last_valid_request_time() const {
    return last_valid_request_us_;
  }

  [[nodiscard]] const RtuPortCounters& counters() const { return counters_; }
  [[nodiscard]] const RtuReceiverCounters& receiver_counters() const { return receiver_.counters(); }

  // While the bank is being called: the request went to every unit.
  bool is_broadcast() const { return broadcast_; }

 private:
  enum class State : std::uint8_t {
    listening,
    executing,      // the bank is being called
    reply_waiting,  // for reply_due()
    sending,        // until reply_sent()
    after_reply,    // the echo of the last character may still come in
  };

  // Decides by the beginning of the character: what began before the reply's last stop bit had left cannot be
  // a request.
  bool is_echo(std::uint32_t time_us) {
    if (!config_.half_duplex) return false;
    if (state_ == State::sending) return true;
    if (state_ != State::after_reply) return false;
    if (elapsed_us(time_us, reply_end_us_) < receiver_.timing().character_us) return true;
    state_ = State::listening;
    return false;
  }

  void handle(const RtuFrame& frame) {
    const bool broadcast = frame.unit == broadcast_unit;
    if (!broadcast && frame.unit != config_.unit) {
      ++counters_.other_units;
      return;
    }
    last_valid_request_us_ = frame.end_us;
    ++counters_.requests;
    if (broadcast) ++counters_.broadcasts;
    if (state_ == State::sending) return;  // the buffer still holds the reply
    if (broadcast && !is_write(frame.pdu[0])) return;
    if (is_repeated_write(frame)) {
      state_ = State::reply_waiting;
      return;
    }
    state_ = State::executing;
    broadcast_ = broadcast;
    server_.diagnostics().set(diagnostic_counters());
    const std::size_t length =
        server_.process(frame.pdu, std::span(reply_).template subspan<1, pdu_size_max>());
    answered_ = hash_of(frame.pdu);
    answered_size_ = broadcast ? 0 : frame.pdu.size();
    if (broadcast) {
      finish_request();
      return;
    }
    if ((untagged(std::span(reply_).subspan(1, length))[0] & 0x80U) != 0) ++counters_.exceptions;
    reply_[0] = frame.unit;
    const std::uint16_t crc = crc_of(std::span(reply_).first(1 + length));
    reply_[1 + length] = static_cast<std::uint8_t>(crc & 0xFFU);
    reply_[2 + length] = static_cast<std::uint8_t>(crc >> 8U);
    reply_size_ = 1 + length + crc_size;
    state_ = State::reply_waiting;
  }

  // The very tagged write, tag and all, that the reply in the buffer is the answer to: the client has not got
  // that answer, or the line has doubled the request. It is answered again and not carried out twice. The tag
  // is in the reply; a CRC of 16 bits would take one in 65536 other writes for the same.
  bool is_repeated_write(const RtuFrame& frame) const {
    const auto request = untagged(frame.pdu);
    return request.size() != frame.pdu.size() && is_write(request[0]) && frame.pdu.size() == answered_size_ &&
           std::equal(frame.pdu.begin(), frame.pdu.begin() + 1 + tag_size, reply_.begin() + 1) &&
           hash_of(frame.pdu) == answered_;
  }

  // FNV-1a.
  static std::uint32_t hash_of(std::span<const std::uint8_t> bytes) {
    std::uint32_t hash = 0x811C'9DC5;
    for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x0100'0193U;
    return hash;
  }

  Diagnostics::Counters diagnostic_counters() const {
    const RtuReceiverCounters& line = receiver_.counters();
    return {line.frames_received,
            line.crc_errors + line.line_errors + line.gap_errors + line.oversize + line.undersize,
            counters_.exceptions, counters_.requests, counters_.broadcasts};
  }

  void drop_reply() {
    if (state_ == State::reply_waiting) finish_request();
  }

  void finish_request() {
    state_ = State::listening;
    apply_requested_config();
  }

  void apply_requested_config() {
    if (!requested_config_) return;
    const bool line_changes =
        requested_config_->baud_rate != config_.baud_rate || requested_config_->format != config_.format;
    config_ = *requested_config_;
    requested_config_.reset();
    if (line_changes) receiver_.set_timing(rtu_timing(config_.baud_rate, config_.format));
  }

  Server<Bank> server_;
  RtuPortConfig config_;
  RtuReceiver receiver_;
  std::optional<RtuPortConfig> requested_config_;
  RtuPortCounters counters_;
  std::optional<std::uint32_t> last_valid_request_us_;
  std::uint32_t reply_end_us_ = 0;
  std::size_t reply_size_{};
  std::size_t answered_size_ = 0;  // of the request that `reply_` answers; 0: of none
  std::uint32_t answered_{};       // its hash
  bool broadcast_{};               // what is being executed
  State state_ = State::listening;
  std::array<std::uint8_t, adu_size_max> reply_{};
};

}  // namespace kmax::firmware::modbus
