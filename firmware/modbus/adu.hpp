// What a Modbus request is once it has been found in what a line brings: a frame with a good CRC (MODBUS over
// Serial Line V1.02, 2.5.1), whatever divides the bytes into frames: silence on a serial line
// (rtu_receiver.hpp), transfers over USB (transfer_receiver.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace kmax::firmware::modbus {

inline constexpr std::size_t adu_size_max = 256;  // unit, PDU, CRC
inline constexpr std::size_t adu_size_min = 4;    // unit, function, CRC
inline constexpr std::size_t crc_size = 2;

inline constexpr std::uint8_t broadcast_unit = 0;
inline constexpr std::uint8_t unit_max = 247;

// A frame with a good CRC. `pdu` (1..253 bytes) points into the receiver: valid up to the next receive().
struct RtuFrame {
  std::uint8_t unit;
  std::span<const std::uint8_t> pdu;
  std::uint32_t end_us;  // end of the last stop bit, or of the last packet
};

// What was found on the line: each frame, or what was none, raises one of these by one. They wrap.
struct RtuReceiverCounters {
  std::uint32_t frames_received = 0;  // good CRC, whatever the unit
  std::uint32_t crc_errors = 0;
  std::uint32_t line_errors = 0;  // parity, framing or overrun
  std::uint32_t gap_errors = 0;   // silence between t1.5 and t3.5
  std::uint32_t oversize = 0;     // more than 256 bytes
  std::uint32_t undersize = 0;    // fewer than 4 bytes
  std::uint32_t abandoned = 0;    // under way when the timing was changed, or when the line began anew
};

}  // namespace kmax::firmware::modbus
