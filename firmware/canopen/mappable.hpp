#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware::canopen {

/// May a PDO that this device sends hold this entry? Every value but CANopen's own settings.
constexpr bool tpdo_mappable(const Entry& entry) {
  return entry.access != Access::communication;
}

/// May a PDO that this device receives set this entry? What an axis takes while it is armed. The mode of
/// operation too, although it is refused while the axis is armed: a CiA 402 master has it in its PDO and
/// repeats it. Not excitation.*, which is for calibration and self-test.
constexpr bool rpdo_mappable(const Entry& entry) {
  if (entry.scope() != Scope::axis || entry.access != Access::read_write) return false;
  if (entry.group.index == group::excitation.index) return false;
  return entry.change != Change::disarmed_only || entry.name == "profile.operation_mode";
}

// The same by the entry's number, without the entries' texts, which stay on the host: a bit for each.

template <bool (*may)(const Entry&)>
inline constexpr auto mappable_bits = [] {
  std::array<std::uint32_t, (entry_count + 31) / 32> bits{};
  for (std::size_t i = 0; i < entry_count; ++i) {
    if (may(entry_at(i))) bits[i / 32] |= 1U << (i % 32);
  }
  return bits;
}();

constexpr bool tpdo_mappable(std::size_t entry) {
  return ((mappable_bits<tpdo_mappable>[entry / 32] >> (entry % 32)) & 1U) != 0;
}
constexpr bool rpdo_mappable(std::size_t entry) {
  return ((mappable_bits<rpdo_mappable>[entry / 32] >> (entry % 32)) & 1U) != 0;
}

}  // namespace kmax::firmware::canopen
