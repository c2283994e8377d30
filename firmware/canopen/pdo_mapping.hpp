#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/canopen/abort_code.hpp"
#include "firmware/canopen/mappable.hpp"
#include "firmware/canopen/object_places.hpp"

namespace kmax::firmware::canopen {

/// As this device sees them.
enum class PdoKind : std::uint8_t { receive, transmit };

constexpr std::size_t pdo_count_of(PdoKind kind) {
  return kind == PdoKind::transmit ? tpdo_count : rpdo_count;
}
/// The predefined COB-ID, without the node ID.
constexpr std::uint32_t predefined_cob_id(PdoKind kind, std::size_t pdo) {
  return kind == PdoKind::transmit ? cob_id::tpdo[pdo] : cob_id::rpdo[pdo];
}

inline constexpr std::size_t pdo_bits_max = 64;
inline constexpr std::size_t mapped_max = 8;

/// The slot of a dummy object: its bits are in the PDO and mean nothing.
inline constexpr std::uint16_t dummy_slot = 0xFFFF;
static_assert(slot_count < dummy_slot);

/// An object in a PDO.
struct MappedObject {
  std::uint16_t slot = dummy_slot;
  std::uint8_t bits = 0;
  friend constexpr bool operator==(const MappedObject&, const MappedObject&) = default;
};

/// What is in a PDO, first object first, each with its least significant byte first and without gaps
/// (CiA 301, 7.3.3 "PDO mapping").
struct PdoMapping {
  std::array<MappedObject, mapped_max> objects{};
  std::uint8_t count = 0;
  std::uint8_t bits = 0;

  constexpr std::uint8_t bytes() const { return static_cast<std::uint8_t>((bits + 7) / 8); }
  friend constexpr bool operator==(const PdoMapping&, const PdoMapping&) = default;
};

/// Lengths of the data types 0x0001 to 0x0007, which a received PDO may hold as dummies (CiA 301, "dummy
/// mapping"): BOOLEAN, INTEGER8, 16, 32, UNSIGNED8, 16, 32.
inline constexpr std::array<std::uint8_t, 7> dummy_bits{1, 8, 16, 32, 8, 16, 32};

/// The object that a mapping entry (index x 65536 + sub-index x 256 + bits) names. Aborts: 0602 0000 there is
/// no such index, 0609 0011 no such sub-index, 0604 0041 it cannot be in a PDO of this kind, or has another
/// length.
constexpr Abort find_mapped(PdoKind kind, std::uint32_t raw, MappedObject& object) {
  const ObjectAddress address{static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint8_t>(raw >> 8)};
  const auto bits = static_cast<std::uint8_t>(raw);
  if (address.index >= 1 && address.index <= dummy_bits.size()) {
    if (address.subindex != 0) return Abort::no_subindex;
    if (kind != PdoKind::receive || bits != dummy_bits[address.index - 1U]) return Abort::not_mappable;
    object = {dummy_slot, bits};
    return Abort::none;
  }
  const auto slot = slot_at(address);
  if (!slot) {
    const auto highest = highest_subindex(address.index);
    if (!highest) return Abort::no_object;
    // Sub-index 0 of a record is there, as the number of the others.
    return address.subindex == 0 || special_at(address) != nullptr ? Abort::not_mappable : Abort::no_subindex;
  }
  const std::size_t entry = owner_of(*slot).entry;
  if (!(kind == PdoKind::transmit ? tpdo_mappable(entry) : rpdo_mappable(entry)) ||
      bits != 8 * bytes_of(descriptors[entry].type))
    return Abort::not_mappable;
  object = {static_cast<std::uint16_t>(*slot), bits};
  return Abort::none;
}

/// Where the settings of a PDO are among the dictionary's values.
struct PdoSlots {
  std::uint16_t cob_id, transmission_type;
  std::uint16_t inhibit_time, event_time;    ///< transmit only
  std::uint16_t mapped_count, first_mapped;  ///< the others follow
};

inline constexpr auto pdo_slots = [] {
  std::array<std::array<PdoSlots, tpdo_count>, 2> all{};
  for (std::uint16_t kind = 0; kind < 2; ++kind) {
    for (std::size_t n = 0; n < pdo_count_of(static_cast<PdoKind>(kind)); ++n) {
      const auto at = [&](unsigned index, std::uint8_t subindex) {
        return static_cast<std::uint16_t>(
            slot_at({static_cast<std::uint16_t>(index + 0x400U * kind + n), subindex}).value());
      };
      PdoSlots& slots = all[kind][n];
      slots = {at(0x1400, 1), at(0x1400, 2), 0, 0, at(0x1600, 0), at(0x1600, 1)};
      if (kind == static_cast<std::uint16_t>(PdoKind::transmit))
        slots.inhibit_time = at(0x1400, 3), slots.event_time = at(0x1400, 5);
    }
  }
  return all;
}();

constexpr const PdoSlots& slots_of(PdoKind kind, std::size_t pdo) {
  return pdo_slots[static_cast<std::size_t>(kind)][pdo];
}

/// The mapping of a PDO if it held the first `count` of its entries. Aborts: those of find_mapped() (0602
/// 0000 for an entry that is 0), 0604 0042 more than 8 entries or 64 bits.
constexpr Abort compile_mapping(PdoKind kind, std::size_t pdo, const ParameterValues& values,
                                std::uint32_t count, PdoMapping& mapping) {
  mapping = {};
  if (count > mapped_max) return Abort::pdo_length;
  unsigned bits = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    MappedObject& object = mapping.objects[i];
    const Abort abort = find_mapped(kind, values.raw(slots_of(kind, pdo).first_mapped + i), object);
    if (abort != Abort::none) return abort;
    bits += object.bits;
  }
  if (bits > pdo_bits_max) return Abort::pdo_length;
  mapping.count = static_cast<std::uint8_t>(count);
  mapping.bits = static_cast<std::uint8_t>(bits);
  return Abort::none;
}

}  // namespace kmax::firmware::canopen
