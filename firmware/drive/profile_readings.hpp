#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "control/finite.hpp"
#include "firmware/drive/axis.hpp"
#include "firmware/drive/cyclic_torque.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "firmware/parameters/linked_parameters.hpp"

namespace kmax::firmware {

/// profile.supported_modes: CiA 402 bit 9, and the manufacturer's bits for haptic and excitation.
inline constexpr std::uint32_t supported_drive_modes = 1u << 9 | 1u << 16 | 1u << 17;

/// profile.digital_inputs, CiA 402: the emergency stop is pressed or its line is open.
inline constexpr std::uint32_t emergency_stop_input = 1u << 16;
/// The encoder's index has been passed since the start.
inline constexpr std::uint32_t index_passed_input = 1u << 18;

/// profile.digital_inputs. The board names one cause at a time, the emergency stop before all others.
constexpr std::uint32_t digital_inputs_of(const AxisReport& report) {
  return (report.condition == Fault::emergency_stop ? emergency_stop_input : 0u) |
         (report.condition == Fault::gate_driver ? 1u << 17 : 0u) |
         (report.referenced ? index_passed_input : 0u);
}

/// The nearest whole number, as the pattern of a value of 32 bits with its sign; what is beyond stays at the
/// end of the range, and what is not a number is 0.
constexpr std::uint32_t integer32_of(float value) {
  if (!(value == value)) return 0;
  if (value >= 2147483648.0f) return 0x7FFF'FFFFu;
  if (value <= -2147483648.0f) return 0x8000'0000u;
  // From 2^23 on all floats are whole, and a half would be rounded itself.
  const float half = control::magnitude(value) < 8388608.0f ? 0.5f : 0.0f;
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(value < 0.0f ? value - half : value + half));
}

/// Likewise for 16 bits.
constexpr std::uint32_t integer16_of(float value) {
  constexpr std::int32_t lowest = std::numeric_limits<std::int16_t>::min(),
                         highest = std::numeric_limits<std::int16_t>::max();
  return static_cast<std::uint32_t>(
      std::clamp(static_cast<std::int32_t>(integer32_of(value)), lowest, highest));
}

/// counts/s from m/s, as exact as float: what is read is an estimate, and division in double is a program of
/// its own on the target.
constexpr float counts_per_second(const ParameterValues& values, std::size_t axis, float velocity) {
  constexpr float turn = 6.28318531f;
  const auto counts =
      static_cast<float>(static_cast<std::uint32_t>(values.whole<"encoder.counts_per_turn">(axis)));
  return velocity * (counts / (turn * values.real<"device.transmission">(axis)));
}

/// What an axis tells in CiA 402's units, from what it tells in SI: profile.*, and telemetry.current. Main
/// loop.
///
/// Torque is that of the measured current as the force at the handle tells it (measured.force_made), so that
/// it is also there on a board with an ideal force source; current is then 0.
constexpr void publish_profile(ParameterValues& values, std::size_t axis, const AxisReport& report) {
  const std::uint32_t milliamperes = rated_current(values, axis),
                      millinewtonmetres = rated_torque(values, axis);
  const float transmission = values.real<"device.transmission">(axis);
  const float current = 1e3f * report.motor.current;                   // mA
  const float torque = 1e3f * report.motor.force_made * transmission;  // mN m
  values.set_whole<"profile.operation_mode_display">(
      static_cast<std::uint32_t>(operation_mode_of(values.whole<"drive.mode">(axis))), axis);
  values.set_whole<"profile.velocity">(integer32_of(counts_per_second(values, axis, report.haptic.velocity)),
                                       axis);
  values.set_whole<"profile.rated_current">(milliamperes, axis);
  values.set_whole<"profile.rated_torque">(millinewtonmetres, axis);
  values.set_whole<"profile.torque">(integer16_of(1e3f * torque / static_cast<float>(millinewtonmetres)),
                                     axis);
  values.set_whole<"profile.current">(integer16_of(1e3f * current / static_cast<float>(milliamperes)), axis);
  values.set_whole<"profile.supported_modes">(supported_drive_modes, axis);
  values.set_whole<"profile.device_type">(device_type_of_axis, axis);
  values.set_whole<"profile.digital_inputs">(digital_inputs_of(report), axis);
  values.set_whole<"telemetry.current">(integer16_of(current), axis);
}

/// The device's own: `flags` are the axes' measured.flags; the low 8 bits of the first two are reported.
/// `tick` is that of the values.
constexpr void publish_telemetry(ParameterValues& values, const std::array<std::uint32_t, axis_count>& flags,
                                 std::uint32_t tick) {
  std::uint32_t first_axes = 0;
  for (std::size_t axis = 0; axis < std::min<std::size_t>(axis_count, 2); ++axis)
    first_axes |= (flags[axis] & 0xFFu) << (8 * axis);
  values.set_whole<"telemetry.flags">(first_axes);
  values.set_whole<"telemetry.tick">(tick & 0xFFFFu);
}

}  // namespace kmax::firmware
