#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "firmware/object_dictionary/dictionary.hpp"
#include "firmware/parameters/refusal.hpp"
#include "firmware/parameters/slot_descriptors.hpp"

namespace kmax::firmware {

/// A value of the device: a slot of the object dictionary (slot_of) and the 32 bits that are in it.
struct SlotValue {
  std::size_t slot;
  std::uint32_t raw;
};

/// CANopen's own settings are the last slots.
inline constexpr std::size_t first_communication_slot = slot_count - communication_entries.size();

/// First register of an entry, from the compact table.
constexpr std::uint16_t register_address(std::size_t entry, std::size_t axis) {
  return static_cast<std::uint16_t>(descriptors[entry].address +
                                    (descriptors[entry].per_axis ? axis * axis_modbus_offset : 0));
}

/// Whether a pattern is an allowed value of an entry by itself. Compared in the value's own type: in
/// float32 the bounds are the nearest floats of the numbers in the table.
constexpr Refusal check_value(const SlotDescriptor& entry, std::uint32_t raw) {
  if (const auto choices = entry.choices(); !choices.empty()) {
    const auto found = std::find(choices.begin(), choices.end(), static_cast<std::int32_t>(raw));
    return found != choices.end() ? Refusal::none : Refusal::not_a_choice;
  }
  bool inside{};
  if (entry.type == Type::float32) {
    const auto value = std::bit_cast<float>(raw);
    if (!(value - value == 0.0f)) return Refusal::not_finite;
    inside = std::bit_cast<float>(entry.minimum()) <= value && value <= std::bit_cast<float>(entry.maximum());
  } else if (is_signed(entry.type)) {
    const auto value = static_cast<std::int32_t>(raw);
    inside = static_cast<std::int32_t>(entry.minimum()) <= value &&
             value <= static_cast<std::int32_t>(entry.maximum());
  } else {
    inside = entry.minimum() <= raw && raw <= entry.maximum();
  }
  return inside ? Refusal::none : Refusal::out_of_range;
}

/// The present value of every slot, as patterns. Used on the device and, for checking a set before it is
/// sent, on the host.
class ParameterValues {
 public:
  constexpr ParameterValues() {
    for (std::size_t slot = 0; slot < slot_count; ++slot)
      raw_[slot] = descriptors[owner_of(slot).entry].default_value();
  }

  constexpr std::uint32_t raw(std::size_t slot) const { return raw_[slot]; }
  constexpr void set_raw(std::size_t slot, std::uint32_t raw) { raw_[slot] = raw; }

  /// A float32 parameter by its name, checked when compiled.
  template <FixedName name>
  constexpr float real(std::size_t axis = 0) const {
    static_assert(entry_at(entry_of<name>()).type == Type::float32);
    return std::bit_cast<float>(raw_[slot_of(entry_of<name>(), axis)]);
  }
  /// Any other parameter by its name, as a signed number (unsigned32 ones: cast back).
  template <FixedName name>
  constexpr std::int32_t whole(std::size_t axis = 0) const {
    static_assert(entry_at(entry_of<name>()).type != Type::float32);
    return static_cast<std::int32_t>(raw_[slot_of(entry_of<name>(), axis)]);
  }
  template <typename Enumeration, FixedName name>
  constexpr Enumeration choice(std::size_t axis = 0) const {
    return static_cast<Enumeration>(whole<name>(axis));
  }
  template <FixedName name>
  constexpr void set_real(float value, std::size_t axis = 0) {
    static_assert(entry_at(entry_of<name>()).type == Type::float32);
    raw_[slot_of(entry_of<name>(), axis)] = std::bit_cast<std::uint32_t>(value);
  }
  template <FixedName name>
  constexpr void set_whole(std::uint32_t value, std::size_t axis = 0) {
    static_assert(entry_at(entry_of<name>()).type != Type::float32);
    raw_[slot_of(entry_of<name>(), axis)] = value;
  }

 private:
  std::array<std::uint32_t, slot_count> raw_{};
};

}  // namespace kmax::firmware
