#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <optional>

#include "firmware/canopen/object_access.hpp"
#include "firmware/object_dictionary/cob_id.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware::canopen {

/// The entries in the order of index and sub-index of axis 0 or of the device.
inline constexpr auto entries_by_object = [] {
  std::array<std::uint16_t, entry_count> entries{};
  std::iota(entries.begin(), entries.end(), std::uint16_t{0});
  std::sort(entries.begin(), entries.end(), [](std::size_t a, std::size_t b) {
    const SlotDescriptor &of_a = descriptors[a], &of_b = descriptors[b];
    return of_a.index != of_b.index ? of_a.index < of_b.index : of_a.subindex < of_b.subindex;
  });
  return entries;
}();

/// An entry and the axis whose it is.
struct ObjectOwner {
  std::size_t entry, axis;
};

/// The last value of the dictionary that is at this index, and at this sub-index or a lower one.
constexpr std::optional<ObjectOwner> last_at_or_before(ObjectAddress address) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const std::size_t offset = axis * axis_index_offset;
    if (address.index < offset) break;
    const std::size_t index = address.index - offset;
    const auto after = std::upper_bound(entries_by_object.begin(), entries_by_object.end(), address.subindex,
                                        [&](std::size_t s, std::size_t e) {
                                          return index != descriptors[e].index ? index < descriptors[e].index
                                                                               : s < descriptors[e].subindex;
                                        });
    if (after == entries_by_object.begin()) continue;
    const std::size_t entry = *(after - 1);
    if (descriptors[entry].index == index && (axis == 0 || descriptors[entry].per_axis))
      return {{entry, axis}};
  }
  return std::nullopt;
}

/// The slot of an object, if it is a value of the dictionary.
constexpr std::optional<std::size_t> slot_at(ObjectAddress address) {
  const auto owner = last_at_or_before(address);
  if (!owner || descriptors[owner->entry].subindex != address.subindex) return std::nullopt;
  return slot_of(owner->entry, owner->axis);
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
  if (const auto last = last_at_or_before({index, 0xFF})) highest = descriptors[last->entry].subindex;
  for (const SpecialPlace& row : special_places) {
    if (row.index == index && (!highest || *highest < row.last_subindex)) highest = row.last_subindex;
  }
  return highest;
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
