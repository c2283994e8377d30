#pragma once

#include <concepts>
#include <cstdint>
#include <span>

#include "firmware/canopen/abort_code.hpp"

namespace kmax::firmware::canopen {

struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  friend constexpr bool operator==(const ObjectAddress&, const ObjectAddress&) = default;
};

/// What an object is before it is written: its length range in bytes; a number has one length.
struct WriteBounds {
  std::uint32_t shortest = 0;
  std::uint32_t longest = 0;
};

/// The objects behind an SDO server. All checks in CiA 301's order: index, sub-index, access, length, range.
///
///  read_begin   may it be read, and how many bytes is it? Up to 8 bytes are read at once with the first
///               read(); longer ones in pieces that follow each other
///  read         `out.size()` bytes from `offset`, within the size; an abort if the object has changed since
///  write_begin  may it be written at all, and how long may it be? Nothing changes
///  write        the whole value, whose length is within the bounds. Whole or not at all
template <typename T>
concept ObjectAccess = requires(T objects, ObjectAddress address, std::uint32_t& size, std::uint32_t offset,
                                std::span<std::uint8_t> out, WriteBounds& bounds,
                                std::span<const std::uint8_t> in) {
  { objects.read_begin(address, size) } -> std::same_as<Abort>;
  { objects.read(address, offset, out) } -> std::same_as<Abort>;
  { objects.write_begin(address, bounds) } -> std::same_as<Abort>;
  { objects.write(address, in) } -> std::same_as<Abort>;
};

}  // namespace kmax::firmware::canopen
