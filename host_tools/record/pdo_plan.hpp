#pragma once

#include <array>
#include <cstdint>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::record {

/// TPDO 1 to 4 are the rows of a recording.
inline constexpr std::size_t recorded_pdos = 4;

/// How a device sends its measurements, as far as a recording needs it.
struct PdoPlan {
  std::uint8_t node = 1;
  std::array<std::uint32_t, recorded_pdos> identifiers{};
  std::uint32_t period_ticks = 20;                           ///< from one row to the next
  std::array<double, firmware::axis_count> count_lengths{};  ///< m
  std::uint8_t node_state = 0;                               ///< NMT state
  std::uint32_t tick = 0;                                    ///< at the time of reading
  /// PDOs so far that were due again before the bus had room for them: their newer values were sent instead,
  /// so that a row may have values of two moments.
  std::uint32_t held_back = 0;
};

/// Reads from the device how its first four TPDOs are set up. They must have the factory's mapping and be
/// sent together by one event time; identifiers and event time may be others. Errors: base::DeviceError
/// with the first setting that does not fit and how to get the factory's back, device::LinkError.
PdoPlan read_pdo_plan(device::Device& device, std::uint8_t node);

}  // namespace kmax::record
