#pragma once

#include <array>
#include <cstdint>

#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// Whether a board has an axis; in the numbers of drive.presence.
enum class AxisPresence : std::uint8_t { present, no_answer, declared_absent };

/// What a board measures slowly and counts, for a host to read and for the main loop's trips.
struct BoardReadings {
  std::array<float, axis_count> power_stage_temperature = [] {
    std::array<float, axis_count> at_room_temperature{};
    at_room_temperature.fill(25.0f);
    return at_room_temperature;
  }();  ///< degC
  /// A, what the current sensors of legs B and C read at rest and what is taken off.
  std::array<float, axis_count> offset_b{}, offset_c{};
  float supply_voltage = 0.0f;  ///< V; 0: not measured
  /// Of the supply, that the current controllers may use: what the board's bridge can give, and its current
  /// sensors can follow. A board that does not say it drives no current.
  float modulation_limit = 0.0f;
  std::uint32_t missed_ticks = 0;
  std::uint32_t longest_tick = 0;                      ///< cycles; 0: not measured
  std::uint32_t interference_forgiven = 0;             ///< disturbances of the lines that were not meant
  std::array<bool, axis_count> gate_driver_missing{};  ///< has not answered since the start
  /// What the axis' gate driver said when its fault line last fell, in the bits of drive.gate_driver_faults.
  std::array<std::uint16_t, axis_count> gate_driver_faults{};
  bool has_power_stage = false;     ///< false: forces are ideal, and nothing is commutated
  bool ticks_have_stopped = false;  ///< no tick for a while: nobody else could say so

  /// `declared_absent`: by parameter drive.declared_absent.
  AxisPresence presence(std::size_t axis, bool declared_absent) const {
    if (declared_absent) return AxisPresence::declared_absent;
    return gate_driver_missing[axis] ? AxisPresence::no_answer : AxisPresence::present;
  }
};

}  // namespace kmax::firmware
