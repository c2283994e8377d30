#pragma once

#include <algorithm>
#include <limits>

#include "firmware/command/parameter_access.hpp"
#include "firmware/drive/armed_axes.hpp"
#include "firmware/drive/axis_state_machine.hpp"

/// What may change while a hand is on a device that makes force: see Change.
namespace kmax::firmware {

namespace armed_change {
/// A bound, and the entry up to which it may be loosened while armed.
struct Ceiling {
  std::uint16_t of, entry;
};
inline constexpr std::size_t ceiling_count = [] {
  std::size_t count = 0;
  for (std::size_t i = 0; i < entry_count; ++i) count += entry_at(i).ceiling.empty() ? 0U : 1U;
  return count;
}();
inline constexpr auto ceilings = [] {
  std::array<Ceiling, ceiling_count> all{};
  std::size_t next = 0;
  for (std::size_t i = 0; i < entry_count; ++i) {
    if (entry_at(i).ceiling.empty()) continue;
    all[next++] = {static_cast<std::uint16_t>(i),
                   static_cast<std::uint16_t>(find_entry(entry_at(i).ceiling))};
  }
  return all;
}();

constexpr float number_of(const SlotDescriptor& descriptor, std::uint32_t raw) {
  return descriptor.type == Type::float32 ? std::bit_cast<float>(raw) : static_cast<float>(raw);
}

/// The greater, the less it protects.
constexpr float looseness(const SlotDescriptor& descriptor, std::uint32_t raw) {
  const float value = number_of(descriptor, raw);
  if (descriptor.unbounded_at_zero() && value == 0.0f) return std::numeric_limits<float>::infinity();
  if (descriptor.change() == Change::only_higher) return -value;
  if (descriptor.change() == Change::only_nearer_zero) return value < 0.0f ? -value : value;
  return value;
}
}  // namespace armed_change

/// Why `by` may not set this value while these axes are armed; none: it may.
constexpr Refusal armed_change_refusal(const ParameterValues& now, const SlotValue& wanted, Link by,
                                       const ArmedAxes& armed) {
  const auto [slot, raw] = wanted;
  const auto [entry, axis] = owner_of(slot);
  const SlotDescriptor& descriptor = descriptors[entry];
  if (!armed.any()) return Refusal::none;
  const bool is_anothers = descriptor.per_axis && by != Link::local && armed.is_anothers(axis, by);
  // Whoever sees danger may disarm; the same word again would keep the axis under force.
  if (entry == entry_of<"drive.controlword">())
    return is_anothers && asks_for_operation(raw & 0xFFFFU) ? Refusal::other_commander : Refusal::none;
  if (raw == now.raw(slot)) return Refusal::none;
  // Such a change restarts every axis' estimators.
  if (descriptor.disarmed_only()) return Refusal::while_armed;
  if (is_anothers && descriptor.of_commander) return Refusal::other_commander;
  const bool fades = descriptor.per_axis && armed.fades[axis];
  // A force that goes does not come back. The number is for the next arming.
  if (fades && descriptor.of_commander && entry != entry_of<"drive.commander">()) return Refusal::while_armed;
  if (descriptor.change() == Change::any_time) return Refusal::none;
  if (descriptor.per_axis && !armed.axis[axis]) return Refusal::none;
  // The other way round is not nearer: within one tick the force would turn.
  const bool turns =
      descriptor.change() == Change::only_nearer_zero &&
      armed_change::number_of(descriptor, raw) * armed_change::number_of(descriptor, now.raw(slot)) < 0.0f;
  float loosest = turns ? 0.0f : armed_change::looseness(descriptor, now.raw(slot));
  // A ceiling is its commander's.
  for (const auto& ceiling : armed_change::ceilings) {
    if (ceiling.of == entry && !is_anothers && !fades)
      loosest = std::max(loosest, std::bit_cast<float>(now.raw(slot_of(ceiling.entry, axis))));
  }
  return armed_change::looseness(descriptor, raw) <= loosest ? Refusal::none : Refusal::only_tightens;
}

}  // namespace kmax::firmware
