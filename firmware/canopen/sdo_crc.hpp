#pragma once

#include <cstdint>
#include <span>

// CRC of SDO block transfers (CiA 301, 7.2.4.3.16): polynomial x^16 + x^12 + x^5 + 1, start value 0, most
// significant bit first, no final exclusive-or. It covers the bytes of the value, never the padding of the
// last segment.
//
// Since the polynomial has so few terms, a byte's eight steps fold into shifts of the whole byte: b ^ b >> 4
// is what leaves at the top, and it comes back at bits 12, 5 and 0. No table; about 7 instructions per byte
// on a Cortex-M4.

namespace kmax::firmware::canopen {

inline constexpr std::uint16_t sdo_crc_start = 0;

/// The CRC after some more bytes; begin with `sdo_crc_start`.
[[nodiscard]] constexpr std::uint16_t sdo_crc(std::uint16_t crc, std::span<const std::uint8_t> bytes) {
  std::uint32_t sum = crc;
  for (const std::uint8_t byte : bytes) {
    std::uint32_t top = (sum >> 8 & 0xFFU) ^ byte;
    top ^= top >> 4;
    sum = sum << 8 ^ top << 12 ^ top << 5 ^ top;
  }
  return static_cast<std::uint16_t>(sum);
}

}  // namespace kmax::firmware::canopen
