#pragma once

#include <cstddef>
#include <cstdint>

namespace kmax::board {

/// The chip's 96-bit identity folded to 32 bits (FNV-1a over its twelve bytes, low byte of the first word
/// first). The words hold wafer coordinates, wafer number and lot: bits that differ little between
/// neighbours, hence a hash rather than a sum. Two of 1000 boards share a number with probability 1e-4.
constexpr std::uint32_t fold_unique_id(const volatile std::uint32_t* words) {
  std::uint32_t hash = 2'166'136'261U;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t word = words[i];
    for (unsigned shift = 0; shift < 32; shift += 8) hash = (hash ^ ((word >> shift) & 0xFFU)) * 16'777'619U;
  }
  return hash;
}

/// Reads system memory at 0x1FFF7A10: a bus fault where the emulator has no such memory.
inline std::uint32_t serial_number_from_unique_id() {
  // NOLINTNEXTLINE(performance-no-int-to-ptr)
  return fold_unique_id(reinterpret_cast<const volatile std::uint32_t*>(0x1FFF'7A10));
}

}  // namespace kmax::board
