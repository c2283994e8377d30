#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "firmware/object_dictionary/register_windows.hpp"
#include "firmware/object_dictionary/special_objects.hpp"

/// What must hold of all places in the object dictionary, for any number of axes: functions of that number,
/// so that more can be tried than this firmware is built for. Evaluated when compiled.
namespace kmax::firmware::dictionary_checks {

/// What one value takes of a table or of the object list, both ends included.
struct Place {
  std::uint32_t first = 0, last = 0;
};

/// No two of the first `count` share anything. Sorts them.
template <std::size_t capacity>
constexpr bool apart(std::array<Place, capacity>& places, std::size_t count) {
  std::sort(places.begin(), places.begin() + count,
            [](const Place& a, const Place& b) { return a.first < b.first; });
  for (std::size_t i = 1; i < count; ++i) {
    if (places[i].first <= places[i - 1].last) return false;
  }
  return true;
}

constexpr std::size_t axes_of(const Entry& entry, std::size_t axes) {
  return entry.scope() == Scope::axis ? axes : 1;
}

/// One of the two tables; the windows of memories are in that of the input registers.
template <std::size_t axes>
constexpr bool registers_are_apart(bool holding) {
  std::array<Place, axes * entry_count + 3> places{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    if ((entry.access == Access::read_write) != holding) continue;
    for (std::size_t axis = 0; axis < axes_of(entry, axes); ++axis) {
      const std::uint32_t first = modbus_addresses[i] + static_cast<std::uint32_t>(axis) * axis_modbus_offset;
      places[count++] = {first, first + register_count(entry.type) - 1U};
    }
  }
  if (!holding) {
    places[count++] = {trace_window, trace_window + trace_words_per_record * trace_capacity - 1};
    places[count++] = {capture_window, capture_window + 2 * capture_words - 1};
    places[count++] = {fault_log_window, fault_log_window + fault_log_registers - 1U};
  }
  return apart(places, count) && places[count - 1].last <= 0xFFFF;
}

/// Index and sub-index of every value, of what is no value of the dictionary, and sub-index 0 of every
/// record.
template <std::size_t axes>
constexpr bool objects_are_apart() {
  std::array<Place, 2 * axes * entry_count + 2 * special_objects.size()> places{};
  std::size_t count = 0;
  const auto add = [&](std::uint32_t index, std::uint32_t first_subindex, std::uint32_t last_subindex) {
    places[count++] = {index << 8 | first_subindex, index << 8 | last_subindex};
  };
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    const bool begins_record =
        entry.object_subindex() == 1 && (i == 0 || entry_at(i - 1).index() != entry.index());
    for (std::size_t axis = 0; axis < axes_of(entry, axes); ++axis) {
      const std::uint32_t index = entry.index() + static_cast<std::uint32_t>(axis) * axis_index_offset;
      add(index, entry.object_subindex(), entry.object_subindex());
      if (begins_record) add(index, 0, 0);
    }
  }
  for (const SpecialObjectRow& special : special_objects) {
    add(special.index, special.first_subindex, special.last_subindex);
  }
  return apart(places, count);
}

/// Each entry is in the area that CiA 301 and this device keep for its kind.
template <std::size_t axes>
constexpr bool objects_are_in_their_areas() {
  constexpr std::uint32_t manufacturer = 0x2000, devices_own = 0x5800, profile = 0x6000, end = 0xA000;
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    const std::uint32_t index = entry.index();
    if (entry.scope() == Scope::device) {
      if (index >= manufacturer && (index < devices_own || index >= profile)) return false;
      continue;
    }
    const std::uint32_t base = index < profile ? manufacturer : profile;
    if (index < base || index >= base + axis_index_offset) return false;
    const std::uint32_t highest = index + static_cast<std::uint32_t>(axes - 1) * axis_index_offset;
    if (highest >= (base == manufacturer ? devices_own : end)) return false;
  }
  return true;
}

template <std::size_t axes>
constexpr bool places_hold = registers_are_apart<axes>(true) && registers_are_apart<axes>(false) &&
                             objects_are_apart<axes>() && objects_are_in_their_areas<axes>();

}  // namespace kmax::firmware::dictionary_checks
