#pragma once

#include <cstdint>

#include "drivers/stm32f4/registers/field.hpp"

namespace kmax::drivers::stm32f4 {

/// Reads `source` until the bits in `mask` equal `expected`; false when they did not within `polls` reads (at
/// least one). The bound is a number of reads because no clock can be trusted while the clocks themselves are
/// being set up.
[[nodiscard]] bool wait_until(const Register auto& source, std::uint32_t mask, std::uint32_t expected,
                              std::uint32_t polls) {
  do {
    if ((static_cast<std::uint32_t>(source) & mask) == expected) return true;
  } while (polls-- > 1);
  return false;
}

}  // namespace kmax::drivers::stm32f4
