// A Modbus server behind one line: unit filter, execution, and the one reply that waits or is being sent.
// What divides the line into frames, and when a reply may leave, is its owner's business: RtuPort by silence,
// TransferPort by USB transfers.
//
// Units: 1..247 are served if equal to the configured unit. Unit 0 is the broadcast: writes (6, 16, 22, 23)
// are executed, everything else is ignored, and there is never a reply. All other units are silent.
//
// A tagged write (server.hpp) that comes a second time, byte for byte and with no other request in between,
// is answered again as it was, and not carried out again.
//
// A request that is complete while the reply is still being sent is not carried out, but counted, and shows
// that the host is alive.
//
// A bank that has begin_request(end_us, broadcast) is told of each request that is for it, before it is
// carried out: whose sign of life it is, and whether it went to every unit.
//
// One context. Memory: about 300 bytes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/modbus/adu.hpp"
#include "firmware/modbus/crc.hpp"
#include "firmware/modbus/register_bank.hpp"
#include "firmware/modbus/server.hpp"

namespace kmax::firmware::modbus {

// They wrap. Frames that were no frames are in RtuReceiverCounters.
struct RtuPortCounters {
  std::uint32_t other_units = 0;
  std::uint32_t requests = 0;    // to this unit or to all
  std::uint32_t broadcasts = 0;  // of them
  std::uint32_t replies = 0;     // handed out
  std::uint32_t exceptions = 0;  // requests answered with an exception
};

template <RegisterBank Bank>
class UnitServer {
 public:
  explicit UnitServer(Bank& bank) : bank_(bank), server_(bank) {}

  // `line`: the counters of whoever found the frame. Afterwards a reply may wait.
  void handle(const RtuFrame& frame, std::uint8_t unit, const RtuReceiverCounters& line) {
    const bool broadcast = frame.unit == broadcast_unit;
    if (!broadcast && frame.unit != unit) {
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
    if constexpr (requires { bank_.begin_request(frame.end_us, broadcast); })
      bank_.begin_request(frame.end_us, broadcast);
    server_.diagnostics().set(diagnostic_counters(line));
    const std::size_t length =
        server_.process(frame.pdu, std::span(reply_).template subspan<1, pdu_size_max>());
    answered_ = hash_of(frame.pdu);
    answered_size_ = broadcast ? 0 : frame.pdu.size();
    if (broadcast) {
      state_ = State::idle;
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

  // The client has given up on a reply that still waits; what the request wrote stays written.
  void drop_reply() {
    if (state_ == State::reply_waiting) state_ = State::idle;
  }
  // The bytes to send, once per reply, valid up to reply_sent(); empty if none waits.
  [[nodiscard]] std::span<const std::uint8_t> take_reply() {
    if (state_ != State::reply_waiting) return {};
    state_ = State::sending;
    ++counters_.replies;
    return std::span(reply_).first(reply_size_);
  }
  void reply_sent() {
    if (state_ == State::sending) state_ = State::idle;
  }

  // No request is being carried out, and no reply waits or is being sent.
  [[nodiscard]] bool is_idle() const { return state_ == State::idle; }
  // End of the latest frame for this unit or for all; nothing before the first.
  [[nodiscard]] std::optional<std::uint32_t> last_valid_request_time() const {
    return last_valid_request_us_;
  }
  [[nodiscard]] const RtuPortCounters& counters() const { return counters_; }

 private:
  enum class State : std::uint8_t {
    idle,
    executing,      // the bank is being called
    reply_waiting,  // for take_reply()
    sending,        // until reply_sent()
  };

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

  Diagnostics::Counters diagnostic_counters(const RtuReceiverCounters& line) const {
    return {line.frames_received,
            line.crc_errors + line.line_errors + line.gap_errors + line.oversize + line.undersize,
            counters_.exceptions, counters_.requests, counters_.broadcasts};
  }

  Bank& bank_;
  Server<Bank> server_;
  RtuPortCounters counters_;
  std::optional<std::uint32_t> last_valid_request_us_;
  std::size_t reply_size_{};
  std::size_t answered_size_ = 0;  // of the request that `reply_` answers; 0: of none
  std::uint32_t answered_{};       // its hash
  State state_ = State::idle;
  std::array<std::uint8_t, adu_size_max> reply_{};
};

}  // namespace kmax::firmware::modbus
