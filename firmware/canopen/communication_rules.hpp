#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/canopen/heartbeat_consumer.hpp"
#include "firmware/canopen/pdo_settings.hpp"
#include "firmware/canopen/sync.hpp"

// What CiA 301 (7.5.2) asks of a value before it becomes a setting of CANopen. The order it asks for, for a
// PDO: set bit 31 of the COB-ID; set the number of mapped objects to 0; set the objects; set their number;
// clear bit 31.
//
// 0609 0030  the value is never allowed there
// 0800 0022  it would be allowed, but not now: the PDO, the emergency message or the SDO server exists, the
//            device makes SYNC, or the number of mapped objects is not 0. (CiA 301 says that it must not be,
//            without an abort code.)
// 0604 0043  the identifier is that of a PDO of the other kind, or of the SDO server's other direction: this
//            device would send what it listens to
// others     see find_mapped() and compile_mapping(); HeartbeatConsumer::check()
//
// Where CiA 301 leaves it open:
//   - a COB-ID with bit 31 set may hold any 11-bit identifier, and may be written at any time: nothing uses
//   it
//   - bit 30 of a PDO's COB-ID is free: remote requests are never answered, as most masters write it as 0
//   - a PDO without a mapped object cannot be made to exist (0609 0030)
//   - an identifier equal to a predefined one without its node ID (0x280 for TPDO 2) is refused, since it
//     stands for the predefined one in the stored values; it belongs to no node
//   - the number of mapped objects may change from one to another without being 0 between
//   - a time, or the SYNC counter's overflow, that is written as it is, is not a change
//   - the identifiers of the second SDO server are fixed ones: bit 30 is refused
//
// Cost: constant; at most 8 searches of the object list. Device (main loop) and host.

namespace kmax::firmware::canopen {

enum class CommunicationRule : std::uint8_t {
  bounds,
  sync_cob_id,
  emergency_cob_id,
  heartbeat_consumer,
  pdo_cob_id,
  transmission_type,
  inhibit_time,
  mapped_count,
  mapped_object,
  sync_period,
  sync_counter,
  sdo_cob_id,
};

struct CommunicationRow {
  CommunicationRule rule = CommunicationRule::bounds;
  PdoKind kind : 1 = PdoKind::receive;
  std::uint8_t number : 7 = 0;   ///< PDO or heartbeat consumer, from 0
  std::uint16_t predefined = 0;  ///< COB-ID without the node ID
};

inline constexpr auto communication_rows = [] {
  std::array<CommunicationRow, communication_entries.size()> rows{};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Entry& entry = communication_entries[i];
    const std::uint16_t index = entry.index();
    const std::uint8_t subindex = entry.object_subindex();
    CommunicationRow& row = rows[i];
    if (index == 0x1005) row.rule = CommunicationRule::sync_cob_id;
    if (index == 0x1014) {
      row.rule = CommunicationRule::emergency_cob_id;
      row.predefined = cob_id::emergency;
    }
    if (index == 0x1016) {
      row.rule = CommunicationRule::heartbeat_consumer;
      row.number = (subindex - 1U) & 0x7FU;
    }
    if (index == 0x1006) row.rule = CommunicationRule::sync_period;
    if (index == 0x1019) row.rule = CommunicationRule::sync_counter;
    if (index == 0x1201) {
      row.rule = CommunicationRule::sdo_cob_id;
      row.number = (subindex - 1U) & 0x7FU;
    }
    if (index < 0x1400 || index >= 0x1C00) continue;
    row.kind = index >= 0x1800 ? PdoKind::transmit : PdoKind::receive;
    row.number = index & 0x7FU;
    if ((index & 0x200) != 0) {
      row.rule = subindex == 0 ? CommunicationRule::mapped_count : CommunicationRule::mapped_object;
    } else if (subindex == 1) {
      row.rule = CommunicationRule::pdo_cob_id;
      row.predefined = static_cast<std::uint16_t>(predefined_cob_id(row.kind, row.number));
    } else if (subindex == 2) {
      row.rule = CommunicationRule::transmission_type;
    } else if (subindex == 3) {
      row.rule = CommunicationRule::inhibit_time;
    }
  }
  return rows;
}();

constexpr bool is_communication(std::size_t slot) {
  return slot >= first_communication_slot && slot < slot_count;
}

/// What is kept for a value that a host writes, and what a host reads for what is kept: a predefined COB-ID
/// is kept without the node ID, so that it follows it. Any other value is kept as it is.
constexpr std::uint32_t stored_communication(std::size_t slot, std::uint32_t written, std::uint8_t node_id) {
  const CommunicationRow& row = communication_rows[slot - first_communication_slot];
  return row.predefined != 0 ? stored_cob_id(written, row.predefined, node_id) : written;
}
constexpr std::uint32_t shown_communication(std::size_t slot, std::uint32_t raw, std::uint8_t node_id) {
  const CommunicationRow& row = communication_rows[slot - first_communication_slot];
  return row.predefined != 0 ? resolved_cob_id(raw, row.predefined, node_id) : raw;
}

