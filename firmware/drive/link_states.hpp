#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "firmware/drive/armed_axes.hpp"

namespace kmax::firmware {

/// What the supervisors have to know of one link. Each link writes its own, in the main loop, before it
/// writes what a host commands: the command to arm needs a sign of life.
struct LinkState {
  /// When its host was last heard: over serial any valid request; over CAN a command or a watched
  /// heartbeat. Nothing: never.
  std::optional<std::uint32_t> heard_us;
  bool is_off = false;  ///< off the bus, or never on it again after a bit rate that failed
  /// Of CAN, for each axis: its last command came by the board's CAN adapter on USB.
  std::array<bool, axis_count> heard_over_usb{};
  bool heartbeat_lost = false;  ///< of a watched node
  bool restart_asked = false;   ///< of the whole device; nothing may be armed any more
};

class LinkStates {
 public:
  LinkState& operator[](Link link) { return of_[static_cast<std::size_t>(link)]; }
  const LinkState& operator[](Link link) const { return of_[static_cast<std::size_t>(link)]; }

 private:
  std::array<LinkState, link_count> of_{};
};

}  // namespace kmax::firmware
