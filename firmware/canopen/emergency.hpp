#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/abort_code.hpp"
#include "firmware/canopen/nmt.hpp"
#include "firmware/object_dictionary/cob_id.hpp"

namespace kmax::firmware::canopen {

/// First manufacturer byte of emergencies about the bus and, plus the node ID, about other nodes; axes are 0,
/// 1, ...
inline constexpr std::uint8_t bus_source = 0x7F, watched_source = 0x80;

/// Errors that can be present at the same time.
inline constexpr std::size_t present_error_count = 16;
/// Messages that can wait for the inhibit time or for the bus.
inline constexpr std::size_t emergency_queue_length = 8;
/// Sub-indices of the history, object 0x1003.
inline constexpr std::size_t error_history_length = 8;

/// Bits of object 0x1001 (CiA 301, 7.5.2.2). Bit 0 is set by itself while there is any error.
namespace error_register {
inline constexpr std::uint8_t generic = 1U << 0;
inline constexpr std::uint8_t current = 1U << 1;
inline constexpr std::uint8_t voltage = 1U << 2;
inline constexpr std::uint8_t temperature = 1U << 3;
inline constexpr std::uint8_t communication = 1U << 4;
inline constexpr std::uint8_t device_profile = 1U << 5;
inline constexpr std::uint8_t manufacturer = 1U << 7;
}  // namespace error_register

/// `code` and `manufacturer[0]` together name an error, so that two axes or two lost nodes can have the same
/// one. `manufacturer[0]` and `[1]` are also kept in the history.
struct EmergencyError {
  std::uint16_t code = 0;                      ///< CiA 301, table of emergency error codes; 0 is none
  std::uint8_t register_bits = 0;              ///< of object 0x1001
  std::array<std::uint8_t, 5> manufacturer{};  ///< bytes 3 to 7 of the message; [0]: where it happened
};

/// Emergency producer of CiA 301 (7.2.7; objects 0x1001, 0x1003, 0x1014, 0x1015).
///
/// An error is announced once, when it appears. When it goes while others remain, the latest of those is sent
/// again, with the error register as it is now; code 0x0000 is sent only when none remains.
///
/// Messages wait in a queue while the inhibit time runs, and while the device is initialising or stopped, in
/// which states CiA 301 allows none. When the queue is full a message is lost and counted, but not its
/// result: once the queue is empty, the present state is sent (the latest error, or 0x0000 if all have gone).
/// The same after messages that were not sent because the object was not valid. The error register and the
/// history are always complete.
///
/// `now_us` wraps at 2^32: call next_frame() at least once an hour. Main loop only. Cost: a search among 16.
class Emergency {
 public:
  /// Objects 0x1014, with the node ID already added, and 0x1015 in 100 us (0: no inhibit time). Both take
  /// effect at once, also on messages that wait.
  void configure(std::uint32_t cob_id_raw, std::uint16_t inhibit_100us) {
    identifier_ = cob_id_raw & cob_id::identifier;
    valid_ = (cob_id_raw & cob_id::invalid) == 0;
    inhibit_us_ = inhibit_100us * 100U;
    if (valid_) return;
    state_untold_ = state_untold_ || queued_ != 0;
    queued_ = 0;
  }

  /// Communication starts again: waiting messages are dropped; if there are errors, the latest one is
  /// announced once the device is pre-operational. Errors and history stay.
  void start() {
    queued_ = 0;
    error_told_ = false;
    inhibiting_ = false;
    state_untold_ = present_ != 0;
  }

  /// An error appeared. To call it again while the error lasts changes nothing. False: refused, there are too
  /// many; it can be raised again later.
  bool raise(const EmergencyError& error);

  /// An error has gone; nothing happens if it was not there.
  void clear(std::uint16_t code, std::uint8_t source = 0) {
    const std::size_t found = find(code, source);
    if (found == present_) return;
    for (std::size_t i = found + 1; i < present_; ++i) errors_[i - 1] = errors_[i];
    --present_;
    announce();
  }

