#pragma once

#include <cstdint>

// What the factory, and once and for all the board's maker, wrote beside the main flash: RM0090, embedded
// flash memory organisation and device electronic signature.

namespace kmax::drivers::stm32f4 {

/// One-time programmable bytes, 16 blocks of 32, and one lock byte per block.
inline constexpr std::uint32_t otp_base = 0x1FFF'7800;
inline constexpr std::uint32_t otp_bytes = 512;
inline constexpr std::uint32_t otp_lock_base = 0x1FFF'7A00;
inline constexpr std::uint32_t otp_lock_bytes = 16;

/// 96 bits, unique to the chip: wafer coordinates, wafer number, lot.
inline constexpr std::uint32_t unique_id_base = 0x1FFF'7A10;
inline constexpr std::uint32_t unique_id_bytes = 12;

/// 16 bits, in KiB.
inline constexpr std::uint32_t flash_size_base = 0x1FFF'7A22;

}  // namespace kmax::drivers::stm32f4
