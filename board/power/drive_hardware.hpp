#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

#include "board/description.hpp"
#include "drivers/current_sense.hpp"

namespace kmax::board {

/// What the drives need of a board's chip. What begins with ISR_, and the bridge but for enable_legs(), is
/// called in the tick.
template <typename Hardware>
concept DriveHardware = requires(Hardware& hardware, const Hardware& constant, std::size_t axis, bool level) {
  /// The board's facts, known when this is compiled.
  { Hardware::description } -> std::convertible_to<const BoardDescription&>;

  /// False: an axis that this board does not drive. Its other functions are not called.
  { constant.has(axis) } -> std::same_as<bool>;

  /// An axis' three half-bridges (drivers::stm32f4::ThreePhasePwm). A duty is active from the middle of the
  /// PWM period after the sample on; arm() and disarm() act at once.
  { hardware.bridge(axis).arm() } -> std::same_as<bool>;
  { hardware.bridge(axis).armed() } -> std::same_as<bool>;
  {hardware.bridge(axis).disarm()};
  { hardware.bridge(axis).ISR_set_duty({0.5f, 0.5f, 0.5f}) } -> std::same_as<bool>;
  {hardware.bridge(axis).ISR_set_no_voltage()};
  {hardware.bridge(axis).enable_legs({.a = level})};

  /// Codes of the phase currents of an axis and of the supply, of 12 bits. `slow_age`: ticks since the supply
  /// was converted last.
  { hardware.ISR_sample(axis).valid } -> std::convertible_to<bool>;
  { hardware.ISR_sample(axis).phase_b } -> std::convertible_to<std::uint32_t>;
  { hardware.ISR_sample(axis).phase_c } -> std::convertible_to<std::uint32_t>;
  { hardware.ISR_sample(axis).supply } -> std::convertible_to<std::uint32_t>;
  { hardware.ISR_sample(axis).slow_age } -> std::convertible_to<std::uint8_t>;

  /// Any context: the last codes of the same pins while the axis' high sides conduct, or all its switches are
  /// off. The amplifiers have settled then as far as they have at the other end of the period, since duties
  /// lie as far above 0 as below 1.
  { hardware.zero_current(axis).phase_b } -> std::convertible_to<std::uint32_t>;
  { hardware.zero_current(axis).phase_c } -> std::convertible_to<std::uint32_t>;

  /// The free-running counter of the axis' quadrature lines, and its index line at the same moment.
  { constant.ISR_counter(axis) } -> std::unsigned_integral;
  { constant.ISR_index_line(axis) } -> std::same_as<bool>;

  /// The high side of the brake's half-bridge, on until the next tick at most. Any context.
  {hardware.set_brake(level)};

  // Main loop: codes converted last, and ticks that came too late or not at all.
  { constant.supply_code() } -> std::convertible_to<std::uint32_t>;
  { constant.temperature_code(axis) } -> std::same_as<std::uint16_t>;
  { constant.missed_ticks() } -> std::same_as<std::uint32_t>;
};

}  // namespace kmax::board
