#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "drivers/current_sense.hpp"
#include "drivers/ntc_thermistor.hpp"

namespace kmax::board {

/// What code above a board must know of its chip and its power stage: data, written once per board.
struct BoardDescription {
  std::string_view name;            ///< as info.board_name says
  std::uint32_t core_clock_hz;      ///< with which alone the power stage runs
  std::uint32_t timer_clock_hz;     ///< of the PWM
  std::uint16_t half_period_ticks;  ///< steps from no duty to all of it
  std::uint16_t dead_time_ticks;    ///< between the two switches of a leg
  std::uint16_t minimum_low_ticks;  ///< for which a low side must stay on, so that its shunt can be read
  /// Of the supply, for the current controllers, by the amplifiers' gain (drivers::CurrentSenseGain); below
  /// largest_duty().
  std::array<float, 4> modulation_limit;
  double shunt;                             ///< ohm, of a phase current
  drivers::NtcThermistorConfig thermistor;  ///< of a power stage
  double gate_driver_supply_minimum;        ///< V; below it the gate drivers report a fault
  double brake_pulse;                       ///< s, for which a tick switches the brake resistor on

  constexpr double pwm_hz() const { return timer_clock_hz / (2.0 * half_period_ticks); }
  constexpr double dead_time() const { return static_cast<double>(dead_time_ticks) / timer_clock_hz; }  ///< s
  /// The greatest duty of a leg, 0 to 1.
  constexpr double largest_duty() const {
    return static_cast<double>(half_period_ticks - minimum_low_ticks) / half_period_ticks;
  }
  /// Else what the current controllers ask for would be cut off, and they would not know.
  constexpr bool modulation_fits() const {
    return 0.5 + 0.5 * static_cast<double>(*std::ranges::max_element(modulation_limit)) <=
           largest_duty() + 1e-6;
  }
};

/// What is a fact of a board has no default below it, which would be a second place for the fact.
template <typename... Configs>
inline constexpr bool without_defaults = (std::is_trivially_default_constructible_v<Configs> && ...);
static_assert(without_defaults<drivers::CurrentSenseConfig, drivers::NtcThermistorConfig>);

}  // namespace kmax::board
