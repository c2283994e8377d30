#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

// How many axes the firmware is built for, a fact of the build and 2 unless it says otherwise. All that is
// linked together is compiled with the same number.
#ifndef KMAX_AXIS_COUNT
#define KMAX_AXIS_COUNT 2
#endif

namespace kmax::firmware {

inline constexpr std::size_t axis_count = KMAX_AXIS_COUNT;

/// Axis n is axis 0 plus n times this (CiA 402's convention for several axes, and its Modbus counterpart).
inline constexpr std::uint16_t axis_index_offset = 0x800;
inline constexpr std::uint16_t axis_modbus_offset = 0x400;
/// Places are kept free for so many: objects 0x2000 to 0x57FF, registers 0x0000 to 0x1BFF. CiA 402 has room
/// for 8.
inline constexpr std::size_t most_axes = 7;
static_assert(axis_count >= 1 && axis_count <= most_axes);

/// How a value is stored and sent. Every value fits 32 bits; a Modbus register holds 16 of them.
/// The numbers are in stored parameters: only ever appended to.
enum class Type : std::uint8_t {
  unsigned8,
  integer8,
  unsigned16,
  unsigned32,
  integer32,
  float32,
  integer16,
};

/// read_only values are measured or fixed; command values act when written (a controlword). communication
/// values are CANopen's own settings: any link reads them, CANopen alone writes them, in the order that CiA
/// 301 asks for.
enum class Access : std::uint8_t { read_only, read_write, communication };

/// When and how a value may be changed; by whom, Group::of_commander says. disarmed_only ones would make the
/// force jump or the scale change under the hand, or cut a commander off. The others bound what a hand may
/// feel, and one direction of theirs is safe: while the axis is armed they go only there (a device entry:
/// while any axis is), or, for their commander, the other way as far as a ceiling that was set before arming.
enum class Change : std::uint8_t {
  any_time,
  disarmed_only,
  only_lower,
  only_higher,
  only_nearer_zero,
};

/// An axis entry exists once per axis (axis n: index + n x 0x800), a device entry once.
enum class Scope : std::uint8_t { axis, device };

struct NamedValue {
  std::string_view name;
  std::int32_t value;
};

/// A record of the dictionary: its entries are sub-indices 1, 2, ... of one index and follow each other
/// without a gap in the Modbus table from `modbus_base` on. Entries are only ever appended, so addresses
/// stay. `of_commander`: what a commander asks of its axis and what the hand there feels; while the axis is
/// armed nobody else changes it, not even where a bound might be tightened: less damping, or less of a
/// background force, can set a hand shaking.
struct Group {
  std::string_view name;
  std::uint16_t index;
  Scope scope;
  std::uint16_t modbus_base;
  bool of_commander = false;
};

/// One row of the object dictionary: the only place where a parameter is defined.
struct Entry {
  std::string_view name;
  Group group;
  std::uint8_t subindex;
  Type type;
  std::string_view unit;  ///< SI; empty: a number or a choice
  double minimum;
  double maximum;
  double default_value;
  std::string_view help;
  Access access = Access::read_write;
  Change change = Change::any_time;
  bool persistent = true;                ///< part of what save keeps, dump writes and defaults restores
  std::span<const NamedValue> values{};  ///< not empty: a choice, and only these values are allowed
  std::uint16_t standard_index = 0;      ///< not 0: an object of CiA 301 or 402 at this index
  std::uint8_t standard_subindex = 0;    ///< its sub-index
  bool node_relative = false;            ///< a COB-ID whose default has the node ID added
  bool unbounded_at_zero = false;        ///< 0 turns this bound off: looser than any other value
  std::string_view ceiling{};            ///< entry up to which it may be loosened while armed; empty: none

  constexpr std::uint16_t index() const { return standard_index != 0 ? standard_index : group.index; }
  constexpr std::uint8_t object_subindex() const {
    return standard_index != 0 ? standard_subindex : subindex;
  }
  constexpr Scope scope() const { return group.scope; }

  constexpr Entry disarmed_only() const {
    Entry e = *this;
    e.change = Change::disarmed_only;
    return e;
  }
  /// While armed only lower, or up to `until`. The other two likewise.
  constexpr Entry only_lower(std::string_view until = {}) const {
    return tightening(Change::only_lower, until);
  }
  constexpr Entry only_higher() const { return tightening(Change::only_higher, {}); }
  constexpr Entry only_nearer_zero(std::string_view until = {}) const {
    return tightening(Change::only_nearer_zero, until);
  }
  constexpr Entry off_at_zero() const {
    Entry e = *this;
    e.unbounded_at_zero = true;
    return e;
  }
  constexpr Entry volatile_value() const {
    Entry e = *this;
    e.persistent = false;
    return e;
  }
  constexpr Entry at_standard_index(std::uint16_t index, std::uint8_t sub = 0) const {
    Entry e = *this;
    e.standard_index = index;
    e.standard_subindex = sub;
    return e;
  }
  constexpr Entry plus_node_id() const {
    Entry e = *this;
    e.node_relative = true;
    return e;
  }
  constexpr Entry of_communication() const {
    Entry e = *this;
    e.access = Access::communication;
    return e;
  }

