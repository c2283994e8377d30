#pragma once

#include <array>
#include <cstdint>

namespace kmax::firmware {

/// CRC-32 of ISO/IEC 8802-3 (Ethernet): polynomial 0x04C11DB7, bit-reversed 0xEDB88320, preset to all ones,
/// inverted at the end, over words of 32 bits, low byte first. Finds every error of up to three bits in a
/// parameter record (Hamming distance 4 up to 91,607 bits) and every burst of up to 32 bits.
///
/// Cost: eight look-ups per word in a table of 16 words.
class Crc32 {
 public:
  constexpr void add(std::uint32_t word) {
    state_ ^= word;
    for (int nibble = 0; nibble < 8; ++nibble) state_ = (state_ >> 4U) ^ table[state_ & 0xFU];
  }
  constexpr std::uint32_t value() const { return ~state_; }

 private:
  static constexpr std::array<std::uint32_t, 16> table = [] {
    std::array<std::uint32_t, 16> made{};
    for (std::uint32_t nibble = 0; nibble < made.size(); ++nibble) {
      std::uint32_t rest = nibble;
      for (int bit = 0; bit < 4; ++bit) rest = (rest & 1U) != 0 ? (rest >> 1U) ^ 0xEDB8'8320U : rest >> 1U;
      made[nibble] = rest;
    }
    return made;
  }();

  std::uint32_t state_ = 0xFFFF'FFFFU;
};

}  // namespace kmax::firmware
