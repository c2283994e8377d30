#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include "firmware/object_dictionary/axis_readings.hpp"
#include "firmware/object_dictionary/axis_settings.hpp"
#include "firmware/object_dictionary/communication_entries.hpp"
#include "firmware/object_dictionary/device_entries.hpp"

namespace kmax::firmware {

inline constexpr std::uint32_t tick_rate_hz = 20000;
inline constexpr double tick_interval = 1.0 / tick_rate_hz;  ///< s

/// All that exists once per axis: settings, then readings.
inline constexpr auto axis_entries = []<std::size_t... i>(std::index_sequence<i...>) {
  return std::array<Entry, sizeof...(i)>{
      (i < axis_settings.size() ? axis_settings[i] : axis_readings[i - axis_settings.size()])...};
}
(std::make_index_sequence<axis_settings.size() + axis_readings.size()>{});

inline constexpr std::size_t entry_count =
    axis_entries.size() + device_entries.size() + communication_entries.size();

/// All tables behind one index: the axis entries, then the device's, then CANopen's own, which are the
/// device's too.
constexpr const Entry& entry_at(std::size_t i) {
  if (i < axis_entries.size()) return axis_entries[i];
  if (i - axis_entries.size() < device_entries.size()) return device_entries[i - axis_entries.size()];
  return communication_entries[i - axis_entries.size() - device_entries.size()];
}

/// entry_count if there is none.
constexpr std::size_t find_entry(std::string_view name) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    if (entry_at(i).name == name) return i;
  }
  return entry_count;
}

/// A name as a template argument, so that a mistyped one does not compile.
template <std::size_t length>
struct FixedName {
  char text[length]{};
  consteval FixedName(const char (&literal)[length]) { std::copy_n(literal, length, text); }
  constexpr std::string_view view() const { return {text, length - 1}; }
};

template <FixedName name>
consteval std::size_t entry_of() {
  constexpr std::size_t found = find_entry(name.view());
  static_assert(found < entry_count, "no such name in the object dictionary");
  return found;
}

/// Address of every entry's first register in its table (holding when it can be written through Modbus,
/// input otherwise), axis 0. Entries of one group follow each other without a gap.
inline constexpr auto modbus_addresses = [] {
  std::array<std::uint16_t, entry_count> addresses{};
  for (std::size_t i = 0; i < entry_count; ++i) {
    const std::uint16_t group = entry_at(i).group.index;
    // Back to the one before it in the group, nearly always the next: every file that includes this pays for
    // it.
    std::size_t after = i;
    while (after > 0 && entry_at(after - 1).group.index != group) --after;
    addresses[i] =
        after == 0
            ? entry_at(i).group.modbus_base
            : static_cast<std::uint16_t>(addresses[after - 1] + register_count(entry_at(after - 1).type));
  }
  return addresses;
}();

constexpr std::uint16_t modbus_address(std::size_t entry, std::size_t axis) {
  return static_cast<std::uint16_t>(modbus_addresses[entry] +
                                    (entry_at(entry).scope() == Scope::axis ? axis * axis_modbus_offset : 0));
}

/// Values are kept in one array: each axis', then the device's.
inline constexpr std::size_t slot_count = (axis_count - 1) * axis_entries.size() + entry_count;

constexpr std::size_t slot_of(std::size_t entry, std::size_t axis) {
  return entry < axis_entries.size() ? axis * axis_entries.size() + entry
                                     : entry + (axis_count - 1) * axis_entries.size();
}

struct SlotOwner {
  std::size_t entry;
  std::size_t axis;  ///< 0 for a device entry
};

constexpr SlotOwner owner_of(std::size_t slot) {
  if (slot < axis_count * axis_entries.size())
    return {slot % axis_entries.size(), slot / axis_entries.size()};
  return {slot - (axis_count - 1) * axis_entries.size(), 0};
}

}  // namespace kmax::firmware
