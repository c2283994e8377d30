#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host_tools/device/device.hpp"

namespace kmax::record {

/// What an axis measures, all of it at one tick.
struct Measurement {
  std::uint32_t tick = 0;
  float position = 0;       ///< m
  float velocity = 0;       ///< m/s
  float force = 0;          ///< N
  float current = 0;        ///< A
  std::uint16_t flags = 0;  ///< as measured.flags
};

/// One for each axis, in the order asked. Each axis is one request on a serial line, which also reads what
/// lies in between: separate requests would be of different ticks. Errors as Device.
std::vector<Measurement> read_measurements(device::Device& device, std::span<const std::size_t> axes);

}  // namespace kmax::record
