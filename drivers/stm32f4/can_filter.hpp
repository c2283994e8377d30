#pragma once

#include <cstdint>

#include "drivers/can_frame.hpp"
#include "drivers/stm32f4/registers/can.hpp"

// Acceptance filters of bxCAN, one bank each, in 32-bit scale. RM0090 chapter on bxCAN, section Identifier
// filtering.
//
// A frame goes to the FIFO of the filter that accepts it. If several do, a list takes priority over a mask,
// then the lower bank over the higher. What no filter accepts is not received at all.
//
// The filter without an identifier or a mask, CanFilter{}, accepts everything.

namespace kmax::drivers::stm32f4 {

struct CanFilter {
  std::uint32_t first = 0;   ///< FR1: identifier
  std::uint32_t second = 0;  ///< FR2: mask, or second identifier
  bool list = false;
  std::uint8_t fifo = 0;  ///< 0 or 1
};

/// The layout that TIR, RIR and the filters share.
constexpr std::uint32_t can_identifier_word(const CanFrame& frame) {
  return (frame.extended ? can_identifier::ExtendedId::bits(frame.identifier) | can_identifier::Extended::mask
                         : can_identifier::StandardId::bits(frame.identifier)) |
         (frame.remote ? can_identifier::Remote::mask : 0U);
}

/// Data frames of two 11-bit identifiers and no other; the same twice for one.
constexpr CanFilter can_filter_standard_list(std::uint32_t first, std::uint32_t second,
                                             std::uint8_t fifo = 0) {
  return {can_identifier::StandardId::bits(first), can_identifier::StandardId::bits(second), true, fifo};
}

}  // namespace kmax::drivers::stm32f4
