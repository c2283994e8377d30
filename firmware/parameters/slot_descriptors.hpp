#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/object_dictionary/dictionary.hpp"

// What the device needs of the dictionary at run time; names, units and texts stay on the host.
//
// Bounds, defaults and lists of choices repeat themselves a lot: 372 entries have 112 different patterns and
// 16 different lists. Each is stored once and a descriptor, 8 bytes, says where. Axis 1's places are axis 0's
// plus an offset and are not stored.

namespace kmax::firmware {

/// Rows of values laid one after the other, each where it is there already. Made when compiled.
template <typename Value, std::size_t capacity>
struct SharedRows {
  Value values[capacity]{};
  std::size_t count = 0;

  /// Where the row begins. Bare loops over bare arrays: the compiler takes each call for a step, in every
  /// file.
  constexpr std::size_t place(std::span<const Value> row) {
    const Value* const wanted = row.data();
    const std::size_t size = row.size();
    for (std::size_t at = 0; at + size <= count; ++at) {
      std::size_t same = 0;
      while (same < size && values[at + same] == wanted[same]) ++same;
      if (same == size) return at;
    }
    for (std::size_t i = 0; i < size; ++i) values[count + i] = wanted[i];
    count += size;
    return count - size;
  }
  constexpr std::size_t place(Value value) { return place(std::span<const Value>(&value, 1)); }
  template <std::size_t size>
  constexpr std::array<Value, size> first() const {
    std::array<Value, size> part{};
    std::copy_n(values, size, part.begin());
    return part;
  }
};

namespace slot_descriptors {

inline constexpr std::size_t most_choices = [] {
  std::size_t count = 0;
  for (std::size_t i = 0; i < entry_count; ++i) count += entry_at(i).values.size();
  return count;
}();

/// Which values an entry may have, has at first, and may change to.
struct ValueRule {
  std::uint8_t first_choice, choice_count;          ///< in listed_choices; 0 choices: any value in range
  std::uint8_t minimum_at, maximum_at, default_at;  ///< in patterns
  Change change;
  bool unbounded_at_zero;
  friend constexpr bool operator==(const ValueRule&, const ValueRule&) = default;
};

/// The rows of all entries, and where each entry's are.
struct Layout {
  SharedRows<std::uint32_t, 3 * entry_count> patterns;
  SharedRows<std::int32_t, most_choices> choices;
  SharedRows<ValueRule, entry_count> rules;
  SharedRows<std::uint16_t, entry_count> groups;
  std::array<std::size_t, entry_count> rule_at{}, group_at{};
};

inline constexpr Layout layout = [] {
  Layout made;
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    std::array<std::int32_t, most_choices> choices{};
    for (std::size_t choice = 0; choice < e.values.size(); ++choice) choices[choice] = e.values[choice].value;
    const auto pattern_at = [&](double number) {
      return static_cast<std::uint8_t>(made.patterns.place(raw_from_number(e.type, number)));
    };
    const auto choices_at = made.choices.place(std::span<const std::int32_t>(choices).first(e.values.size()));
    made.rule_at[i] = made.rules.place(ValueRule{static_cast<std::uint8_t>(choices_at),
                                                 static_cast<std::uint8_t>(e.values.size()),
                                                 pattern_at(e.minimum), pattern_at(e.maximum),
                                                 pattern_at(e.default_value), e.change, e.unbounded_at_zero});
    made.group_at[i] = made.groups.place(e.group.index);
  }
  return made;
}();
// Places are 8 bits wide.
static_assert(layout.patterns.count <= 256 && layout.choices.count <= 256 && layout.rules.count <= 256 &&
              layout.groups.count <= 256);

inline constexpr auto patterns = layout.patterns.first<layout.patterns.count>();
inline constexpr auto rules = layout.rules.first<layout.rules.count>();

}  // namespace slot_descriptors

/// What the values of choices may be.
inline constexpr auto listed_choices =
    slot_descriptors::layout.choices.first<slot_descriptors::layout.choices.count>();

struct SlotDescriptor {
  std::uint16_t address;  ///< first register, of axis 0 or of the device
  std::uint16_t index;    ///< as an object, likewise
  std::uint8_t subindex;
  Type type : 3;
  bool writable : 1;  ///< through Modbus
  bool kept : 1;      ///< a setting, whoever may write it: part of a set of parameters
  bool per_axis : 1;
  bool persistent : 1;    ///< part of what save keeps
  bool of_commander : 1;  ///< while its axis is armed only the link that armed it changes it
  std::uint8_t group;     ///< the same number for all entries of a group
  std::uint8_t rule_at;

  /// The values that are allowed if it is a choice; otherwise none, and any value in range is.
  constexpr std::span<const std::int32_t> choices() const {
    return std::span(listed_choices).subspan(rule().first_choice, rule().choice_count);
  }
  constexpr std::uint32_t minimum() const { return slot_descriptors::patterns[rule().minimum_at]; }
  constexpr std::uint32_t maximum() const { return slot_descriptors::patterns[rule().maximum_at]; }
  constexpr std::uint32_t default_value() const { return slot_descriptors::patterns[rule().default_at]; }
  constexpr Change change() const { return rule().change; }
  constexpr bool disarmed_only() const { return change() == Change::disarmed_only; }
  constexpr bool unbounded_at_zero() const { return rule().unbounded_at_zero; }

 private:
  constexpr const slot_descriptors::ValueRule& rule() const { return slot_descriptors::rules[rule_at]; }
};
static_assert(sizeof(SlotDescriptor) == 8);

inline constexpr auto descriptors = [] {
  std::array<SlotDescriptor, entry_count> all{};
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    all[i] = SlotDescriptor{modbus_addresses[i],
                            e.index(),
                            e.object_subindex(),
                            e.type,
                            e.access == Access::read_write,
                            e.access != Access::read_only,
                            e.scope() == Scope::axis,
                            e.persistent,
                            e.group.of_commander,
                            static_cast<std::uint8_t>(slot_descriptors::layout.group_at[i]),
                            static_cast<std::uint8_t>(slot_descriptors::layout.rule_at[i])};
  }
  return all;
}();

}  // namespace kmax::firmware
