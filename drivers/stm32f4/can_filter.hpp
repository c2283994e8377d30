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
// All of these accept data frames only, `can_filter_accept_all` takes everything.

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

constexpr CanFilter can_filter_accept_all(std::uint8_t fifo = 0) {
  return {0, 0, false, fifo};
}

/// 11-bit identifiers that equal `identifier` wherever `mask` is 1.
constexpr CanFilter can_filter_standard(std::uint32_t identifier, std::uint32_t mask, std::uint8_t fifo = 0) {
  return {
      can_identifier::StandardId::bits(identifier),
      can_identifier::StandardId::bits(mask) | can_identifier::Extended::mask | can_identifier::Remote::mask,
      false, fifo};
}

/// The same for 29-bit identifiers.
constexpr CanFilter can_filter_extended(std::uint32_t identifier, std::uint32_t mask, std::uint8_t fifo = 0) {
  return {
      can_identifier::ExtendedId::bits(identifier) | can_identifier::Extended::mask,
      can_identifier::ExtendedId::bits(mask) | can_identifier::Extended::mask | can_identifier::Remote::mask,
      false, fifo};
}

/// Two 11-bit identifiers and no other; the same twice for one.
constexpr CanFilter can_filter_standard_list(std::uint32_t first, std::uint32_t second,
                                             std::uint8_t fifo = 0) {
  return {can_identifier::StandardId::bits(first), can_identifier::StandardId::bits(second), true, fifo};
}

}  // namespace kmax::drivers::stm32f4
