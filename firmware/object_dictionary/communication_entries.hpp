#pragma once

#include <algorithm>
#include <array>
#include <iterator>

#include "firmware/object_dictionary/cob_id.hpp"
#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// CANopen's own settings (CiA 301): which messages there are, what is in them and when they go. All of them
/// are kept by save.
namespace group {
inline constexpr Group communication{"canopen", 0x581D, Scope::device, 0x2800};
inline constexpr Group heartbeat_consumer{"heartbeat_consumer", 0x1016, Scope::device, 0x2820};
inline constexpr Group sdo_server_2{"sdo_server_2", 0x1201, Scope::device, 0x2840};
}  // namespace group

constexpr Entry communication(std::string_view name, Group group, std::uint8_t subindex, Type type,
                              std::string_view unit, double maximum, double default_value,
                              std::string_view help) {
  return whole(name, group, subindex, type, unit, 0, maximum, default_value, help).of_communication();
}

/// A COB-ID: its default is the predefined one, to which the node ID is added when it is used or read.
constexpr Entry cob_id(std::string_view name, Group group, std::uint8_t subindex, std::uint32_t default_value,
                       std::string_view help) {
  return communication(name, group, subindex, Type::unsigned32, "", 4294967295.0, default_value, help)
      .plus_node_id();
}

/// An object as a PDO's mapping names it.
constexpr std::uint32_t mapping_of(std::uint16_t index, std::uint8_t subindex, unsigned bits) {
  return std::uint32_t{index} << 16 | std::uint32_t{subindex} << 8 | bits;
}

/// The PDOs from the factory: of each the objects in it, first receive, then transmit. Those that this device
/// receives exist if there is something in them.
inline constexpr std::uint32_t factory_mappings[2][canopen::tpdo_count][4] = {
    {{mapping_of(0x6040, 0, 16), mapping_of(0x6071, 0, 16)},
     {mapping_of(0x6840, 0, 16), mapping_of(0x6871, 0, 16)}},
    {{mapping_of(0x6064, 0, 32), mapping_of(0x2012, 4, 32)},
     {mapping_of(0x6864, 0, 32), mapping_of(0x2812, 4, 32)},
     {mapping_of(0x2012, 3, 32), mapping_of(0x2812, 3, 32)},
     {mapping_of(0x2019, 1, 16), mapping_of(0x2819, 1, 16), mapping_of(0x581C, 1, 16),
      mapping_of(0x581C, 2, 16)},
     {mapping_of(0x6041, 0, 16), mapping_of(0x6061, 0, 8), mapping_of(0x6841, 0, 16),
      mapping_of(0x6861, 0, 8)}}};

/// The PDO that has the states of the axes goes when they change, and is held back for so long (100 us) that
/// states which flicker leave a slow bus half free too.
inline constexpr std::size_t states_pdo = 4;
inline constexpr std::uint16_t states_inhibit_time = 200;

/// The values of a PDO, by the ends of their names. Only those that are sent have times.
inline constexpr std::array<std::string_view, 13> pdo_values = {
    "cob_id",   "transmission_type", "inhibit_time", "event_time", "mapped_count", "mapped_1", "mapped_2",
    "mapped_3", "mapped_4",          "mapped_5",     "mapped_6",   "mapped_7",     "mapped_8"};

/// They are counted from RPDO 1 on.
inline constexpr std::size_t pdos_of_both_kinds = canopen::rpdo_count + canopen::tpdo_count;
constexpr bool is_sent(std::size_t pdo) {
  return pdo >= canopen::rpdo_count;
}
constexpr std::size_t number_of_pdo(std::size_t pdo) {
  return is_sent(pdo) ? pdo - canopen::rpdo_count : pdo;
}

/// "rpdo1.cob_id", ...
inline constexpr auto pdo_names = [] {
  std::array<std::array<char, 24>, pdos_of_both_kinds * pdo_values.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::size_t pdo = i / pdo_values.size();
    constexpr std::string_view pattern = "?pdo?.";
    char* const behind = std::copy(pattern.begin(), pattern.end(), names[i].begin());
    names[i][0] = is_sent(pdo) ? 't' : 'r';
    names[i][4] = static_cast<char>('1' + number_of_pdo(pdo));
    std::copy(pdo_values[i % pdo_values.size()].begin(), pdo_values[i % pdo_values.size()].end(), behind);
  }
  return names;
}();

constexpr Entry pdo_value(std::size_t pdo, std::size_t value) {
  const std::size_t number = number_of_pdo(pdo);
  const bool sent = is_sent(pdo);
  const bool of_states = sent && number == states_pdo;
  const std::string_view name(pdo_names[pdo * pdo_values.size() + value].data());
  const auto group = [&](bool mapping) {
    const auto index = static_cast<std::uint16_t>((sent ? 0x1800 : 0x1400) + (mapping ? 0x200 : 0) + number);
    const auto base =
        static_cast<std::uint16_t>((sent ? 0x2B00 : 0x2900) + 0x40 * number + (mapping ? 0x10 : 0));
    return Group{name.substr(0, 5), index, Scope::device, base};
  };
  const auto& objects = factory_mappings[sent ? 1 : 0][number];
  switch (value) {
    case 0:
      return cob_id(name, group(false), 1,
                    sent              ? canopen::cob_id::tpdo[number] | canopen::cob_id::no_remote
                    : objects[0] != 0 ? canopen::cob_id::rpdo[number]
                                      : canopen::cob_id::rpdo[number] | canopen::cob_id::invalid,
                    "Identifier; bit 31: this PDO does not exist.");
    case 1:
      return communication(name, group(false), 2, Type::unsigned8, "", 255, 255,
                           sent ? "0: at a SYNC if something has changed; 1 to 240: at every nth SYNC; 254, "
                                  "255: by the event time, or at a change if that is 0."
                                : "0 to 240: taken over at the next SYNC; 254, 255: at once.");
    case 2:
      return communication(name, group(false), 3, Type::unsigned16, "100 us", 65535,
                           of_states ? states_inhibit_time : 0, "Least time between two of them.");
    case 3:
      return communication(
          name, group(false), 5, Type::unsigned16, "ms", 65535, of_states ? 0 : 10,
          "Time between two of them, at least 1 ms x 1 Mbit/s / can.bit_rate; 0: sent at a change.");
    case 4:
      return communication(
          name, group(true), 0, Type::unsigned8, "", 8,
          static_cast<double>(std::size(objects) - std::count(std::begin(objects), std::end(objects), 0U)),
          "Objects in the PDO.");
    default:
      return communication(name, group(true), static_cast<std::uint8_t>(value - 4), Type::unsigned32, "",
                           4294967295.0, value - 5 < std::size(objects) ? objects[value - 5] : 0U,
                           "Object in the PDO: index x 65536 + sub-index x 256 + bits.");
  }
}

