#pragma once

#include <array>
#include <cstdint>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware {

/// From where a host reaches the parameters; `local`: the board or the scene that holds the application;
/// `can_2`: the second SDO server; `usb`: the Modbus server behind the serial port over USB, while what comes
/// over USB as CAN frames is CAN's. Clients behind one link cannot be told apart: the device has one Modbus
/// unit on each line, and two SDO servers. Nor does a PDO say who sends it: while CAN commands its axis it is
/// the commander's, else that of `can`.
enum class Link : std::uint8_t { serial, can, local, can_2, usb };
inline constexpr std::size_t link_count = static_cast<std::size_t>(Link::usb) + 1;
inline constexpr std::array can_links{Link::can, Link::can_2};
constexpr bool is_can(Link link) {
  return link == Link::can || link == Link::can_2;
}

/// A controlword, and who wrote it.
struct Controlword {
  std::uint16_t word;
  Link by;
};

/// Which axes make force, and which link commands each of those.
struct ArmedAxes {
  std::array<bool, axis_count> axis{};
  std::array<Link, axis_count> commander{};
  std::array<bool, axis_count> fades{};  ///< its commander was lost: nobody commands it, and its force goes

  constexpr ArmedAxes() = default;
  /// All or none.
  constexpr ArmedAxes(bool all) { axis.fill(all); }  // NOLINT(google-explicit-constructor)

  constexpr bool any() const {
    bool some = false;
    for (const bool one : axis) some = some || one;
    return some;
  }
  /// Somebody else's hand is on it.
  constexpr bool is_anothers(std::size_t one, Link by) const { return axis[one] && commander[one] != by; }
};

}  // namespace kmax::firmware
