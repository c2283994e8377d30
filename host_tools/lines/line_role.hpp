#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

// What a GPIO line of the Linux computer is to the board. The role says which level is "active" unless the
// configuration says otherwise, and how people call the two states.

namespace kmax::lines {

enum class LineRole : std::uint8_t { reset, boot0, emergency_stop, fault, healthy, swdio, swclk };

enum class Polarity : std::uint8_t { active_high, active_low };
enum class Drive : std::uint8_t { push_pull, open_drain, open_source };

struct RoleFacts {
  LineRole role;
  std::string_view name;      ///< of the table [lines.NAME] in the configuration
  std::string_view active;    ///< the active state in one word
  std::string_view inactive;  ///< the other one
  Polarity polarity;          ///< when the configuration does not say
  Drive drive;                ///< when the configuration does not say
  bool from_board;            ///< the board drives it and this computer listens
  std::string_view meaning;
};

/// reset: the pull-up is in the chip, which also pulls NRST low itself, so nothing may push it high.
/// emergency_stop: a contact to ground that is open for stop; only the closed contact is driven.
inline constexpr std::array<RoleFacts, 7> all_roles = {{
    {LineRole::reset, "reset", "reset", "run", Polarity::active_low, Drive::open_drain, false,
     "NRST of the board's processor"},
    {LineRole::boot0, "boot0", "bootloader", "application", Polarity::active_high, Drive::push_pull, false,
     "BOOT0: which program the processor starts after a reset"},
    {LineRole::emergency_stop, "emergency_stop", "stop", "run", Polarity::active_high, Drive::open_drain,
     false, "emergency stop contact to ground: open is stop, closed is run"},
    {LineRole::fault, "fault", "fault", "none", Polarity::active_low, Drive::push_pull, true,
     "fault signal of the gate drivers"},
    {LineRole::healthy, "healthy", "healthy", "not ready", Polarity::active_high, Drive::push_pull, true,
     "the board is ready and without fault"},
    {LineRole::swdio, "swdio", "1", "0", Polarity::active_high, Drive::push_pull, false,
     "data of the debug port, for 'kmax flash'"},
    {LineRole::swclk, "swclk", "1", "0", Polarity::active_high, Drive::push_pull, false,
     "clock of the debug port, for 'kmax flash'"},
}};

constexpr const RoleFacts& facts_of(LineRole role) {
  return all_roles[static_cast<std::size_t>(role)];
}
static_assert([] {
  for (std::size_t i = 0; i < all_roles.size(); ++i) {
    if (static_cast<std::size_t>(all_roles[i].role) != i) return false;
  }
  return true;
}());

constexpr std::optional<LineRole> role_named(std::string_view name) {
  for (const RoleFacts& facts : all_roles) {
    if (facts.name == name) return facts.role;
  }
  return std::nullopt;
}

constexpr std::string_view state_word(LineRole role, bool active) {
  return active ? facts_of(role).active : facts_of(role).inactive;
}

}  // namespace kmax::lines
