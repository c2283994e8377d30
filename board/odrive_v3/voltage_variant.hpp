#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/stm32f4/registers/system_memory.hpp"

// The ODrive v3.6 was sold for 24 V and for 56 V. They differ in FETs and in the divider of the supply
// measurement, and in nothing that firmware could measure: the maker wrote the voltage into the
// one-time-programmable area.

namespace kmax::board::odrive_v3 {

enum class VoltageVariant : std::uint8_t { v24, v56 };

/// Reads the maker's record (its layout: registers/system_memory.hpp). Nothing for a blank, damaged or
/// unknown record: the caller then takes what the build says. (The maker's firmware reads the first
/// record only, its tools skip void ones.) `byte_at(i)`: byte i of the area.
template <typename ByteAt>
constexpr std::optional<VoltageVariant> voltage_variant_from_otp(ByteAt byte_at) {
  namespace otp = drivers::stm32f4::odrive_otp;
  for (std::size_t record = 0; record < drivers::stm32f4::otp_bytes; record += otp::record_bytes) {
    const std::uint8_t magic = byte_at(record + otp::magic_offset);
    if (magic == 0x00) continue;
    if (magic != otp::magic || byte_at(record + otp::version_major_offset) != 3) return std::nullopt;
    switch (byte_at(record + otp::voltage_offset)) {
      case 24:
        return VoltageVariant::v24;
      case 48:
      case 56:
        return VoltageVariant::v56;
      default:
        return std::nullopt;
    }
  }
  return std::nullopt;
}

/// For a board whose area is blank: set with -DKMAX_ODRIVE_VOLTAGE=24 or 56 when configuring. 56 is the safe
/// default: read by its divider a 24 V board's supply seems too high, and refuses to arm.
#ifndef KMAX_ODRIVE_VOLTAGE
#define KMAX_ODRIVE_VOLTAGE 56
#endif
static_assert(KMAX_ODRIVE_VOLTAGE == 24 || KMAX_ODRIVE_VOLTAGE == 56, "KMAX_ODRIVE_VOLTAGE must be 24 or 56");
inline constexpr VoltageVariant variant_of_blank_board =
    KMAX_ODRIVE_VOLTAGE == 24 ? VoltageVariant::v24 : VoltageVariant::v56;

/// Ratio of supply to the voltage at the converter's pin: 10 kOhm or 18 kOhm over 1 kOhm.
constexpr float supply_divider_ratio(VoltageVariant variant) {
  return variant == VoltageVariant::v24 ? 11.0f : 19.0f;
}

}  // namespace kmax::board::odrive_v3
