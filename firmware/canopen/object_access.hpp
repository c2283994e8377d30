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
  std::uint32_t shortest{}, longest{};
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

/// The same for several SDO servers: a write says which one it came by, from 0. version() differs once a
/// value that is read in pieces has become another one, whoever did that.
template <typename T>
concept SharedObjectAccess = requires(T objects, ObjectAddress address, std::uint32_t& size,
                                      std::uint32_t offset, WriteBounds& bounds, std::span<std::uint8_t> out,
                                      std::span<const std::uint8_t> in, std::uint8_t server) {
  { objects.read_begin(address, size) } -> std::same_as<Abort>;
  { objects.read(address, offset, out) } -> std::same_as<Abort>;
  { objects.write_begin(address, bounds) } -> std::same_as<Abort>;
  { objects.write(address, in, server) } -> std::same_as<Abort>;
  { objects.version(address) } -> std::same_as<std::uint32_t>;
};

/// The objects as one of the servers reaches them. An upload of what another one changes meanwhile ends with
/// 0800 0022.
template <SharedObjectAccess Objects>
class ServedObjects {
 public:
  ServedObjects(Objects& objects, std::uint8_t server) : objects_(objects), server_(server) {}

  Abort read_begin(ObjectAddress address, std::uint32_t& size) {
    version_ = objects_.version(address);
    return objects_.read_begin(address, size);
  }
  Abort read(ObjectAddress address, std::uint32_t offset, std::span<std::uint8_t> out) {
    return objects_.version(address) == version_ ? objects_.read(address, offset, out) : Abort::device_state;
  }
  Abort write_begin(ObjectAddress address, WriteBounds& bounds) {
    return objects_.write_begin(address, bounds);
  }
  Abort write(ObjectAddress address, std::span<const std::uint8_t> in) {
    return objects_.write(address, in, server_);
  }

 private:
  Objects& objects_;
  std::uint8_t server_;
  std::uint32_t version_ = 0;
};

}  // namespace kmax::firmware::canopen
