#pragma once

#include <array>

#include "firmware/object_dictionary/capture_channel.hpp"
#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// Records that exist once per device, behind the places of the last axis that there can be.
namespace group {
inline constexpr Group supply{"supply", 0x5800, Scope::device, 0x2000};
inline constexpr Group link{"link", 0x5801, Scope::device, 0x2010};
inline constexpr Group node{"node", 0x5802, Scope::device, 0x2020};
inline constexpr Group can{"can", 0x5803, Scope::device, 0x2028};
inline constexpr Group modbus{"modbus", 0x5804, Scope::device, 0x2030};
inline constexpr Group trace{"trace", 0x5805, Scope::device, 0x2040};
// Apart from each other, so that no write covers both commands.
inline constexpr Group lock{"lock", 0x5808, Scope::device, 0x2204};
inline constexpr Group lock_key{"lock", 0x5809, Scope::device, 0x2208};
inline constexpr Group lock_status{"lock", 0x580A, Scope::device, 0x2208};
inline constexpr Group transaction{"transaction", 0x5810, Scope::device, 0x2100};
inline constexpr Group info{"info", 0x5811, Scope::device, 0x2000};
inline constexpr Group counters{"counters", 0x5812, Scope::device, 0x2040};
inline constexpr Group refusal{"refusal", 0x5813, Scope::device, 0x2080};
inline constexpr Group trace_state{"trace", 0x5814, Scope::device, 0x20A0};
inline constexpr Group supply_state{"supply", 0x5815, Scope::device, 0x20B0};
inline constexpr Group store{"store", 0x5816, Scope::device, 0x2110};
inline constexpr Group store_status{"store", 0x5817, Scope::device, 0x20C0};
inline constexpr Group capture{"capture", 0x5818, Scope::device, 0x2120};
/// Apart from the settings, so that no write covers both.
inline constexpr Group capture_command{"capture", 0x581A, Scope::device, 0x2140};
inline constexpr Group capture_status{"capture", 0x5819, Scope::device, 0x20F0};
inline constexpr Group can_status{"can", 0x581B, Scope::device, 0x2160};
inline constexpr Group telemetry_state{"telemetry", 0x581C, Scope::device, 0x21C0};
inline constexpr Group log{"log", 0x5829, Scope::device, 0x2200};
inline constexpr Group log_status{"log", 0x582A, Scope::device, 0x2200};
}  // namespace group

namespace names {
inline constexpr NamedValue can_bit_rate[] = {
    {"125000", 125000}, {"250000", 250000}, {"500000", 500000}, {"1000000", 1000000}};
inline constexpr NamedValue clock_source[] = {{"crystal_pll", 0}, {"internal_pll", 1}, {"internal", 2},
                                              {"unreadable", 3},  {"native", 4},       {"unresponsive", 5}};
inline constexpr NamedValue reset_cause[] = {
    {"unknown", 0},         {"power_on", 1},  {"pin", 2},       {"software", 3}, {"independent_watchdog", 4},
    {"window_watchdog", 5}, {"low_power", 6}, {"brown_out", 7}, {"native", 8}};
inline constexpr NamedValue brown_out_level[] = {
    {"level_3", 0}, {"level_2", 1}, {"level_1", 2}, {"off", 3}, {"unknown", 4}};
inline constexpr NamedValue crash_cause[] = {{"none", 0}, {"fault", 1}, {"unexpected_interrupt", 2}};
inline constexpr NamedValue can_state[] = {{"absent", 0}, {"stopped", 1},       {"joining", 2},
                                           {"active", 3}, {"error_passive", 4}, {"bus_off", 5}};
inline constexpr NamedValue store_state[] = {{"idle", 0},     {"busy", 1},    {"saved", 2},
                                             {"failed", 3},   {"refused", 4}, {"defaults_set", 5},
                                             {"no_memory", 6}};
inline constexpr NamedValue lock_state[] = {{"no_code", 0}, {"open", 1}, {"locked", 2}};
inline constexpr NamedValue link_loss[] = {{"limp", 0}, {"ramp", 1}, {"damp", 2}};
inline constexpr NamedValue baud_rate[] = {{"9600", 9600},     {"19200", 19200},   {"38400", 38400},
                                           {"57600", 57600},   {"115200", 115200}, {"230400", 230400},
                                           {"460800", 460800}, {"921600", 921600}};
}  // namespace names

