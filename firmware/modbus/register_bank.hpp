// What the Modbus server needs from the registers of a device: the concept RegisterBank, and the exception
// codes that bank and server speak (MODBUS Application Protocol V1.1b3, 7).
//
// Addresses are those of the PDU, from 0. The server only asks for ranges that end at or below 0xFFFF,
// with 1..125 registers to read and 1..123 to write.
//
//   read_holding(address, out)   fills `out` and returns none, or returns an exception; `out` is then not
//   used read_input(address, out)     the same for input registers write_holding(address, in)   whole or
//   nothing: writes every register and returns none, or changes nothing
//                                and returns
//     illegal_data_address       a register is missing or read-only, or the range cuts a value of several
//                                registers in two
//     illegal_data_value         a value is out of its range
//     server_device_failure, server_device_busy
//     negative_acknowledge       the device is locked (Modicon's PI-MBUS-300 has it for a programming request
//                                refused)
//   has_holding(address, count)  true if read_holding() over this range returns none. Read/write-multiple
//                                asks before it writes, since an exception for the read part must leave the
//                                registers untouched.
//   identification(object_id)    text of a device identification object, empty if there is none. 0 vendor, 1
//                                product code, 2 revision are mandatory; 3..0x7F printable ASCII as well,
//                                0x80..0xFF free. At most 244 bytes are sent.
#pragma once

#include <concepts>
#include <cstdint>
#include <span>
#include <string_view>

namespace kmax::firmware::modbus {

enum class Exception : std::uint8_t {
  none = 0,
  illegal_function = 1,
  illegal_data_address = 2,
  illegal_data_value = 3,
  server_device_failure = 4,
  server_device_busy = 6,
  negative_acknowledge = 7,
};

template <typename Bank>
concept RegisterBank = requires(Bank& bank, std::uint16_t address, std::uint16_t count,
                                std::uint8_t object_id, std::span<std::uint16_t> out,
                                std::span<const std::uint16_t> in) {
  { bank.read_holding(address, out) } -> std::same_as<Exception>;
  { bank.read_input(address, out) } -> std::same_as<Exception>;
  { bank.write_holding(address, in) } -> std::same_as<Exception>;
  { bank.has_holding(address, count) } -> std::same_as<bool>;
  { bank.identification(object_id) } -> std::convertible_to<std::string_view>;
};

}  // namespace kmax::firmware::modbus