 private:
  constexpr Entry tightening(Change to, std::string_view until) const {
    Entry e = *this;
    e.change = to;
    e.ceiling = until;
    return e;
  }
};

constexpr std::uint16_t register_count(Type type) {
  return type == Type::unsigned32 || type == Type::integer32 || type == Type::float32 ? 2 : 1;
}

/// Bytes of a value as a CANopen object.
constexpr std::uint8_t bytes_of(Type type) {
  if (register_count(type) == 2) return 4;
  return type == Type::unsigned8 || type == Type::integer8 ? 1 : 2;
}

constexpr bool is_signed(Type type) {
  return type == Type::integer8 || type == Type::integer16 || type == Type::integer32;
}

/// A value's 32-bit pattern from as many bits as its type has, the lowest of `bits`: signed ones keep their
/// sign.
constexpr std::uint32_t extended(Type type, std::uint32_t bits) {
  const int unused = 8 * (4 - bytes_of(type));
  if (!is_signed(type)) return bits << unused >> unused;
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(bits << unused) >> unused);
}

/// A value as its 32-bit pattern, as it is stored and sent. The number must fit the type.
constexpr std::uint32_t raw_from_number(Type type, double number) {
  switch (type) {
    case Type::float32:
      return std::bit_cast<std::uint32_t>(static_cast<float>(number));
    case Type::integer8:
    case Type::integer16:
    case Type::integer32:
      return static_cast<std::uint32_t>(static_cast<std::int32_t>(number));
    case Type::unsigned8:
    case Type::unsigned16:
    case Type::unsigned32:
      break;
  }
  return static_cast<std::uint32_t>(number);
}

constexpr double number_from_raw(Type type, std::uint32_t raw) {
  switch (type) {
    case Type::float32:
      return static_cast<double>(std::bit_cast<float>(raw));
    case Type::integer8:
    case Type::integer16:
    case Type::integer32:
      return static_cast<double>(static_cast<std::int32_t>(raw));
    case Type::unsigned8:
    case Type::unsigned16:
    case Type::unsigned32:
      break;
  }
  return static_cast<double>(raw);
}

// The words of a row, so that the table reads as a table.

constexpr Entry real(std::string_view name, Group group, std::uint8_t subindex, std::string_view unit,
                     double minimum, double maximum, double default_value, std::string_view help) {
  return {name, group, subindex, Type::float32, unit, minimum, maximum, default_value, help};
}

constexpr Entry whole(std::string_view name, Group group, std::uint8_t subindex, Type type,
                      std::string_view unit, double minimum, double maximum, double default_value,
                      std::string_view help) {
  return {name, group, subindex, type, unit, minimum, maximum, default_value, help};
}

constexpr Entry choice(std::string_view name, Group group, std::uint8_t subindex,
                       std::span<const NamedValue> values, std::int32_t default_value,
                       std::string_view help) {
  std::int32_t low = values[0].value, high = values[0].value;
  for (const NamedValue& v : values) {
    low = std::min(low, v.value);
    high = std::max(high, v.value);
  }
  Entry e{name, group,       subindex,     low < 0 ? Type::integer8 : Type::unsigned8,
          "",   double(low), double(high), double(default_value),
          help};
  e.values = values;
  return e;
}

constexpr Entry reading(std::string_view name, Group group, std::uint8_t subindex, Type type,
                        std::string_view unit, std::string_view help) {
  double low = 0, high = 4294967295.0;
  if (type == Type::float32) low = -3.4028234663852886e38, high = 3.4028234663852886e38;
  if (type == Type::integer32) low = -2147483648.0, high = 2147483647.0;
  if (type == Type::integer16) low = -32768, high = 32767;
  if (type == Type::integer8) low = -128, high = 127;
  if (type == Type::unsigned16) high = 65535;
  if (type == Type::unsigned8) high = 255;
  Entry e{name, group, subindex, type, unit, low, high, 0, help};
  e.access = Access::read_only;
  e.persistent = false;
  return e;
}

/// A reading that is one of a few named states.
constexpr Entry named_reading(std::string_view name, Group group, std::uint8_t subindex,
                              std::span<const NamedValue> values, std::string_view help) {
  Entry e = choice(name, group, subindex, values, values[0].value, help);
  e.access = Access::read_only;
  e.persistent = false;
  return e;
}

}  // namespace kmax::firmware
