#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host_tools/device/parameter.hpp"

namespace kmax::device {

/// One request: registers that follow each other without a gap, and what they hold.
struct RegisterRange {
  Table table;
  std::uint16_t address;
  std::uint16_t count;
  std::vector<std::size_t> members;  ///< positions in the parameters that were planned, by rising address
};

/// Covers the parameters with as few requests as possible: neighbours together, at most `count_max`
/// registers, no register that was not asked for (most gaps are unassigned, and touching one is refused as
/// a whole), and never half a value. A parameter that is named twice is a member twice.
std::vector<RegisterRange> plan_registers(std::span<const Parameter> parameters, std::uint16_t count_max);

}  // namespace kmax::device