  /// The next message, if one may be sent in the NMT state `state`.
  bool next_frame(drivers::CanFrame& out, NmtState state, std::uint32_t now_us) {
    if (inhibiting_ && now_us - sent_us_ >= inhibit_us_) inhibiting_ = false;
    if (inhibiting_ || !valid_) return false;
    if (state != NmtState::pre_operational && state != NmtState::operational) return false;
    Message message{};
    if (queued_ != 0) {
      message = queue_[first_];
      first_ = (first_ + 1) % emergency_queue_length;
      --queued_;
    } else if (state_untold_) {
      state_untold_ = false;
      if (present_ == 0 && !error_told_) return false;
      message = present_state();
    } else {
      return false;
    }
    error_told_ = message[0] != 0 || message[1] != 0;
    inhibiting_ = true;
    sent_us_ = now_us;
    out = {.identifier = identifier_, .length = 8, .data = message};
    return true;
  }

  /// Object 0x1001.
  std::uint8_t error_register() const {
    std::uint8_t bits = present_ == 0 ? std::uint8_t{0} : error_register::generic;
    for (std::size_t i = 0; i < present_; ++i) {
      bits = static_cast<std::uint8_t>(bits | errors_[i].register_bits);
    }
    return bits;
  }

  std::size_t present() const { return present_; }
  bool present(std::uint16_t code, std::uint8_t source = 0) const { return find(code, source) != present_; }

  /// Object 0x1003, sub-index 0: errors in the history, 0..8.
  std::uint8_t history_count() const { return remembered_; }

  /// Object 0x1003, sub-index i + 1: the newest error is 0. Code in bits 0..15, manufacturer[0] in 16..23,
  /// manufacturer[1] in 24..31. 0 if there is none.
  std::uint32_t history_at(std::size_t i) const {
    if (i >= remembered_) return 0;
    return history_[(newest_ + error_history_length - i) % error_history_length];
  }

  void erase_history() { remembered_ = 0; }

  /// Messages that found the queue full. It wraps.
  std::uint32_t overflows() const { return overflows_; }

 private:
  using Message = std::array<std::uint8_t, 8>;

  std::size_t find(std::uint16_t code, std::uint8_t source) const {
    std::size_t i = 0;
    while (i < present_ && (errors_[i].code != code || errors_[i].manufacturer[0] != source)) ++i;
    return i;
  }

  void remember(const EmergencyError& error) {
    newest_ = (newest_ + 1) % error_history_length;
    history_[newest_] = std::uint32_t{error.code} | std::uint32_t{error.manufacturer[0]} << 16 |
                        std::uint32_t{error.manufacturer[1]} << 24;
    if (remembered_ < error_history_length) ++remembered_;
  }

  Message present_state() const {
    if (present_ == 0) return {};
    const EmergencyError& latest = errors_[present_ - 1];
    return {static_cast<std::uint8_t>(latest.code),
            static_cast<std::uint8_t>(latest.code >> 8),
            error_register(),
            latest.manufacturer[0],
            latest.manufacturer[1],
            latest.manufacturer[2],
            latest.manufacturer[3],
            latest.manufacturer[4]};
  }

  // A message that goes into the queue tells the present state, so what was lost before it is told too.
  void announce() {
    if (!valid_ || queued_ == emergency_queue_length) {
      if (valid_) ++overflows_;
      state_untold_ = true;
      return;
    }
    queue_[(first_ + queued_) % emergency_queue_length] = present_state();
    ++queued_;
    state_untold_ = false;
  }

  std::array<EmergencyError, present_error_count> errors_{};  // in the order in which they appeared
  std::array<Message, emergency_queue_length> queue_{};
  std::array<std::uint32_t, error_history_length> history_{};
  std::uint32_t overflows_ = 0;
  std::size_t present_ = 0;
  std::size_t queued_ = 0;
  std::size_t first_{}, newest_{};  // a ring begins anywhere
  std::uint32_t identifier_{};
  std::uint32_t inhibit_us_{};
  std::uint32_t sent_us_{};
  std::uint8_t remembered_ = 0;
  bool valid_ = false;         // until configure()
  bool inhibiting_ = false;    // sent_us_ counts
  bool state_untold_ = false;  // messages were lost, and none went into the queue after them
  bool error_told_ = false;    // the latest message sent was not 0x0000
};

}  // namespace kmax::firmware::canopen
