#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "firmware/object_dictionary/cob_id.hpp"
#include "firmware/object_dictionary/dictionary.hpp"
#include "firmware/object_dictionary/register_windows.hpp"

namespace kmax::firmware {

/// Objects of CANopen that are no values of the dictionary: they act when they are accessed, or are longer
/// than four bytes. With the entries and each record's sub-index 0 they are all that SDO reaches and the EDS
/// lists.
enum class SpecialObject : std::uint8_t {
  device_type,
  error_register,
  error_history_count,
  error_history,
  device_name,
  hardware_version,
  software_version,
  store_parameters,
  restore_defaults,
  trace_records,
  capture_samples,
  scratch,
  fault_log,
  sdo_request,
  sdo_response,
};

enum class ObjectType : std::uint8_t { unsigned8, unsigned32, visible_string, domain };
enum class ObjectAccessKind : std::uint8_t { constant, read_only, read_write };

struct SpecialObjectRow {
  SpecialObject what;
  std::string_view name;
  std::uint16_t index;
  std::uint8_t first_subindex, last_subindex;
  ObjectType type;
  ObjectAccessKind access;
  std::uint32_t default_value;  ///< of numbers
  std::string_view help;
  bool plus_node_id = false;  ///< the node ID is added to the number
};

inline constexpr std::uint32_t device_type_of_several_axes = 0xFFFF'0192;
inline constexpr std::uint32_t device_type_of_axis = 0x0002'0192;  ///< CiA 402, servo drive
inline constexpr std::uint32_t signature_save = 0x6576'6173;       ///< "save"
inline constexpr std::uint32_t signature_load = 0x6461'6F6C;       ///< "load"
inline constexpr std::uint8_t error_history_length = 8;
inline constexpr std::uint8_t trace_records_per_object = 8;
inline constexpr std::uint8_t trace_objects = trace_capacity / trace_records_per_object;
inline constexpr std::uint32_t trace_object_bytes = 2 * trace_words_per_record * trace_records_per_object;
inline constexpr std::size_t scratch_bytes = 2048;

inline constexpr std::array special_objects = std::to_array<SpecialObjectRow>({
    {SpecialObject::device_type, "Device type", 0x1000, 0, 0, ObjectType::unsigned32,
     ObjectAccessKind::constant, device_type_of_several_axes,
     "CiA 402, one device per axis; axis n's type is at 0x67FF + n x 0x800."},
    {SpecialObject::error_register, "Error register", 0x1001, 0, 0, ObjectType::unsigned8,
     ObjectAccessKind::read_only, 0,
     "Bit 0 any error, 1 current, 2 voltage, 3 temperature, 4 communication, 5 device, 7 manufacturer's."},
    {SpecialObject::error_history_count, "Number of errors", 0x1003, 0, 0, ObjectType::unsigned8,
     ObjectAccessKind::read_write, 0, "Errors since start, at most 8; writing 0 erases them."},
    {SpecialObject::error_history, "Error", 0x1003, 1, error_history_length, ObjectType::unsigned32,
     ObjectAccessKind::read_only, 0,
     "Bytes 0, 1, 3 and 4 of the emergency message, newest first. Bits 0 to 15: error code; 16 to 23: the "
     "axis, 127 for the bus, or 128 + the ID of a node that fell silent; 24 to 31: the low byte of the "
     "number that tripped the axis, a float32, which says nothing by itself."},
    {SpecialObject::device_name, "Device name", 0x1008, 0, 0, ObjectType::visible_string,
     ObjectAccessKind::constant, 0, "Name of this device."},
    {SpecialObject::hardware_version, "Hardware version", 0x1009, 0, 0, ObjectType::visible_string,
     ObjectAccessKind::constant, 0, "Name of the board."},
    {SpecialObject::software_version, "Software version", 0x100A, 0, 0, ObjectType::visible_string,
     ObjectAccessKind::constant, 0, "Version of the firmware."},
    {SpecialObject::store_parameters, "Save all parameters", 0x1010, 1, 1, ObjectType::unsigned32,
     ObjectAccessKind::read_write, 1, "Writing 'save' (0x65766173) saves; reads 1: on command."},
    {SpecialObject::restore_defaults, "Restore all default parameters", 0x1011, 1, 1, ObjectType::unsigned32,
     ObjectAccessKind::read_write, 1,
     "Writing 'load' (0x64616F6C): all parameters are at their defaults after the next reset; reads 1."},
    {SpecialObject::trace_records, "Trace records", 0x5820, 1, trace_objects, ObjectType::domain,
     ObjectAccessKind::read_only, 0, "Eight records each of tick, count, force, magnetic coefficient."},
    {SpecialObject::capture_samples, "Capture samples", 0x5821, 1, 1, ObjectType::domain,
     ObjectAccessKind::read_only, 0, "All values of a complete capture, 32 bits each."},
    {SpecialObject::scratch, "Scratch pad", 0x5822, 1, 1, ObjectType::domain, ObjectAccessKind::read_write, 0,
     "Keeps up to 2048 bytes in RAM, for trying a bus and its transfers."},
    {SpecialObject::fault_log, "Fault log entry", 0x5828, 1, fault_log_entries, ObjectType::domain,
     ObjectAccessKind::read_only, 0,
     "The entry whose number modulo 16 is one less than the sub-index, 16 words of 32 bits; zeros: none."},
    {SpecialObject::sdo_request, "COB-ID client to server", 0x1200, 1, 1, ObjectType::unsigned32,
     ObjectAccessKind::read_only, canopen::cob_id::sdo_request, "Identifier by which hosts ask.", true},
    {SpecialObject::sdo_response, "COB-ID server to client", 0x1200, 2, 2, ObjectType::unsigned32,
     ObjectAccessKind::read_only, canopen::cob_id::sdo_response, "Identifier of the answers.", true},
});

/// Where an object is found. A search through the table: for constants, and for hosts.
constexpr std::uint16_t index_of(SpecialObject what) {
  return std::find_if(special_objects.begin(), special_objects.end(),
                      [what](const SpecialObjectRow& row) { return row.what == what; })
      ->index;
}

}  // namespace kmax::firmware
