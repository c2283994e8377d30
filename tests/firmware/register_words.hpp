// Names and numbers as registers, for tests that speak to the dictionary by name.
#pragma once

#include <bit>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware {

using Words = std::vector<std::uint16_t>;

inline std::size_t entry_named(std::string_view name) {
  const std::size_t found = find_entry(name);
  if (found == entry_count) throw std::runtime_error("no entry " + std::string(name));
  return found;
}

inline std::uint16_t address_of(std::string_view name, std::size_t axis = 0) {
  return modbus_address(entry_named(name), axis);
}

inline Words words_of_raw(Type type, std::uint32_t raw) {
  if (register_count(type) == 1) return {static_cast<std::uint16_t>(raw)};
  return {static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint16_t>(raw)};
}

inline Words words_of_float(float value) {
  return words_of_raw(Type::float32, std::bit_cast<std::uint32_t>(value));
}

inline Words words_for(std::string_view name, double number) {
  const Type type = entry_at(entry_named(name)).type;
  return words_of_raw(type, raw_from_number(type, number));
}

/// The number that stands in the registers of `name`.
inline double number_in(std::string_view name, const Words& words) {
  const Type type = entry_at(entry_named(name)).type;
  std::uint32_t raw = words.at(0);
  if (register_count(type) == 2) raw = raw << 16 | words.at(1);
  if (register_count(type) == 1 && is_signed(type))
    raw = static_cast<std::uint32_t>(static_cast<std::int16_t>(words.at(0)));
  return number_from_raw(type, raw);
}

}  // namespace kmax::firmware
