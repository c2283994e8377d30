#pragma once

#include <cstdint>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware {

/// FNV-1a over what host and device must agree on: axes, the tick, and of each entry name, place, type,
/// bounds, choices. Texts may differ. Tools for fewer axes than there are would leave some armed.
inline constexpr std::uint32_t dictionary_checksum = [] {
  std::uint32_t hash = 2166136261u;
  const auto mix = [&hash](std::uint32_t value) {
    for (int byte = 0; byte < 4; ++byte) hash = (hash ^ ((value >> (8 * byte)) & 0xFFu)) * 16777619u;
  };
  mix(axis_count);
  mix(tick_rate_hz);
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
