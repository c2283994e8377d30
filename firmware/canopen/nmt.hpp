#pragma once

#include <cstdint>

#include "drivers/can_frame.hpp"
#include "firmware/object_dictionary/cob_id.hpp"

namespace kmax::firmware::canopen {

/// Node ID of a device that has none yet: only LSS is alive, until it has been given one (CiA 305).
inline constexpr std::uint8_t unconfigured_node_id = 255;

/// As heartbeats and object dictionary show it (CiA 301, 7.3.2.2 and 7.2.8.3.2.1).
enum class NmtState : std::uint8_t { initialising = 0, stopped = 4, operational = 5, pre_operational = 127 };

enum class NmtEvent : std::uint8_t {
  none,
  entered_operational,
  entered_pre_operational,
  entered_stopped,
  reset_node,
  reset_communication,
};

/// NMT slave and heartbeat producer of CiA 301 (7.2.8, 7.3.2).
///
///   start()     -> initialising; the boot-up message waits to be sent
///   next_frame  -> hands out the boot-up message and is pre-operational from then on
///   receive()   -> start, stop, pre-operational: the state changes. A reset: nothing is sent any more until
///                  the owner has done what is to be reset and calls start() again
///
/// The boot-up message counts as the first heartbeat: the next one follows one heartbeat time later. Later
/// ones keep to that grid, however late one of them was; those that got no room are left out, not sent in a
/// burst.
///
/// `now_us` wraps at 2^32. Main loop only. Cost: constant, a few comparisons.
class Nmt {
 public:
  /// Node ID 1..127; any other one (255) means that there is none: no boot-up message, no heartbeat, and no
  /// command is obeyed. `heartbeat_ms`: object 0x1017, 0 for none.
  void start(std::uint8_t node_id, std::uint16_t heartbeat_ms, std::uint32_t now_us) {
    node_id_ = node_id >= 1 && node_id <= highest_node_id ? node_id : unconfigured_node_id;
    state_ = NmtState::initialising;
    boot_up_waits_ = configured();
    set_heartbeat(heartbeat_ms, now_us);
  }

  /// Frames with another identifier, extended and remote ones are not for this part.
  NmtEvent receive(const drivers::CanFrame& frame) {
    if (frame.identifier != cob_id::nmt || frame.extended || frame.remote) return NmtEvent::none;
    if (frame.length != 2 || state_ == NmtState::initialising) return NmtEvent::none;
    if (frame.data[1] != 0 && frame.data[1] != node_id_) return NmtEvent::none;
    switch (frame.data[0]) {
      case 0x01:
        return enter(NmtState::operational);
      case 0x02:
        return enter(NmtState::stopped);
      case 0x80:
        return enter(NmtState::pre_operational);
      case 0x81:
        return reset(NmtEvent::reset_node);
      case 0x82:
        return reset(NmtEvent::reset_communication);
      default:
        return NmtEvent::none;
    }
  }

  /// The device's own change of state: error behaviour, object 0x1029. Without effect while initialising.
  /// `none` if that is the state already.
  NmtEvent enter(NmtState state) {
    if (state_ == NmtState::initialising || state == NmtState::initialising || state == state_) {
      return NmtEvent::none;
    }
    state_ = state;
    if (state == NmtState::operational) return NmtEvent::entered_operational;
    return state == NmtState::stopped ? NmtEvent::entered_stopped : NmtEvent::entered_pre_operational;
  }

  /// Object 0x1017 was written: the first heartbeat goes out at once, the others follow in the new time.
  void set_heartbeat(std::uint16_t heartbeat_ms, std::uint32_t now_us) {
    heartbeat_us_ = heartbeat_ms * 1000U;
    last_us_ = now_us - heartbeat_us_;
  }

  /// The boot-up message or a heartbeat, if one is due.
  bool next_frame(drivers::CanFrame& out, std::uint32_t now_us) {
    if (boot_up_waits_) {
      boot_up_waits_ = false;
      out = frame_of(NmtState::initialising);
      state_ = NmtState::pre_operational;
      last_us_ = now_us;
      return true;
    }
    if (state_ == NmtState::initialising || heartbeat_us_ == 0) return false;
    const std::uint32_t elapsed_us = now_us - last_us_;
    if (elapsed_us < heartbeat_us_) return false;
    last_us_ += elapsed_us / heartbeat_us_ * heartbeat_us_;
    out = frame_of(state_);
    return true;
  }

  NmtState state() const { return state_; }
  bool configured() const { return node_id_ != unconfigured_node_id; }
  /// 1..127, or 255 if there is none.
  std::uint8_t node_id() const { return node_id_; }

 private:
  NmtEvent reset(NmtEvent which) {
    state_ = NmtState::initialising;
    return which;
  }

  drivers::CanFrame frame_of(NmtState state) const {
    return {
        .identifier = cob_id::heartbeat + node_id_, .length = 1, .data = {static_cast<std::uint8_t>(state)}};
  }

  std::uint32_t heartbeat_us_{};
  std::uint32_t last_us_{};  // when the latest heartbeat was due
  NmtState state_ = NmtState::initialising;
  std::uint8_t node_id_ = unconfigured_node_id;
  bool boot_up_waits_ = false;
};

}  // namespace kmax::firmware::canopen
