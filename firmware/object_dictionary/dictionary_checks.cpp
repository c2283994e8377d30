// Compile-time checks of the object dictionary, in a file of their own because they compare every entry
// with every other: once per build is enough.
#include <algorithm>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware {
namespace {
constexpr bool names_and_places_are_unique() {
  for (std::size_t i = 0; i < entry_count; ++i) {
    for (std::size_t j = i + 1; j < entry_count; ++j) {
      const Entry &a = entry_at(i), &b = entry_at(j);
      if (a.name == b.name) return false;
      if (a.index() == b.index() && a.object_subindex() == b.object_subindex()) return false;
    }
  }
  return true;
}

constexpr bool subindices_rise() {
  for (std::size_t i = 0; i < entry_count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (entry_at(j).group.index == entry_at(i).group.index && entry_at(j).subindex >= entry_at(i).subindex)
        return false;
    }
  }
  return true;
}

constexpr bool registers_do_not_overlap() {
  for (std::size_t i = 0; i < slot_count; ++i) {
    const auto a = owner_of(i);
    for (std::size_t j = i + 1; j < slot_count; ++j) {
      const auto b = owner_of(j);
      const bool a_held = entry_at(a.entry).access == Access::read_write;
      if (a_held != (entry_at(b.entry).access == Access::read_write)) continue;
      const int first = modbus_address(a.entry, a.axis), second = modbus_address(b.entry, b.axis);
      if (first < second + words_of(entry_at(b.entry).type) &&
          second < first + words_of(entry_at(a.entry).type))
        return false;
    }
  }
  return true;
}

constexpr bool groups_hold_one_access() {
  for (std::size_t i = 0; i < entry_count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (entry_at(i).group.index == entry_at(j).group.index && entry_at(i).access != entry_at(j).access)
        return false;
    }
  }
  return true;
}

constexpr bool defaults_are_allowed() {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    if (!(entry.minimum <= entry.default_value && entry.default_value <= entry.maximum)) return false;
    if (entry.values.empty()) continue;
    if (std::none_of(entry.values.begin(), entry.values.end(), [&](const NamedValue& v) {
          return static_cast<double>(v.value) == entry.default_value;
        }))
      return false;
  }
  return true;
}

static_assert(names_and_places_are_unique());
static_assert(subindices_rise());
static_assert(groups_hold_one_access());
static_assert(defaults_are_allowed());
static_assert(registers_do_not_overlap());
}  // namespace

}  // namespace kmax::firmware
