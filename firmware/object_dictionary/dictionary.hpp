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

inline constexpr std::size_t axis_count = 2;
inline constexpr std::uint32_t tick_rate_hz = 20000;

/// Axis 1 is axis 0 plus this (CiA 402's convention for several axes, and its Modbus counterpart).
inline constexpr std::uint16_t axis_index_offset = 0x800;
inline constexpr std::uint16_t axis_modbus_offset = 0x400;

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
    const Entry& entry = entry_at(i);
    std::uint16_t address = entry.group.modbus_base;
    for (std::size_t j = 0; j < i; ++j) {
      if (entry_at(j).group.index == entry.group.index)
        address = static_cast<std::uint16_t>(address + words_of(entry_at(j).type));
    }
    addresses[i] = address;
  }
  return addresses;
}();

constexpr std::uint16_t modbus_address(std::size_t entry, std::size_t axis) {
  return static_cast<std::uint16_t>(modbus_addresses[entry] +
                                    (entry_at(entry).scope() == Scope::axis ? axis * axis_modbus_offset : 0));
}

/// Values are kept in one array: axis 0's, axis 1's, the device's.
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

/// FNV-1a over what host and device must agree on: name, place, type, bounds, choices. Texts may differ.
inline constexpr std::uint32_t dictionary_checksum = [] {
  std::uint32_t hash = 2166136261u;
  const auto mix = [&hash](std::uint32_t value) {
    for (int byte = 0; byte < 4; ++byte) hash = (hash ^ ((value >> (8 * byte)) & 0xFFu)) * 16777619u;
  };
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    for (const char c : entry.name) mix(static_cast<std::uint32_t>(c));
    mix(modbus_addresses[i]);
    mix(entry.index());
    mix(entry.object_subindex());
    mix(static_cast<std::uint32_t>(entry.type));
    mix(static_cast<std::uint32_t>(entry.access));
    mix(raw_from_number(entry.type, entry.minimum));
    mix(raw_from_number(entry.type, entry.maximum));
    for (const NamedValue& choice : entry.values) {
      for (const char c : choice.name) mix(static_cast<std::uint32_t>(c));
      mix(static_cast<std::uint32_t>(choice.value));
    }
  }
  return hash;
}();

}  // namespace kmax::firmware
