#pragma once

#include <array>
#include <cstdint>

#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// Which parameter a stored value belongs to, whatever else the dictionary gains or loses: object index
/// (axis n's is n x 0x800 higher), sub-index and type in one word. A parameter whose type has changed is
/// another one: its old pattern would mean another number.
struct ParameterIdentity {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  Type type = Type::unsigned8;

  constexpr std::uint32_t word() const {
    return (std::uint32_t{index} << 16) | (std::uint32_t{subindex} << 8) | static_cast<std::uint32_t>(type);
  }
  static constexpr ParameterIdentity of_word(std::uint32_t word) {
    return {static_cast<std::uint16_t>(word >> 16), static_cast<std::uint8_t>(word >> 8),
            static_cast<Type>(word & 0xFFu)};
  }
};

constexpr ParameterIdentity identity_of(std::size_t entry, std::size_t axis) {
  const SlotDescriptor& d = descriptors[entry];
  return {static_cast<std::uint16_t>(d.index + (d.per_axis ? axis * axis_index_offset : 0)), d.subindex,
          d.type};
}

inline constexpr std::size_t persistent_count = [] {
  std::size_t count = 0;
  for (std::size_t slot = 0; slot < slot_count; ++slot) count += descriptors[owner_of(slot).entry].persistent;
  return count;
}();

/// The parameters that save keeps, in the order of the slots.
inline constexpr auto persistent_slots = [] {
  std::array<std::uint16_t, persistent_count> all{};
  std::size_t next = 0;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    if (descriptors[owner_of(slot).entry].persistent) all[next++] = static_cast<std::uint16_t>(slot);
  }
  return all;
}();

/// ParameterIdentity::word() of the i-th of them.
constexpr std::uint32_t persistent_identity(std::size_t i) {
  const auto [entry, axis] = owner_of(persistent_slots[i]);
  return identity_of(entry, axis).word();
}

/// Likewise of the write lock's code, which is kept beside them and is no value of the dictionary: nothing
/// that reads values can reach it.
inline constexpr std::uint32_t lock_code_identity = identity_of(entry_of<"lock.code">(), 0).word();

/// The values of all persistent parameters, in the order of `persistent_slots`.
using PersistentValues = std::array<std::uint32_t, persistent_count>;

constexpr PersistentValues persistent_part(const ParameterValues& values) {
  PersistentValues part{};
  for (std::size_t i = 0; i < persistent_count; ++i) part[i] = values.raw(persistent_slots[i]);
  return part;
}

constexpr void set_defaults(ParameterValues& values) {
  for (const std::size_t slot : persistent_slots)
    values.set_raw(slot, descriptors[owner_of(slot).entry].default_value());
}

}  // namespace kmax::firmware
