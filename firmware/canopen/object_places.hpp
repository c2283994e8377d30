#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/canopen/cob_id.hpp"
#include "firmware/canopen/object_access.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "firmware/parameter_values.hpp"

namespace kmax::firmware::canopen {

/// Where a value of the dictionary is as an object; in the order of index and sub-index.
struct ObjectPlace {
  std::uint16_t index;
  std::uint8_t subindex;
  std::uint16_t slot;
};

inline constexpr auto object_places = [] {
  std::array<ObjectPlace, slot_count> places{};
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    places[slot] = {
        static_cast<std::uint16_t>(e.index() + (e.scope() == Scope::axis ? axis * axis_index_offset : 0)),
        e.object_subindex(), static_cast<std::uint16_t>(slot)};
  }
  std::sort(places.begin(), places.end(), [](const ObjectPlace& a, const ObjectPlace& b) {
    return a.index != b.index ? a.index < b.index : a.subindex < b.subindex;
  });
  return places;
}();

/// The slot of an object, if it is a value of the dictionary.
constexpr std::optional<std::size_t> slot_at(ObjectAddress address) {
  const auto found = std::lower_bound(
      object_places.begin(), object_places.end(), address, [](const ObjectPlace& p, const ObjectAddress& a) {
        return p.index != a.index ? p.index < a.index : p.subindex < a.subindex;
      });
  if (found == object_places.end() || found->index != address.index || found->subindex != address.subindex)
    return std::nullopt;
  return found->slot;
}

/// A special object without its texts, which stay on the host.
struct SpecialPlace {
  std::uint16_t index;
  std::uint8_t first_subindex, last_subindex;
  SpecialObject what;
  ObjectType type;
  ObjectAccessKind access;
};

inline constexpr auto special_places = [] {
  std::array<SpecialPlace, special_objects.size()> places{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const SpecialObjectRow& row = special_objects[i];
    places[i] = {row.index, row.first_subindex, row.last_subindex, row.what, row.type, row.access};
  }
  return places;
}();

constexpr const SpecialPlace* special_at(ObjectAddress address) {
  for (const SpecialPlace& row : special_places) {
    if (row.index == address.index && row.first_subindex <= address.subindex &&
        address.subindex <= row.last_subindex)
      return &row;
  }
  return nullptr;
}

/// Highest sub-index there is at an index; nothing if there is no such index.
constexpr std::optional<std::uint8_t> highest_subindex(std::uint16_t index) {
  std::optional<std::uint8_t> highest;
  const auto after = std::upper_bound(object_places.begin(), object_places.end(), index,
                                      [](std::uint16_t i, const ObjectPlace& p) { return i < p.index; });
  if (after != object_places.begin() && (after - 1)->index == index) highest = (after - 1)->subindex;
  for (const SpecialPlace& row : special_places) {
    if (row.index == index && (!highest || *highest < row.last_subindex)) highest = row.last_subindex;
  }
  return highest;
}

inline constexpr auto node_relative_entries = [] {
  std::array<bool, entry_count> all{};
  for (std::size_t i = 0; i < entry_count; ++i) all[i] = entry_at(i).node_relative;
  return all;
}();

/// A COB-ID whose default has the node ID added.
constexpr bool node_relative(std::size_t entry) {
  return node_relative_entries[entry];
}

/// The COB-ID that a value means: the predefined ones have the node ID added.
constexpr std::uint32_t resolved_cob_id(std::uint32_t raw, std::uint32_t default_value,
                                        std::uint8_t node_id) {
  const bool predefined = (raw & cob_id::identifier) == (default_value & cob_id::identifier);
  return predefined ? raw + node_id : raw;
}

/// The other way round, for what a host writes.
constexpr std::uint32_t stored_cob_id(std::uint32_t written, std::uint32_t default_value,
                                      std::uint8_t node_id) {
  const bool predefined = (written & cob_id::identifier) == (default_value & cob_id::identifier) + node_id;
  return predefined ? written - node_id : written;
}

}  // namespace kmax::firmware::canopen
