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

/// ODrive's record about its board in the OTP: a first byte of 0 voids it and the next record starts 16 bytes
/// on.
namespace odrive_otp {
inline constexpr std::uint32_t record_bytes = 16;
inline constexpr std::uint32_t magic_offset = 0;
inline constexpr std::uint8_t magic = 0xFE;
inline constexpr std::uint32_t version_major_offset = 3;
inline constexpr std::uint32_t version_minor_offset = 4;
inline constexpr std::uint32_t voltage_offset = 5;  // of the variant, in volts: 24 or 56
}  // namespace odrive_otp

}  // namespace kmax::drivers::stm32f4