/// A choice whose numbers need 32 bits.
constexpr Entry rate_choice(std::string_view name, Group group, std::uint8_t subindex, std::string_view unit,
                            std::span<const NamedValue> values, std::int32_t default_value,
                            std::string_view help) {
  Entry e = choice(name, group, subindex, values, default_value, help);
  e.type = Type::unsigned32;
  e.unit = unit;
  return e;
}

inline constexpr std::array device_entries = std::to_array<Entry>({
    real("supply.voltage_min", group::supply, 1, "V", 0, 100, 8,
         "Trip level of the supply, low: an armed axis loses its force at once.")
        .only_higher(),
    real("supply.voltage_max", group::supply, 2, "V", 0, 100, 25.5,
         "Trip level of the supply, high: an armed axis loses its force at once. Not above supply.ceiling.")
        .only_lower(),
    real("supply.brake_voltage", group::supply, 3, "V", 0, 100, 0,
         "Supply voltage from which the brake resistor is switched on; 0: none is fitted.")
        .disarmed_only(),

    real(
        "link.timeout", group::link, 1, "s", 0, 60, 1,
        "Silence of whoever armed it after which an axis loses its force with a fault; 0 turns it off. Only "
        "the link that armed it counts: on the serial line any request is a sign of life; on CAN what "
        "commands: controlword, target or link.sign_of_life written, by SDO or PDO, and a watched heartbeat. "
        "See drive.commander.")
        .disarmed_only(),
    whole("link.sign_of_life", group::link, 2, Type::unsigned16, "", 0, 65535, 0,
          "Written by a host that commands and has nothing else to write: the number in drive.commander.")
        .volatile_value(),
    choice("link.loss", group::link, 3, names::link_loss, 0,
           "How an axis loses its force when its commander is lost (link.timeout, bus-off, a watched "
           "heartbeat): limp at once; ramp evenly within force.ramp_time; damp at once, while the shorted "
           "motor brakes the handle until it stands, at most 2 s. Mode excitation always goes limp.")
        .disarmed_only(),

    whole("node.id", group::node, 1, Type::unsigned8, "", 1, 127, 1,
          "CANopen node ID; takes effect at the next start or NMT reset."),
    rate_choice("can.bit_rate", group::can, 1, "bit/s", names::can_bit_rate, 1000000,
                "CAN bit rate; takes effect at the next start or NMT reset of the communication."),
    whole("modbus.unit", group::modbus, 1, Type::unsigned8, "", 1, 247, 1,
          "Modbus unit; takes effect after the reply to the request that set it.")
        .disarmed_only(),
    rate_choice("modbus.baud_rate", group::modbus, 2, "baud", names::baud_rate, 115200,
                "Serial baud rate, 8 data bits, even parity, 1 stop bit; takes effect after the reply.")
        .disarmed_only(),

    whole("trace.axis", group::trace, 1, Type::unsigned8, "", 0, axis_count - 1, 0, "Axis that is traced.")
        .volatile_value(),
    whole("trace.interval", group::trace, 2, Type::unsigned16, "samples", 0, 65535, 0,
          "Haptic samples per trace record; 0 stops the trace.")
        .volatile_value(),

    whole("transaction.control", group::transaction, 1, Type::unsigned16, "", 0, 2, 0,
          "1 begins a transaction: writes are checked and kept aside; 2 applies them all in one tick; 0 "
          "drops them. It belongs to the link that began it: what another link sets meanwhile is refused. A "
          "transaction that sees no write for 2 s is dropped.")
        .volatile_value(),

    reading("info.vendor_id", group::info, 1, Type::unsigned32, "", "CiA vendor ID; 0: none assigned.")
        .at_standard_index(0x1018, 1),
    reading("info.product_code", group::info, 2, Type::unsigned32, "", "Product code.")
        .at_standard_index(0x1018, 2),
    reading("info.firmware_version", group::info, 3, Type::unsigned32, "",
            "Firmware version: major x 65536 + minor x 256 + patch.")
        .at_standard_index(0x1018, 3),
    reading("info.serial_number", group::info, 4, Type::unsigned32, "", "Serial number.")
        .at_standard_index(0x1018, 4),
    reading(
        "info.dictionary_checksum", group::info, 5, Type::unsigned32, "",
        "Checksum of this dictionary, of how many axes there are and of the tick rate: host and device must "
        "agree on it. Stored parameters are taken over whatever theirs was."),
    reading("info.tick_rate", group::info, 6, Type::unsigned32, "Hz", "Ticks per second."),
    reading("info.core_clock", group::info, 7, Type::unsigned32, "Hz", "Processor clock."),
    named_reading("info.clock_source", group::info, 8, names::clock_source,
                  "Where the processor clock comes from."),
    reading("info.uptime", group::info, 9, Type::unsigned32, "s", "Seconds since start."),
    reading("info.tick", group::info, 10, Type::unsigned32, "ticks", "Ticks since start (low 32 bits)."),
    named_reading("info.reset_cause", group::info, 11, names::reset_cause, "Why the processor started."),
    reading("info.crash_count", group::info, 12, Type::unsigned32, "",
            "Crashes of the firmware since power-on; the last one's record follows."),
    named_reading("info.crash_cause", group::info, 13, names::crash_cause, "What ended the run before."),
    reading("info.crash_exception", group::info, 14, Type::unsigned16, "",
            "Exception number: 3 hard fault, 16 + n interrupt n."),
    reading("info.crash_program_counter", group::info, 15, Type::unsigned32, "",
            "Where the program was; 0: its stack could not be read."),
    reading("info.crash_link_register", group::info, 16, Type::unsigned32, "",
            "Where it would have returned to."),
    reading("info.crash_status", group::info, 17, Type::unsigned32, "",
            "Cortex-M4 CFSR; 'kmax info' says it in words."),
    reading("info.crash_hard_fault_status", group::info, 18, Type::unsigned32, "", "Cortex-M4 HFSR."),
    reading("info.crash_address", group::info, 19, Type::unsigned32, "",
            "Address of the access that failed, if info.crash_status says that it is known."),
    named_reading(
        "info.brown_out_level", group::info, 20, names::brown_out_level,
        "Holds the processor in reset below 2.7 V, as its full speed needs, if level_3; 'kmax flash' by SWD "
        "sets that."),

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
    reading("counters.missed_ticks", group::counters, 10, Type::unsigned32, "ticks",
            "Control ticks that came late or were lost."),
    reading(
        "counters.longest_tick", group::counters, 11, Type::unsigned32, "",
        "Cycles of info.core_clock that the longest tick has taken which ended a sleep of the core, since "
        "the start, by its own counter, entry and return included, and whatever interrupts but USB's came "
        "with it. 0: not measured."),
    reading("counters.interference_forgiven", group::counters, 12, Type::unsigned32, "",
            "Disturbances of the emergency stop's line and of the gate drivers' fault line that were over "
            "within microseconds, and after which force went on. Up to 5 a millisecond go on for ever; a "
            "number that rises asks for shielded cables."),
    reading(
        "counters.usb_resets", group::counters, 13, Type::unsigned32, "",
        "Resets by a USB host: a few each time that it finds the board; more without a hand at the plug are "
        "a bad cable, or disturbances."),
    reading("counters.usb_suspensions", group::counters, 14, Type::unsigned32, "",
            "Times that a USB host fell silent: it sleeps, or the cable was pulled."),
    reading(
        "counters.usb_refused_requests", group::counters, 15, Type::unsigned32, "",
        "Requests about the USB device itself that it refused, malformed ones among them. A PC asks for some "
        "that this one does not have each time that it finds it."),
    reading("counters.usb_modbus_requests", group::counters, 16, Type::unsigned32, "",
            "Modbus requests received over USB."),
    reading(
        "counters.usb_modbus_errors", group::counters, 17, Type::unsigned32, "",
        "What came over USB's serial port and was none: checksum, length, another unit, or the port closed "
        "in the middle."),
    reading("counters.usb_frames_lost", group::counters, 18, Type::unsigned32, "",
            "CAN frames that the PC at the USB CAN adapter was too slow for."),
    reading(
        "counters.usb_frames_not_sent", group::counters, 19, Type::unsigned32, "",
        "CAN frames that a bus had no room for while that adapter is open: one which is off, where nobody "
        "acknowledges, or which others fill."),
    reading("counters.usb_frames_refused", group::counters, 20, Type::unsigned32, "",
            "What that PC sent and was no CAN frame, or for a channel that was not open."),

    reading("refusal.reason", group::refusal, 1, Type::unsigned16, "",
            "Why the last write was refused; 0: it was not."),
    reading("refusal.register", group::refusal, 2, Type::unsigned16, "", "Holding register it was about."),

    reading("trace.next", group::trace_state, 1, Type::unsigned32, "records", "Records traced since start."),

    reading("supply.voltage", group::supply_state, 1, Type::float32, "V",
            "Supply of the power stage, measured; 0 on a board that does not measure it."),
    reading("supply.ceiling", group::supply_state, 2, Type::float32, "V",
            "The highest supply.voltage_max that the board's capacitors and MOSFETs allow; 0: not known. A "
            "stored value above it is not taken over."),

    whole("store.command", group::store, 1, Type::unsigned16, "", 0, 2, 0,
          "1 saves all persistent parameters; 2 sets all of them to their defaults, which only the next save "
          "keeps. Both only while no axis is armed. See store.state; reads as 0.")
        .volatile_value(),

    named_reading("store.state", group::store_status, 1, names::store_state,
                  "What the parameter store does or did last. While it is busy no axis can be armed."),
    reading("store.sequence", group::store_status, 2, Type::unsigned32, "",
            "Number of the newest record that is kept; each save adds one."),
    reading("store.saved_parameters", group::store_status, 3, Type::unsigned16, "",
            "Parameters in that record; 0: nothing has been saved."),
    reading("store.unsaved_parameters", group::store_status, 4, Type::unsigned16, "",
            "Parameters whose present value a restart would not bring back."),
    reading("store.free_saves", group::store_status, 5, Type::unsigned16, "",
            "Saves that fit before the next erase, which takes up to 0.5 s."),
    reading("store.erases", group::store_status, 6, Type::unsigned32, "",
            "Erases of the store's two sectors so far; each of them lasts for 10000."),
    reading("store.write_errors", group::store_status, 7, Type::unsigned32, "",
            "Words and erases since start that the memory did not take."),
    reading("store.damaged_records", group::store_status, 8, Type::unsigned16, "",
            "Records in the store that cannot be used: saves cut short by a loss of power, or changed bits."),
    reading("store.migrated_dropped", group::store_status, 9, Type::unsigned16, "",
            "Values in the record loaded at start that this firmware has no parameter for."),
    reading("store.migrated_defaulted", group::store_status, 10, Type::unsigned16, "",
            "Parameters that the record loaded at start lacks or has with a value that is not allowed: they "
            "have their defaults."),
    reading("store.dropped_1", group::store_status, 11, Type::unsigned32, "",
            "First dropped value: object index x 65536 + sub-index x 256 + type; 0: none."),
    reading("store.dropped_2", group::store_status, 12, Type::unsigned32, "", "Second dropped value."),
    reading("store.dropped_3", group::store_status, 13, Type::unsigned32, "", "Third dropped value."),
    reading("store.defaulted_1", group::store_status, 14, Type::unsigned32, "",
            "First parameter that has its default, in the same form; 0: none."),
    reading("store.defaulted_2", group::store_status, 15, Type::unsigned32, "", "Second such parameter."),
    reading("store.defaulted_3", group::store_status, 16, Type::unsigned32, "", "Third such parameter."),

    whole("capture.axis", group::capture, 1, Type::unsigned8, "", 0, axis_count - 1, 0,
          "Axis that is captured.")
        .volatile_value(),
    choice("capture.channel_1", group::capture, 2, names::capture_channel, 0,
           "What a capture records first; 'none' is left out. Positions are read as counts, angles as 2^-32 "
           "turns, all else as it is named.")
        .volatile_value(),
    choice("capture.channel_2", group::capture, 3, names::capture_channel, 0,
           "What a capture records second.")
        .volatile_value(),
    choice("capture.channel_3", group::capture, 4, names::capture_channel, 0, "What a capture records third.")
        .volatile_value(),
    choice("capture.channel_4", group::capture, 5, names::capture_channel, 0,
           "What a capture records fourth.")
        .volatile_value(),
    whole("capture.interval", group::capture, 6, Type::unsigned32, "ticks", 1, 1e6, 1,
          "Ticks from one sample to the next.")
        .volatile_value(),
    whole("capture.samples", group::capture, 7, Type::unsigned32, "samples", 0, 12288, 0,
          "Samples to take; 0, or more than fit: as many as fit.")
        .volatile_value(),
    whole("capture.pre_trigger", group::capture, 8, Type::unsigned32, "samples", 0, 12288, 0,
          "Samples of these from before the trigger.")
        .volatile_value(),
    choice("capture.trigger", group::capture, 9, names::capture_trigger, 0,
           "What starts a capture that is armed.")
        .volatile_value(),
    real("capture.trigger_level", group::capture, 10, "", 0, 1e6, 1,
         "Level of the triggers 'force' (N) and 'velocity' (m/s).")
        .volatile_value(),
    choice("capture.command", group::capture_command, 1, names::capture_command, 0,
           "'arm' begins a capture with the settings above, 'stop' ends it.")
        .volatile_value(),

    named_reading("capture.state", group::capture_status, 1, names::capture_state,
                  "Whether a capture waits for its trigger, runs, or can be read."),
    reading("capture.taken", group::capture_status, 2, Type::unsigned32, "samples",
            "Samples that can be read."),
    reading("capture.trigger_sample", group::capture_status, 3, Type::unsigned32, "",
            "Number of the sample at the trigger."),
    reading("capture.first_tick", group::capture_status, 4, Type::unsigned32, "ticks",
            "Tick of the first sample."),
    reading("capture.channels", group::capture_status, 5, Type::unsigned8, "", "Words in a sample."),

    named_reading("can.state", group::can_status, 1, names::can_state, "Condition of the CAN controller."),
    reading("can.node_state", group::can_status, 2, Type::unsigned8, "",
            "CANopen NMT state: 0 initialising, 4 stopped, 5 operational, 127 pre-operational."),
    reading("can.node_in_use", group::can_status, 3, Type::unsigned8, "", "Node ID that is answered to."),
    reading("can.transmit_errors", group::can_status, 4, Type::unsigned8, "",
            "Transmit error counter; from 128 the controller is error passive, beyond 255 bus-off."),
    reading("can.receive_errors", group::can_status, 5, Type::unsigned8, "", "Receive error counter."),
    reading("can.received", group::can_status, 6, Type::unsigned32, "", "Frames taken from the bus."),
    reading("can.sent", group::can_status, 7, Type::unsigned32, "", "Frames that have left."),
    reading("can.overruns", group::can_status, 8, Type::unsigned32, "",
            "Times that frames were lost in the controller because it was not emptied in time."),
    reading("can.queue_overflows", group::can_status, 9, Type::unsigned32, "",
            "Frames lost between interrupt and main loop: more than 64 waited."),
    reading("can.bus_offs", group::can_status, 10, Type::unsigned32, "",
            "Times that the controller went bus-off."),
    reading("can.discarded", group::can_status, 11, Type::unsigned32, "",
            "Frames thrown away unsent at bus-off."),
    reading("can.sdo_aborts", group::can_status, 12, Type::unsigned32, "",
            "SDO transfers that the device aborted."),
    reading("can.sdo_timeouts", group::can_status, 13, Type::unsigned32, "",
            "Of these, for the host's silence."),
    reading("can.rpdo_refused", group::can_status, 14, Type::unsigned32, "",
            "Values in received PDOs that were not taken: out of range, or not allowed while armed."),
    reading("can.pdo_length_errors", group::can_status, 15, Type::unsigned32, "",
            "Received PDOs shorter than what is mapped."),
    reading("can.tpdo_held_back", group::can_status, 16, Type::unsigned32, "",
            "PDOs due that were not sent since the one before had not left yet."),
    reading("can.emergencies_lost", group::can_status, 17, Type::unsigned32, "",
            "Emergency messages that found their queue full."),
    reading("can.heartbeats_lost", group::can_status, 18, Type::unsigned32, "",
            "Times that a watched node fell silent."),
    reading("can.identity_conflicts", group::can_status, 19, Type::unsigned32, "",
            "Frames that only this node may send, heard from another: two nodes have one ID."),
    reading("can.bit_rate_in_use", group::can_status, 20, Type::unsigned32, "bit/s", "Bit rate at work."),

    reading("telemetry.flags", group::telemetry_state, 1, Type::unsigned16, "",
            "measured.flags of both axes: axis 0 in the low byte, axis 1 in the high one."),
    reading("telemetry.tick", group::telemetry_state, 2, Type::unsigned16, "ticks",
            "Low 16 bits of the tick at which the values of the PDOs were taken."),

    whole("log.command", group::log, 1, Type::unsigned16, "", 0, 1, 0,
          "1 erases the fault log, while no axis is armed; reads as 0.")
        .volatile_value(),

    reading("log.newest", group::log_status, 1, Type::unsigned32, "",
            "Number of the newest entry of the fault log, which outlives resets but no loss of power; 0: "
            "none yet. 'kmax faults' shows it."),
    reading("log.start", group::log_status, 2, Type::unsigned16, "",
            "How many starts there have been since power-on, with this one."),

    whole("lock.code", group::lock, 1, Type::unsigned32, "", 0, 4294967295.0, 0,
          "Sets the code of the write lock, which is kept at once and locks when store.state says saved; 0 "
          "removes it. Only while it is open and no axis is armed; reads as 0.")
        .disarmed_only()
        .volatile_value(),
    whole("lock.key", group::lock_key, 1, Type::unsigned32, "", 0, 4294967295.0, 0,
          "The code opens the write lock until the next start; 0 locks again. Only while no axis is armed. "
          "See lock.state; reads as 0.")
        .disarmed_only()
        .volatile_value(),
    named_reading(
        "lock.state", group::lock_status, 1, names::lock_state,
        "Whether settings can be changed: no_code and open, they can; locked, only lock.key opens."),
    reading("lock.attempts", group::lock_status, 2, Type::unsigned16, "",
            "Wrong codes since the right one was given; a reset keeps the number, a power-off does not."),
    reading("lock.wait", group::lock_status, 3, Type::unsigned16, "s",
            "How long no code is taken, not even the right one: twice as long after each wrong one."),
});

}  // namespace kmax::firmware
