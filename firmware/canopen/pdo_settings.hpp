#pragma once

#include <algorithm>
#include <cstdint>

#include "firmware/canopen/pdo_mapping.hpp"

namespace kmax::firmware::canopen {

/// Transmission types (CiA 301, objects 0x1400 and 0x1800): 0 to 240 with SYNC, 254 and 255 without; those
/// between are reserved or for remote requests, which this device does not answer.
inline constexpr std::uint32_t highest_synchronous_type = 240;
inline constexpr std::uint32_t lowest_event_type = 254;

/// Nothing that goes by time goes more often: four PDOs then take about half of the bus.
constexpr std::uint32_t least_period_us(std::uint32_t bit_rate) {
  return std::max<std::uint32_t>(1000, 1'000'000'000U / std::max<std::uint32_t>(bit_rate, 1000));
}

constexpr bool transmission_type_allowed(std::uint32_t type) {
  return type <= highest_synchronous_type || (type >= lowest_event_type && type <= 255);
}

/// The settings of one PDO, read and checked once so that a frame costs little.
struct PdoSettings {
  bool exists = false;
  std::uint16_t identifier = 0;
  std::uint8_t transmission_type = 255;
  std::uint32_t inhibit_us = 0;  ///< transmit only
  std::uint32_t event_us = 0;    ///< transmit only; 0: by change
  PdoMapping mapping{};

  constexpr bool synchronous() const { return transmission_type <= highest_synchronous_type; }
  friend constexpr bool operator==(const PdoSettings&, const PdoSettings&) = default;
};

/// A PDO's settings from the dictionary. False if they break the rules, as stored parameters of another
/// version may: the PDO is then not there.
constexpr bool read_pdo(PdoKind kind, std::size_t pdo, const ParameterValues& values, std::uint8_t node_id,
                        PdoSettings& settings) {
  settings = {};
  const PdoSlots& slots = slots_of(kind, pdo);
  const std::uint32_t id = resolved_cob_id(values.raw(slots.cob_id), predefined_cob_id(kind, pdo), node_id);
  if ((id & cob_id::invalid) != 0) return true;
  const std::uint32_t type = values.raw(slots.transmission_type);
  PdoMapping mapping;
  if ((id & ~(cob_id::no_remote | cob_id::identifier)) != 0 || cob_id::restricted(id & cob_id::identifier) ||
      !transmission_type_allowed(type) ||
      compile_mapping(kind, pdo, values, values.raw(slots.mapped_count), mapping) != Abort::none ||
      mapping.count == 0)
    return false;
  settings = {.exists = true,
              .identifier = static_cast<std::uint16_t>(id & cob_id::identifier),
              .transmission_type = static_cast<std::uint8_t>(type),
              .mapping = mapping};
  if (kind == PdoKind::transmit) {
    settings.inhibit_us = (values.raw(slots.inhibit_time) & 0xFFFF) * 100;
    settings.event_us = (values.raw(slots.event_time) & 0xFFFF) * 1000;
  }
  return true;
}

}  // namespace kmax::firmware::canopen
