#pragma once

#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// A rule between parameters that is broken, and the slot it is reported on.
struct BrokenRule {
  Refusal refusal = Refusal::none;
  std::size_t slot = 0;
};

/// Checks what no single range can say. Every single value is in its range already.
constexpr BrokenRule check_rules(const ParameterValues& values) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const float rate = values.real<"haptic.rate">(axis);
    const auto divider = static_cast<std::uint32_t>(static_cast<float>(tick_rate_hz) / rate + 0.5f);
    // A quotient that is not whole (20000 Hz / 71) is right when it is the nearest float, or its product is.
    const auto ticks = static_cast<float>(tick_rate_hz), parts = static_cast<float>(divider);
    if (ticks / parts != rate && parts * rate != ticks)
      return {Refusal::rate_does_not_divide, slot_of(entry_of<"haptic.rate">(), axis)};
    if (values.real<"wall.adaptive_force_min">(axis) > values.real<"wall.adaptive_force_max">(axis))
      return {Refusal::adaptive_interval_empty, slot_of(entry_of<"wall.adaptive_force_min">(), axis)};
    const float compensation = values.real<"compensation.limit">(axis);
    if (compensation > 0.0f && !(compensation < values.real<"guard.friction">(axis)))
      return {Refusal::compensation_beyond_friction, slot_of(entry_of<"compensation.limit">(), axis)};
  }
  if (!(values.real<"supply.voltage_min">() < values.real<"supply.voltage_max">()))
    return {Refusal::supply_interval_empty, slot_of(entry_of<"supply.voltage_min">(), 0)};
  const float ceiling = values.real<"supply.ceiling">();
  if (ceiling > 0.0f && values.real<"supply.voltage_max">() > ceiling)
    return {Refusal::supply_above_ceiling, slot_of(entry_of<"supply.voltage_max">(), 0)};
  return {};
}

static_assert(check_rules(ParameterValues{}).refusal == Refusal::none, "the defaults must keep the rules");

}  // namespace kmax::firmware
