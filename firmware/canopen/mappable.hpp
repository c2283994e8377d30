#pragma once

#include <array>
#include <cstddef>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware::canopen {

/// May a PDO that this device sends hold this entry? Every value but CANopen's own settings.
constexpr bool tpdo_mappable(const Entry& entry) {
  return entry.access != Access::communication;
}

/// May a PDO that this device receives set this entry? What an axis takes at any time. The mode of operation
/// too, although it is refused while the axis is armed: a CiA 402 master has it in its PDO and repeats it.
/// Not excitation.*, which is for calibration and self-test.
constexpr bool rpdo_mappable(const Entry& entry) {
  if (entry.scope() != Scope::axis || entry.access != Access::read_write) return false;
  if (entry.group.index == group::excitation.index) return false;
  return entry.change == Change::any_time || entry.name == "profile.operation_mode";
}

/// The same by entry without the entries' texts, which stay on the host.
struct Mappable {
  bool tpdo, rpdo;
};

inline constexpr auto mappable_entries = [] {
  std::array<Mappable, entry_count> all{};
  for (std::size_t i = 0; i < entry_count; ++i)
    all[i] = {tpdo_mappable(entry_at(i)), rpdo_mappable(entry_at(i))};
  return all;
}();

}  // namespace kmax::firmware::canopen
