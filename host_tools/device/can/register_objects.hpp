#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "firmware/canopen/object_access.hpp"
#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::link {

/// A value of the device as a Modbus table and CANopen both know it.
struct RegisterObject {
  std::size_t entry;
  std::uint16_t address;  ///< of its first register
  firmware::canopen::ObjectAddress object;

  const firmware::Entry& definition() const { return firmware::entry_at(entry); }
  std::uint16_t words() const { return firmware::register_count(definition().type); }
  std::size_t bytes() const { return firmware::bytes_of(definition().type); }
};

enum class RegisterTable : std::uint8_t { holding, input };

/// The values that `count` registers from `address` on consist of. Nothing if one of the registers belongs
/// to no value, or if only a part of a value would be covered.
std::optional<std::vector<RegisterObject>> objects_in(RegisterTable table, std::uint16_t address,
                                                      std::size_t count);

/// A value's registers (high word first) from its object's bytes (low byte first), which must be
/// definition().bytes() or more; the other way round. A COB-ID that has `node` added in the object is without
/// it in the registers, as it is stored.
std::vector<std::uint16_t> registers_from_bytes(const RegisterObject& value, std::uint8_t node,
                                                std::span<const std::uint8_t> bytes);
/// Nothing if the registers hold a number that the value's type has not.
std::optional<std::vector<std::uint8_t>> bytes_from_registers(const RegisterObject& value,
                                                              std::span<const std::uint16_t> registers);

}  // namespace kmax::link