/// A PDO of this kind exists with this identifier.
constexpr bool any_pdo_at(PdoKind kind, std::uint32_t identifier, const ParameterValues& now,
                          std::uint8_t node_id) {
  for (std::size_t i = 0; i < pdo_count_of(kind); ++i) {
    const std::uint32_t present =
        resolved_cob_id(now.raw(slots_of(kind, i).cob_id), predefined_cob_id(kind, i), node_id);
    if ((present & (cob_id::invalid | cob_id::identifier)) == identifier) return true;
  }
  return false;
}

/// May this entry of Access::communication be set to `written` (a COB-ID: with the node ID) while the values
/// are `now`? It checks the entry's bounds too. Other entries: 0601 0000.
constexpr Abort check_communication(const ParameterValues& now, std::size_t slot, std::uint32_t written,
                                    std::uint8_t node_id) {
  if (!is_communication(slot)) return Abort::unsupported_access;
  const CommunicationRow& row = communication_rows[slot - first_communication_slot];
  const PdoSlots& pdo = slots_of(row.kind, row.number % pdo_count_of(row.kind));
  const bool exists = (now.raw(pdo.cob_id) & cob_id::invalid) == 0;
  const bool in_bounds = written <= descriptors[owner_of(slot).entry].maximum();

  switch (row.rule) {
    case CommunicationRule::bounds:
      return in_bounds ? Abort::none : Abort::value_range;

    case CommunicationRule::sync_cob_id:
      return Sync::check(written, now.raw(slot));

    case CommunicationRule::sync_period:
      return in_bounds && (written == 0 || written >= Sync::least_us) ? Abort::none : Abort::value_range;

    case CommunicationRule::sync_counter:
      if (!in_bounds || written == 1) return Abort::value_range;
      return now.whole<"canopen.sync_period">() != 0 && written != now.raw(slot) ? Abort::device_state
                                                                                 : Abort::none;

    case CommunicationRule::sdo_cob_id: {
      const std::uint32_t identifier = written & cob_id::identifier, present = now.raw(slot);
      if ((written & ~(cob_id::invalid | cob_id::identifier)) != 0) return Abort::value_range;
      if ((written & cob_id::invalid) != 0) return Abort::none;
      if (cob_id::restricted(identifier)) return Abort::value_range;
      if ((present & cob_id::invalid) == 0 && present != written) return Abort::device_state;
      return now.raw(row.number == 0 ? slot + 1 : slot - 1) == written ? Abort::incompatible : Abort::none;
    }

    case CommunicationRule::heartbeat_consumer: {
      std::array<std::uint32_t, watched_node_count> entries{};
      for (std::size_t i = 0; i < entries.size(); ++i) entries[i] = now.raw(slot - row.number + i);
      return HeartbeatConsumer::check(row.number, written, entries);
    }

    case CommunicationRule::emergency_cob_id:
    case CommunicationRule::pdo_cob_id: {
      const bool is_pdo = row.rule == CommunicationRule::pdo_cob_id;
      const std::uint32_t flags = cob_id::invalid | (is_pdo ? cob_id::no_remote : 0U);
      const std::uint32_t identifier = written & cob_id::identifier;
      if ((written & ~(flags | cob_id::identifier)) != 0 || identifier == row.predefined)
        return Abort::value_range;
      if ((written & cob_id::invalid) != 0) return Abort::none;
      if (cob_id::restricted(identifier)) return Abort::value_range;
      const std::uint32_t present = resolved_cob_id(now.raw(slot), row.predefined, node_id);
      if ((present & cob_id::invalid) == 0)
        return (present & cob_id::identifier) == identifier ? Abort::none : Abort::device_state;
      if (!is_pdo) return Abort::none;
      const PdoKind other = row.kind == PdoKind::transmit ? PdoKind::receive : PdoKind::transmit;
      if (any_pdo_at(other, identifier, now, node_id)) return Abort::incompatible;
      PdoMapping mapping;
      const Abort abort = compile_mapping(row.kind, row.number, now, now.raw(pdo.mapped_count), mapping);
      return abort == Abort::none && mapping.count == 0 ? Abort::value_range : abort;
    }

    case CommunicationRule::transmission_type:
      return transmission_type_allowed(written) ? Abort::none : Abort::value_range;

    case CommunicationRule::inhibit_time:
      if (!in_bounds) return Abort::value_range;
      return exists && written != now.raw(slot) ? Abort::device_state : Abort::none;

    case CommunicationRule::mapped_count: {
      if (exists) return Abort::device_state;
      PdoMapping mapping;
      return compile_mapping(row.kind, row.number, now, written, mapping);
    }

    case CommunicationRule::mapped_object: {
      if (exists || now.raw(pdo.mapped_count) != 0) return Abort::device_state;
      MappedObject object;
      return written == 0 ? Abort::none : find_mapped(row.kind, written, object);
    }
  }
  return Abort::general;
}

}  // namespace kmax::firmware::canopen