/// What a PDO tells this device stays as it was when an axis was armed: its commander's targets go by it.
constexpr Entry pdo_entry(std::size_t pdo, std::size_t value) {
  const Entry entry = pdo_value(pdo, value);
  return is_sent(pdo) ? entry : entry.disarmed_only();
}

inline constexpr std::array node_entries = std::to_array<Entry>({
    communication("canopen.sync_cob_id", group::communication, 1, Type::unsigned32, "", 4294967295.0,
                  canopen::cob_id::sync,
                  "Identifier of SYNC; bit 30: this device makes it, every canopen.sync_period.")
        .disarmed_only()
        .at_standard_index(0x1005),
    cob_id("canopen.emergency_cob_id", group::communication, 2, canopen::cob_id::emergency,
           "Identifier of the emergency message; bit 31: none is sent.")
        .at_standard_index(0x1014),
    communication("canopen.emergency_inhibit_time", group::communication, 3, Type::unsigned16, "100 us",
                  65535, 0, "Least time between two emergency messages.")
        .at_standard_index(0x1015),
    communication("canopen.heartbeat_time", group::communication, 4, Type::unsigned16, "ms", 65535, 0,
                  "Time between two heartbeats; 0: none are sent.")
        .at_standard_index(0x1017),
    communication(
        "canopen.error_behaviour", group::communication, 5, Type::unsigned8, "", 2, 0,
        "NMT state after bus-off or the loss of a watched heartbeat: 0 pre-operational (from operational), 1 "
        "as it was, 2 stopped. An axis that was armed over CAN loses its force in any case.")
        .at_standard_index(0x1029, 1),
    communication(
        "canopen.sync_period", group::communication, 6, Type::unsigned32, "us", 2147483647.0, 0,
        "Time between two SYNCs that this device makes, 1000 us or more and at least 1 ms x 1 Mbit/s / "
        "can.bit_rate; 0: it makes none.")
        .disarmed_only()
        .at_standard_index(0x1006),
    communication(
        "canopen.sync_counter_overflow", group::communication, 7, Type::unsigned8, "", 240, 0,
        "2 to 240: SYNC has a counter from 1 to this; 0: none. Changes while canopen.sync_period is 0.")
        .disarmed_only()
        .at_standard_index(0x1019),

    communication("heartbeat_consumer.node_1", group::heartbeat_consumer, 1, Type::unsigned32, "", 8388607, 0,
                  "Node whose heartbeat is watched: node ID x 65536 + time in ms; 0: none.")
        .disarmed_only(),
    communication("heartbeat_consumer.node_2", group::heartbeat_consumer, 2, Type::unsigned32, "", 8388607, 0,
                  "Node whose heartbeat is watched: node ID x 65536 + time in ms; 0: none.")
        .disarmed_only(),
    communication("heartbeat_consumer.node_3", group::heartbeat_consumer, 3, Type::unsigned32, "", 8388607, 0,
                  "Node whose heartbeat is watched: node ID x 65536 + time in ms; 0: none.")
        .disarmed_only(),
    communication("heartbeat_consumer.node_4", group::heartbeat_consumer, 4, Type::unsigned32, "", 8388607, 0,
                  "Node whose heartbeat is watched: node ID x 65536 + time in ms; 0: none.")
        .disarmed_only(),

    communication(
        "sdo_server_2.request_cob_id", group::sdo_server_2, 1, Type::unsigned32, "", 4294967295.0,
        canopen::cob_id::invalid,
        "Identifier by which a second host asks; bit 31, here or in the answer's: there is no second server.")
        .disarmed_only(),
    communication("sdo_server_2.response_cob_id", group::sdo_server_2, 2, Type::unsigned32, "", 4294967295.0,
                  canopen::cob_id::invalid, "Identifier of the answers to it.")
        .disarmed_only(),
});

inline constexpr auto communication_entries = [] {
  constexpr std::size_t received = canopen::rpdo_count * (pdo_values.size() - 2);
  std::array<Entry, node_entries.size() + received + canopen::tpdo_count * pdo_values.size()> all{};
  auto next = std::copy(node_entries.begin(), node_entries.end(), all.begin());
  for (std::size_t pdo = 0; pdo < pdos_of_both_kinds; ++pdo) {
    for (std::size_t value = 0; value < pdo_values.size(); ++value) {
      const bool only_of_sent = value == 2 || value == 3;
      if (is_sent(pdo) || !only_of_sent) *next++ = pdo_entry(pdo, value);
    }
  }
  return all;
}();

}  // namespace kmax::firmware
