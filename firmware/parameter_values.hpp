#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "firmware/object_dictionary/dictionary.hpp"
#include "firmware/refusal.hpp"

namespace kmax::firmware {

/// What the device needs of a dictionary entry at run time; names, units and texts stay on the host.
struct SlotDescriptor {
  std::uint16_t address;  ///< first register of axis 0 or of the device
  Type type;
  bool writable;  ///< through Modbus
  bool kept;      ///< a setting, whoever may write it: part of a set of parameters
  bool disarmed_only;
  bool per_axis;
  std::uint8_t first_choice, choice_count;        ///< in listed_choices; 0 choices: any value in range
  std::uint32_t minimum, maximum, default_value;  ///< patterns
};

inline constexpr std::size_t listed_choice_count = [] {
  std::size_t count = 0;
  for (std::size_t i = 0; i < entry_count; ++i) count += entry_at(i).values.size();
  return count;
}();

inline constexpr auto listed_choices = [] {
  std::array<std::int32_t, listed_choice_count> choices{};
  std::size_t next = 0;
  for (std::size_t i = 0; i < entry_count; ++i) {
    for (const NamedValue& v : entry_at(i).values) choices[next++] = v.value;
  }
  return choices;
}();

inline constexpr auto descriptors = [] {
  std::array<SlotDescriptor, entry_count> all{};
  std::size_t next_choice = 0;
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    all[i] = {modbus_addresses[i],
              e.type,
              e.access == Access::read_write,
              e.access != Access::read_only,
              e.change == Change::disarmed_only,
              e.scope() == Scope::axis,
              static_cast<std::uint8_t>(next_choice),
              static_cast<std::uint8_t>(e.values.size()),
              raw_from_number(e.type, e.minimum),
              raw_from_number(e.type, e.maximum),
              raw_from_number(e.type, e.default_value)};
    next_choice += e.values.size();
  }
  return all;
}();
static_assert(listed_choice_count < 256);

/// First register of an entry, from the compact table.
constexpr std::uint16_t register_address(std::size_t entry, std::size_t axis) {
  return static_cast<std::uint16_t>(descriptors[entry].address +
                                    (descriptors[entry].per_axis ? axis * axis_modbus_offset : 0));
}

/// Whether a pattern is an allowed value of an entry by itself. Compared in the value's own type: in
/// float32 the bounds are the nearest floats of the numbers in the table.
constexpr Refusal check_value(const SlotDescriptor& entry, std::uint32_t raw) {
  if (entry.choice_count != 0) {
    for (std::uint8_t i = 0; i < entry.choice_count; ++i) {
      if (static_cast<std::int32_t>(raw) == listed_choices[entry.first_choice + i]) return Refusal::none;
    }
    return Refusal::not_a_choice;
  }
  bool inside = false;
  if (entry.type == Type::float32) {
    const auto value = std::bit_cast<float>(raw);
    if (!(value - value == 0.0f)) return Refusal::not_finite;
    inside = std::bit_cast<float>(entry.minimum) <= value && value <= std::bit_cast<float>(entry.maximum);
  } else if (is_signed(entry.type)) {
    const auto value = static_cast<std::int32_t>(raw);
    inside = static_cast<std::int32_t>(entry.minimum) <= value &&
             value <= static_cast<std::int32_t>(entry.maximum);
  } else {
    inside = entry.minimum <= raw && raw <= entry.maximum;
  }
  return inside ? Refusal::none : Refusal::out_of_range;
}

/// The present value of every slot, as patterns. Used on the device and, for checking a set before it is
/// sent, on the host.
class ParameterValues {
 public:
  constexpr ParameterValues() {
    for (std::size_t slot = 0; slot < slot_count; ++slot)
      raw_[slot] = descriptors[owner_of(slot).entry].default_value;
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
