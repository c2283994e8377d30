#pragma once

#include <cstdint>
#include <vector>

#include "drivers/can_frame.hpp"

namespace kmax::virtual_board {

/// A frame as the bits that go over the bus, from start of frame to end of frame, stuff bits included: ISO
/// 11898-1, sections on frame formats, bit stuffing and the CRC sequence. False is dominant.
struct CanFrameBits {
  std::vector<bool> bits;
  unsigned arbitration_end = 0;  ///< bits that take part in the arbitration, stuff bits included
  unsigned acknowledge_slot = 0;
};

CanFrameBits can_frame_bits(const drivers::CanFrame& frame);

/// Recessive bits between two frames.
inline constexpr unsigned can_intermission_bits = 3;

/// CRC-15 with the polynomial 0x4599 over bits that are not stuffed.
std::uint16_t can_crc(const std::vector<bool>& bits);

}  // namespace kmax::virtual_board
