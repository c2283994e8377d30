#pragma once

#include <array>
#include <cstdint>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::record {

/// What one axis did at a tick.
struct AxisSample {
  std::uint64_t tick = 0;   ///< when; counted by the device, without wrapping
  double position = 0;      ///< m
  float velocity = 0;       ///< m/s
  float force = 0;          ///< N
  float current = 0;        ///< A
  std::uint16_t flags = 0;  ///< as measured.flags
};

/// A row of a recording. Its tick is that of the first axis that is recorded; axes that were read one after
/// the other have ticks of their own.
struct Row {
  std::uint64_t tick = 0;
  std::array<AxisSample, firmware::axis_count> axes{};
};

}  // namespace kmax::record
