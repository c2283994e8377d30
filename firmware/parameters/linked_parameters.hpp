#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// Two parameters of an axis that are one thing: in this device's numbers and in CiA 402's. They always
/// agree; writing either sets the other.
struct LinkedParameters {
  struct Value {
    std::int32_t own, standard;
  };
  std::size_t own, standard;  ///< entries of an axis
  std::span<const Value> values;
};

namespace linked_values {
inline constexpr LinkedParameters::Value modes[] = {{0, -1}, {1, -2}, {2, 10}};
/// Bits 7 and 6: of position and of velocity.
inline constexpr LinkedParameters::Value polarities[] = {{1, 0x00}, {-1, 0xC0}};
}  // namespace linked_values

inline constexpr std::array linked_parameters = std::to_array<LinkedParameters>({
    {entry_of<"drive.mode">(), entry_of<"profile.operation_mode">(), linked_values::modes},
    {entry_of<"encoder.direction">(), entry_of<"profile.polarity">(), linked_values::polarities},
});

/// The standard's number of drive.mode, which must be one of its choices.
constexpr std::int32_t operation_mode_of(std::int32_t drive_mode) {
  for (const LinkedParameters::Value& value : linked_values::modes) {
    if (value.own == drive_mode) return value.standard;
  }
  return 0;  // CiA 402: no mode
}

/// Makes the partner of `slot` agree with it. Its slot, if it has a partner; `slot` must hold an allowed
/// value.
constexpr std::optional<std::size_t> set_partner(ParameterValues& values, std::size_t slot) {
  const auto [entry, axis] = owner_of(slot);
  for (const LinkedParameters& pair : linked_parameters) {
    if (entry != pair.own && entry != pair.standard) continue;
    const auto number = static_cast<std::int32_t>(values.raw(slot));
    const std::size_t partner = slot_of(entry == pair.own ? pair.standard : pair.own, axis);
    for (const LinkedParameters::Value& value : pair.values) {
      if (number != (entry == pair.own ? value.own : value.standard)) continue;
      values.set_raw(partner, static_cast<std::uint32_t>(entry == pair.own ? value.standard : value.own));
    }
    return partner;
  }
  return std::nullopt;
}

/// Makes all pairs of a set that comes from elsewhere agree: the one that differs from `now` was meant; if
/// both differ, this device's own, which is the one that is kept by save.
constexpr void make_partners_agree(ParameterValues& wanted, const ParameterValues& now) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    for (const LinkedParameters& pair : linked_parameters) {
      const std::size_t own = slot_of(pair.own, axis), standard = slot_of(pair.standard, axis);
      const bool by_standard = wanted.raw(own) == now.raw(own) && wanted.raw(standard) != now.raw(standard);
      set_partner(wanted, by_standard ? standard : own);
    }
  }
}

static_assert(std::all_of(linked_parameters.begin(), linked_parameters.end(),
                          [](const LinkedParameters& pair) {
                            const Entry &own = entry_at(pair.own), &standard = entry_at(pair.standard);
                            const auto covers = [&](const Entry& entry, auto number) {
                              return entry.values.size() == pair.values.size() &&
                                     std::all_of(
                                         entry.values.begin(), entry.values.end(), [&](const NamedValue& v) {
                                           return std::count_if(pair.values.begin(), pair.values.end(),
                                                                [&](const auto& of) {
                                                                  return number(of) == v.value;
                                                                }) == 1;
                                         });
                            };
                            const auto agree = [&](const LinkedParameters::Value& of) {
                              return (of.own == own.default_value) == (of.standard == standard.default_value);
                            };
                            return covers(own, [](const auto& of) { return of.own; }) &&
                                   covers(standard, [](const auto& of) { return of.standard; }) &&
                                   std::all_of(pair.values.begin(), pair.values.end(), agree) &&
                                   own.change == standard.change && own.access == standard.access &&
                                   own.scope() == Scope::axis && standard.scope() == Scope::axis;
                          }),
              "every choice of a pair must have its counterpart, and the defaults must agree");

}  // namespace kmax::firmware
