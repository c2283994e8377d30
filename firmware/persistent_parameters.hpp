#pragma once

#include <array>
#include <cstdint>

#include "firmware/parameter_values.hpp"

namespace kmax::firmware {

/// Which parameter a stored value belongs to, whatever else the dictionary gains or loses: object index
/// (axis 1's is 0x800 higher), sub-index and type in one word. A parameter whose type has changed is
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
  const Entry& e = entry_at(entry);
  return {static_cast<std::uint16_t>(e.index() + (e.scope() == Scope::axis ? axis * axis_index_offset : 0)),
          e.object_subindex(), e.type};
}

/// One parameter that save keeps.
struct PersistentParameter {
  std::uint32_t identity;
  std::uint16_t slot;
};

inline constexpr std::size_t persistent_count = [] {
  std::size_t count = 0;
  for (std::size_t slot = 0; slot < slot_count; ++slot) count += entry_at(owner_of(slot).entry).persistent;
  return count;
}();

/// All of them, in the order of the slots.
inline constexpr auto persistent_parameters = [] {
  std::array<PersistentParameter, persistent_count> all{};
  std::size_t next = 0;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    if (entry_at(entry).persistent)
      all[next++] = {identity_of(entry, axis).word(), static_cast<std::uint16_t>(slot)};
  }
  return all;
}();

/// The values of all persistent parameters, in the order of `persistent_parameters`.
using PersistentValues = std::array<std::uint32_t, persistent_count>;

constexpr PersistentValues persistent_part(const ParameterValues& values) {
  PersistentValues part{};
  for (std::size_t i = 0; i < persistent_count; ++i) part[i] = values.raw(persistent_parameters[i].slot);
  return part;
}

constexpr void set_defaults(ParameterValues& values) {
  for (const PersistentParameter& parameter : persistent_parameters)
    values.set_raw(parameter.slot, descriptors[owner_of(parameter.slot).entry].default_value);
}

}  // namespace kmax::firmware
