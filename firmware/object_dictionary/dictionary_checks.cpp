// Compile-time checks of the object dictionary, in a file of their own because they compare every entry
// with every other: once per build is enough.
#include "firmware/object_dictionary/dictionary_checks.hpp"

#include <algorithm>

namespace kmax::firmware {
namespace {
constexpr bool names_are_unique() {
  for (std::size_t i = 0; i < entry_count; ++i) {
    for (std::size_t j = i + 1; j < entry_count; ++j) {
      if (entry_at(i).name == entry_at(j).name) return false;
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

/// Bounds that may only be tightened while armed are compared as reals, choices by their numbers; a ceiling
/// must be of the same place and unit, and itself out of reach then.
constexpr bool bounds_can_be_compared() {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    const bool tightens = entry.change != Change::any_time && entry.change != Change::disarmed_only;
    if (tightens && entry.type != Type::float32 && entry.type != Type::unsigned8) return false;
    if (!tightens && (entry.unbounded_at_zero || !entry.ceiling.empty())) return false;
    if (entry.ceiling.empty()) continue;
    const std::size_t at = find_entry(entry.ceiling);
    if (at == entry_count || entry_at(at).change != Change::disarmed_only ||
        entry_at(at).scope() != entry.scope() || entry_at(at).unit != entry.unit ||
        entry_at(at).type != Type::float32)
      return false;
  }
  return true;
}

static_assert(names_are_unique());
static_assert(bounds_can_be_compared());
static_assert(subindices_rise());
static_assert(groups_hold_one_access());
static_assert(defaults_are_allowed());
static_assert(dictionary_checks::places_hold<axis_count>);
}  // namespace

}  // namespace kmax::firmware
