#pragma once

#include <array>

#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// Records that exist once per device.
namespace group {
inline constexpr Group supply{"supply", 0x3000, Scope::device, 0x0800};
inline constexpr Group link{"link", 0x3001, Scope::device, 0x0810};
inline constexpr Group node{"node", 0x3002, Scope::device, 0x0820};
inline constexpr Group can{"can", 0x3003, Scope::device, 0x0828};
inline constexpr Group modbus{"modbus", 0x3004, Scope::device, 0x0830};
inline constexpr Group trace{"trace", 0x3005, Scope::device, 0x0840};
inline constexpr Group transaction{"transaction", 0x3010, Scope::device, 0x0900};
inline constexpr Group info{"info", 0x3011, Scope::device, 0x0800};
inline constexpr Group counters{"counters", 0x3012, Scope::device, 0x0840};
inline constexpr Group refusal{"refusal", 0x3013, Scope::device, 0x0880};
inline constexpr Group trace_state{"trace", 0x3014, Scope::device, 0x08A0};
}  // namespace group

namespace names {
inline constexpr NamedValue can_bit_rate[] = {
    {"125000", 125000}, {"250000", 250000}, {"500000", 500000}, {"1000000", 1000000}};
inline constexpr NamedValue clock_source[] = {{"crystal_pll", 0}, {"internal_pll", 1}, {"internal", 2},
                                              {"unreadable", 3},  {"native", 4},       {"unresponsive", 5}};
inline constexpr NamedValue baud_rate[] = {{"9600", 9600},     {"19200", 19200},   {"38400", 38400},
                                           {"57600", 57600},   {"115200", 115200}, {"230400", 230400},
                                           {"460800", 460800}, {"921600", 921600}};
}  // namespace names

/// A choice whose numbers need 32 bits.
template <std::size_t count>
constexpr Entry rate_choice(std::string_view name, Group group, std::uint8_t subindex, std::string_view unit,
                            const NamedValue (&values)[count], std::int32_t default_value,
                            std::string_view help) {
  Entry e = choice(name, group, subindex, values, default_value, help);
  e.type = Type::unsigned32;
  e.unit = unit;
  return e;
}

inline constexpr std::array device_entries = std::to_array<Entry>({
    real("supply.voltage_min", group::supply, 1, "V", 0, 100, 8,
         "Trip level of the supply, low. Not used by this version."),
    real("supply.voltage_max", group::supply, 2, "V", 0, 100, 26,
         "Trip level of the supply, high. Not used by this version."),

    real("link.timeout", group::link, 1, "s", 0, 60, 1,
         "Host silence after which an armed axis loses its force with a fault; 0 turns it off."),

    whole("node.id", group::node, 1, Type::unsigned8, "", 1, 127, 1,
          "CANopen node ID. Not used by this version."),
    rate_choice("can.bit_rate", group::can, 1, "bit/s", names::can_bit_rate, 1000000,
                "CAN bit rate. Not used by this version."),
    whole("modbus.unit", group::modbus, 1, Type::unsigned8, "", 1, 247, 1,
          "Modbus unit; takes effect after the reply to the request that set it."),
    rate_choice("modbus.baud_rate", group::modbus, 2, "baud", names::baud_rate, 115200,
                "Serial baud rate, 8 data bits, even parity, 1 stop bit; takes effect after the reply."),

    whole("trace.axis", group::trace, 1, Type::unsigned8, "", 0, 1, 0, "Axis that is traced.")
        .volatile_value(),
    whole("trace.interval", group::trace, 2, Type::unsigned16, "samples", 0, 65535, 0,
          "Haptic samples per trace record; 0 stops the trace.")
        .volatile_value(),

    whole("transaction.control", group::transaction, 1, Type::unsigned16, "", 0, 2, 0,
          "1 begins a transaction: writes are checked and kept aside; 2 applies them all in one tick; 0 "
          "drops them. "
          "A transaction that sees no write for 2 s is dropped.")
        .volatile_value(),

    reading("info.vendor_id", group::info, 1, Type::unsigned32, "", "CiA vendor ID; 0: none assigned."),
    reading("info.product_code", group::info, 2, Type::unsigned32, "", "Product code."),
    reading("info.firmware_version", group::info, 3, Type::unsigned32, "",
            "Firmware version: major x 65536 + minor x 256 + patch."),
    reading("info.serial_number", group::info, 4, Type::unsigned32, "", "Serial number."),
    reading("info.dictionary_checksum", group::info, 5, Type::unsigned32, "",
            "Checksum of this dictionary: host and device must agree on it."),
    reading("info.tick_rate", group::info, 6, Type::unsigned32, "Hz", "Ticks per second."),
    reading("info.core_clock", group::info, 7, Type::unsigned32, "Hz", "Processor clock."),
    named_reading("info.clock_source", group::info, 8, names::clock_source,
                  "Where the processor clock comes from."),
    reading("info.uptime", group::info, 9, Type::unsigned32, "s", "Seconds since start."),
    reading("info.tick", group::info, 10, Type::unsigned32, "ticks", "Ticks since start (low 32 bits)."),

    reading("counters.frames_received", group::counters, 1, Type::unsigned32, "",
            "Modbus frames received whole."),
    reading("counters.replies_sent", group::counters, 2, Type::unsigned32, "", "Modbus replies sent."),
    reading("counters.exceptions_sent", group::counters, 3, Type::unsigned32, "", "Of these, exceptions."),
    reading("counters.crc_errors", group::counters, 4, Type::unsigned32, "",
            "Frames dropped for their checksum."),
    reading("counters.line_errors", group::counters, 5, Type::unsigned32, "",
            "Frames dropped for a parity, framing or overrun error."),
    reading("counters.gap_errors", group::counters, 6, Type::unsigned32, "",
            "Frames dropped for a silence of more than 1.5 characters inside."),
    reading("counters.length_errors", group::counters, 7, Type::unsigned32, "",
            "Frames too short or too long."),
    reading("counters.other_units", group::counters, 8, Type::unsigned32, "", "Frames for another unit."),
    reading("counters.queue_overflows", group::counters, 9, Type::unsigned32, "",
            "Serial bytes lost between interrupt and main loop."),

    reading("refusal.reason", group::refusal, 1, Type::unsigned16, "",
            "Why the last write was refused; 0: it was not."),
    reading("refusal.register", group::refusal, 2, Type::unsigned16, "", "Holding register it was about."),

    reading("trace.next", group::trace_state, 1, Type::unsigned32, "records", "Records traced since start."),
});

}  // namespace kmax::firmware
