#pragma once

#include <array>

#include "firmware/canopen/cob_id.hpp"
#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// CANopen's own settings (CiA 301): which messages there are, what is in them and when they go. All of them
/// are kept by save.
namespace group {
inline constexpr Group communication{"canopen", 0x581D, Scope::device, 0x2800};
inline constexpr Group heartbeat_consumer{"heartbeat_consumer", 0x1016, Scope::device, 0x2820};
inline constexpr Group rpdo1{"rpdo1", 0x1400, Scope::device, 0x2900};
inline constexpr Group rpdo1_mapping{"rpdo1", 0x1600, Scope::device, 0x2910};
inline constexpr Group rpdo2{"rpdo2", 0x1401, Scope::device, 0x2940};
inline constexpr Group rpdo2_mapping{"rpdo2", 0x1601, Scope::device, 0x2950};
inline constexpr Group rpdo3{"rpdo3", 0x1402, Scope::device, 0x2980};
inline constexpr Group rpdo3_mapping{"rpdo3", 0x1602, Scope::device, 0x2990};
inline constexpr Group rpdo4{"rpdo4", 0x1403, Scope::device, 0x29C0};
inline constexpr Group rpdo4_mapping{"rpdo4", 0x1603, Scope::device, 0x29D0};
inline constexpr Group tpdo1{"tpdo1", 0x1800, Scope::device, 0x2B00};
inline constexpr Group tpdo1_mapping{"tpdo1", 0x1A00, Scope::device, 0x2B10};
inline constexpr Group tpdo2{"tpdo2", 0x1801, Scope::device, 0x2B40};
inline constexpr Group tpdo2_mapping{"tpdo2", 0x1A01, Scope::device, 0x2B50};
inline constexpr Group tpdo3{"tpdo3", 0x1802, Scope::device, 0x2B80};
inline constexpr Group tpdo3_mapping{"tpdo3", 0x1A02, Scope::device, 0x2B90};
inline constexpr Group tpdo4{"tpdo4", 0x1803, Scope::device, 0x2BC0};
inline constexpr Group tpdo4_mapping{"tpdo4", 0x1A03, Scope::device, 0x2BD0};
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

constexpr Entry mapped(std::string_view name, Group group, std::uint8_t subindex,
                       std::uint32_t default_value) {
  return communication(name, group, subindex, Type::unsigned32, "", 4294967295.0, default_value,
                       "Object in the PDO: index x 65536 + sub-index x 256 + bits.");
}

/// An object as a PDO's mapping names it.
constexpr std::uint32_t mapping_of(std::uint16_t index, std::uint8_t subindex, unsigned bits) {
  return std::uint32_t{index} << 16 | std::uint32_t{subindex} << 8 | bits;
}

inline constexpr std::array communication_entries = std::to_array<Entry>({
    communication("canopen.sync_cob_id", group::communication, 1, Type::unsigned32, "", 4294967295.0,
                  canopen::cob_id::sync, "Identifier of SYNC.")
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
        "NMT state after bus-off or the loss of a watched heartbeat: 0 pre-operational (from operational), "
        "1 as it was, 2 stopped. An axis that was armed over CAN loses its force in any case.")
        .at_standard_index(0x1029, 1),

    communication("heartbeat_consumer.node_1", group::heartbeat_consumer, 1, Type::unsigned32, "", 8388607, 0,
                  "Node whose heartbeat is watched: node ID x 65536 + time in ms; 0: none."),
    communication("heartbeat_consumer.node_2", group::heartbeat_consumer, 2, Type::unsigned32, "", 8388607, 0,
                  "Node whose heartbeat is watched: node ID x 65536 + time in ms; 0: none."),
    communication("heartbeat_consumer.node_3", group::heartbeat_consumer, 3, Type::unsigned32, "", 8388607, 0,
                  "Node whose heartbeat is watched: node ID x 65536 + time in ms; 0: none."),
    communication("heartbeat_consumer.node_4", group::heartbeat_consumer, 4, Type::unsigned32, "", 8388607, 0,
                  "Node whose heartbeat is watched: node ID x 65536 + time in ms; 0: none."),

    cob_id("rpdo1.cob_id", group::rpdo1, 1, canopen::cob_id::rpdo[0],
           "Identifier; bit 31: this PDO does not exist."),
    communication("rpdo1.transmission_type", group::rpdo1, 2, Type::unsigned8, "", 255, 255,
                  "0 to 240: taken over at the next SYNC; 254, 255: at once."),
    communication("rpdo1.mapped_count", group::rpdo1_mapping, 0, Type::unsigned8, "", 8, 2,
                  "Objects in the PDO."),
    mapped("rpdo1.mapped_1", group::rpdo1_mapping, 1, mapping_of(0x6040, 0, 16)),
    mapped("rpdo1.mapped_2", group::rpdo1_mapping, 2, mapping_of(0x6071, 0, 16)),
    mapped("rpdo1.mapped_3", group::rpdo1_mapping, 3, 0),
    mapped("rpdo1.mapped_4", group::rpdo1_mapping, 4, 0),
    mapped("rpdo1.mapped_5", group::rpdo1_mapping, 5, 0),
    mapped("rpdo1.mapped_6", group::rpdo1_mapping, 6, 0),
    mapped("rpdo1.mapped_7", group::rpdo1_mapping, 7, 0),
    mapped("rpdo1.mapped_8", group::rpdo1_mapping, 8, 0),

    cob_id("rpdo2.cob_id", group::rpdo2, 1, canopen::cob_id::rpdo[1],
           "Identifier; bit 31: this PDO does not exist."),
    communication("rpdo2.transmission_type", group::rpdo2, 2, Type::unsigned8, "", 255, 255,
                  "0 to 240: taken over at the next SYNC; 254, 255: at once."),
    communication("rpdo2.mapped_count", group::rpdo2_mapping, 0, Type::unsigned8, "", 8, 2,
                  "Objects in the PDO."),
    mapped("rpdo2.mapped_1", group::rpdo2_mapping, 1, mapping_of(0x6840, 0, 16)),
    mapped("rpdo2.mapped_2", group::rpdo2_mapping, 2, mapping_of(0x6871, 0, 16)),
    mapped("rpdo2.mapped_3", group::rpdo2_mapping, 3, 0),
    mapped("rpdo2.mapped_4", group::rpdo2_mapping, 4, 0),
    mapped("rpdo2.mapped_5", group::rpdo2_mapping, 5, 0),
    mapped("rpdo2.mapped_6", group::rpdo2_mapping, 6, 0),
    mapped("rpdo2.mapped_7", group::rpdo2_mapping, 7, 0),
    mapped("rpdo2.mapped_8", group::rpdo2_mapping, 8, 0),

    cob_id("rpdo3.cob_id", group::rpdo3, 1, canopen::cob_id::rpdo[2] | canopen::cob_id::invalid,
           "Identifier; bit 31: this PDO does not exist."),
    communication("rpdo3.transmission_type", group::rpdo3, 2, Type::unsigned8, "", 255, 255,
                  "0 to 240: taken over at the next SYNC; 254, 255: at once."),
    communication("rpdo3.mapped_count", group::rpdo3_mapping, 0, Type::unsigned8, "", 8, 0,
                  "Objects in the PDO."),
    mapped("rpdo3.mapped_1", group::rpdo3_mapping, 1, 0),
    mapped("rpdo3.mapped_2", group::rpdo3_mapping, 2, 0),
    mapped("rpdo3.mapped_3", group::rpdo3_mapping, 3, 0),
    mapped("rpdo3.mapped_4", group::rpdo3_mapping, 4, 0),
    mapped("rpdo3.mapped_5", group::rpdo3_mapping, 5, 0),
    mapped("rpdo3.mapped_6", group::rpdo3_mapping, 6, 0),
    mapped("rpdo3.mapped_7", group::rpdo3_mapping, 7, 0),
    mapped("rpdo3.mapped_8", group::rpdo3_mapping, 8, 0),

    cob_id("rpdo4.cob_id", group::rpdo4, 1, canopen::cob_id::rpdo[3] | canopen::cob_id::invalid,
           "Identifier; bit 31: this PDO does not exist."),
    communication("rpdo4.transmission_type", group::rpdo4, 2, Type::unsigned8, "", 255, 255,
                  "0 to 240: taken over at the next SYNC; 254, 255: at once."),
    communication("rpdo4.mapped_count", group::rpdo4_mapping, 0, Type::unsigned8, "", 8, 0,
                  "Objects in the PDO."),
    mapped("rpdo4.mapped_1", group::rpdo4_mapping, 1, 0),
    mapped("rpdo4.mapped_2", group::rpdo4_mapping, 2, 0),
    mapped("rpdo4.mapped_3", group::rpdo4_mapping, 3, 0),
    mapped("rpdo4.mapped_4", group::rpdo4_mapping, 4, 0),
    mapped("rpdo4.mapped_5", group::rpdo4_mapping, 5, 0),
    mapped("rpdo4.mapped_6", group::rpdo4_mapping, 6, 0),
    mapped("rpdo4.mapped_7", group::rpdo4_mapping, 7, 0),
    mapped("rpdo4.mapped_8", group::rpdo4_mapping, 8, 0),

    cob_id("tpdo1.cob_id", group::tpdo1, 1, canopen::cob_id::tpdo[0] | canopen::cob_id::no_remote,
           "Identifier; bit 31: this PDO does not exist."),
    communication("tpdo1.transmission_type", group::tpdo1, 2, Type::unsigned8, "", 255, 255,
                  "0: at a SYNC if something has changed; 1 to 240: at every nth SYNC; 254, 255: by the "
                  "event time, or at a change if that is 0."),
    communication("tpdo1.inhibit_time", group::tpdo1, 3, Type::unsigned16, "100 us", 65535, 0,
                  "Least time between two of them."),
    communication("tpdo1.event_time", group::tpdo1, 5, Type::unsigned16, "ms", 65535, 1,
                  "Time between two of them, at least 1 ms x 1 Mbit/s / can.bit_rate; 0: sent at a change."),
    communication("tpdo1.mapped_count", group::tpdo1_mapping, 0, Type::unsigned8, "", 8, 2,
                  "Objects in the PDO."),
    mapped("tpdo1.mapped_1", group::tpdo1_mapping, 1, mapping_of(0x6064, 0, 32)),
    mapped("tpdo1.mapped_2", group::tpdo1_mapping, 2, mapping_of(0x2012, 4, 32)),
    mapped("tpdo1.mapped_3", group::tpdo1_mapping, 3, 0),
    mapped("tpdo1.mapped_4", group::tpdo1_mapping, 4, 0),
    mapped("tpdo1.mapped_5", group::tpdo1_mapping, 5, 0),
    mapped("tpdo1.mapped_6", group::tpdo1_mapping, 6, 0),
    mapped("tpdo1.mapped_7", group::tpdo1_mapping, 7, 0),
    mapped("tpdo1.mapped_8", group::tpdo1_mapping, 8, 0),

    cob_id("tpdo2.cob_id", group::tpdo2, 1, canopen::cob_id::tpdo[1] | canopen::cob_id::no_remote,
           "Identifier; bit 31: this PDO does not exist."),
    communication("tpdo2.transmission_type", group::tpdo2, 2, Type::unsigned8, "", 255, 255,
                  "0: at a SYNC if something has changed; 1 to 240: at every nth SYNC; 254, 255: by the "
                  "event time, or at a change if that is 0."),
    communication("tpdo2.inhibit_time", group::tpdo2, 3, Type::unsigned16, "100 us", 65535, 0,
                  "Least time between two of them."),
    communication("tpdo2.event_time", group::tpdo2, 5, Type::unsigned16, "ms", 65535, 1,
                  "Time between two of them, at least 1 ms x 1 Mbit/s / can.bit_rate; 0: sent at a change."),
    communication("tpdo2.mapped_count", group::tpdo2_mapping, 0, Type::unsigned8, "", 8, 2,
                  "Objects in the PDO."),
    mapped("tpdo2.mapped_1", group::tpdo2_mapping, 1, mapping_of(0x6864, 0, 32)),
    mapped("tpdo2.mapped_2", group::tpdo2_mapping, 2, mapping_of(0x2812, 4, 32)),
    mapped("tpdo2.mapped_3", group::tpdo2_mapping, 3, 0),
    mapped("tpdo2.mapped_4", group::tpdo2_mapping, 4, 0),
    mapped("tpdo2.mapped_5", group::tpdo2_mapping, 5, 0),
    mapped("tpdo2.mapped_6", group::tpdo2_mapping, 6, 0),
    mapped("tpdo2.mapped_7", group::tpdo2_mapping, 7, 0),
    mapped("tpdo2.mapped_8", group::tpdo2_mapping, 8, 0),

    cob_id("tpdo3.cob_id", group::tpdo3, 1, canopen::cob_id::tpdo[2] | canopen::cob_id::no_remote,
           "Identifier; bit 31: this PDO does not exist."),
    communication("tpdo3.transmission_type", group::tpdo3, 2, Type::unsigned8, "", 255, 255,
                  "0: at a SYNC if something has changed; 1 to 240: at every nth SYNC; 254, 255: by the "
                  "event time, or at a change if that is 0."),
    communication("tpdo3.inhibit_time", group::tpdo3, 3, Type::unsigned16, "100 us", 65535, 0,
                  "Least time between two of them."),
    communication("tpdo3.event_time", group::tpdo3, 5, Type::unsigned16, "ms", 65535, 1,
                  "Time between two of them, at least 1 ms x 1 Mbit/s / can.bit_rate; 0: sent at a change."),
    communication("tpdo3.mapped_count", group::tpdo3_mapping, 0, Type::unsigned8, "", 8, 2,
                  "Objects in the PDO."),
    mapped("tpdo3.mapped_1", group::tpdo3_mapping, 1, mapping_of(0x2012, 3, 32)),
    mapped("tpdo3.mapped_2", group::tpdo3_mapping, 2, mapping_of(0x2812, 3, 32)),
    mapped("tpdo3.mapped_3", group::tpdo3_mapping, 3, 0),
    mapped("tpdo3.mapped_4", group::tpdo3_mapping, 4, 0),
    mapped("tpdo3.mapped_5", group::tpdo3_mapping, 5, 0),
    mapped("tpdo3.mapped_6", group::tpdo3_mapping, 6, 0),
    mapped("tpdo3.mapped_7", group::tpdo3_mapping, 7, 0),
    mapped("tpdo3.mapped_8", group::tpdo3_mapping, 8, 0),

    cob_id("tpdo4.cob_id", group::tpdo4, 1, canopen::cob_id::tpdo[3] | canopen::cob_id::no_remote,
           "Identifier; bit 31: this PDO does not exist."),
    communication("tpdo4.transmission_type", group::tpdo4, 2, Type::unsigned8, "", 255, 255,
                  "0: at a SYNC if something has changed; 1 to 240: at every nth SYNC; 254, 255: by the "
                  "event time, or at a change if that is 0."),
    communication("tpdo4.inhibit_time", group::tpdo4, 3, Type::unsigned16, "100 us", 65535, 0,
                  "Least time between two of them."),
    communication("tpdo4.event_time", group::tpdo4, 5, Type::unsigned16, "ms", 65535, 1,
                  "Time between two of them, at least 1 ms x 1 Mbit/s / can.bit_rate; 0: sent at a change."),
    communication("tpdo4.mapped_count", group::tpdo4_mapping, 0, Type::unsigned8, "", 8, 4,
                  "Objects in the PDO."),
    mapped("tpdo4.mapped_1", group::tpdo4_mapping, 1, mapping_of(0x2019, 1, 16)),
    mapped("tpdo4.mapped_2", group::tpdo4_mapping, 2, mapping_of(0x2819, 1, 16)),
    mapped("tpdo4.mapped_3", group::tpdo4_mapping, 3, mapping_of(0x581C, 1, 16)),
    mapped("tpdo4.mapped_4", group::tpdo4_mapping, 4, mapping_of(0x581C, 2, 16)),
    mapped("tpdo4.mapped_5", group::tpdo4_mapping, 5, 0),
    mapped("tpdo4.mapped_6", group::tpdo4_mapping, 6, 0),
    mapped("tpdo4.mapped_7", group::tpdo4_mapping, 7, 0),
    mapped("tpdo4.mapped_8", group::tpdo4_mapping, 8, 0),
});

}  // namespace kmax::firmware
