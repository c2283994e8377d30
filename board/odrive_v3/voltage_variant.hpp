#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/stm32f4/registers/system_memory.hpp"

// The ODrive v3.6 was sold for 24 V and for 56 V. They differ in FETs, capacitors and the divider of the
// supply measurement, and in nothing that firmware could measure: the maker wrote the voltage into the
// one-time-programmable area.

namespace kmax::board::odrive_v3 {

enum class VoltageVariant : std::uint8_t { v24, v56 };

/// The maker's record about the board: a first byte of 0 voids it and the next record starts 16 bytes on.
namespace otp {
inline constexpr std::uint32_t record_bytes = 16;
inline constexpr std::uint32_t magic_offset = 0;
inline constexpr std::uint8_t magic = 0xFE;
inline constexpr std::uint32_t version_major_offset = 3;
inline constexpr std::uint32_t version_minor_offset = 4;
inline constexpr std::uint32_t voltage_offset = 5;  // of the variant, in volts: 24 or 56
}  // namespace otp

/// Where the maker's record of a v3 begins. Nothing for a blank, damaged or unknown one. (The maker's firmware
/// reads the first record only, its tools skip void ones.)
/// `byte_at(i)`: byte i of the area.
template <typename ByteAt>
constexpr std::optional<std::size_t> maker_record(ByteAt byte_at) {
  for (std::size_t record = 0; record < drivers::stm32f4::otp_bytes; record += otp::record_bytes) {
    const std::uint8_t magic = byte_at(record + otp::magic_offset);
    if (magic == 0x00) continue;
    if (magic != otp::magic || byte_at(record + otp::version_major_offset) != 3) return std::nullopt;
    return record;
  }
  return std::nullopt;
}

/// As the maker's record says; nothing: the caller takes what the build says.
template <typename ByteAt>
constexpr std::optional<VoltageVariant> voltage_variant_from_otp(ByteAt byte_at) {
  const auto record = maker_record(byte_at);
  if (!record) return std::nullopt;
  switch (byte_at(*record + otp::voltage_offset)) {
    case 24:
      return VoltageVariant::v24;
    case 48:
    case 56:
      return VoltageVariant::v56;
    default:
      return std::nullopt;
  }
}

/// Boards before v3.5 have no resistors that hold the brake chopper's gates down (PB10, PB11), which the
/// boot loader in ROM pulls up for its serial port: the maker's firmware never enters it there. A blank area
/// says nothing: then it is the v3.6 of the build. Of a record that is damaged or unknown, the worst is
/// assumed.
template <typename ByteAt>
constexpr bool boot_loader_is_safe(ByteAt byte_at) {
  constexpr std::uint8_t first_safe_minor = 5, blank = 0xFF;
  const auto record = maker_record(byte_at);
  return record ? byte_at(*record + otp::version_minor_offset) >= first_safe_minor : byte_at(0) == blank;
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

/// The variant that has this divider.
constexpr std::optional<VoltageVariant> variant_with_divider(double ratio) {
  for (const VoltageVariant variant : {VoltageVariant::v24, VoltageVariant::v56}) {
    if (ratio == static_cast<double>(supply_divider_ratio(variant))) return variant;
  }
  return std::nullopt;
}

/// What a variant is sold for and what its parts bear, V. Parts list of v3.4 for the MOSFETs (NTMFS4935N,
/// NTMFS5C628NL) and the 25 V capacitors; those of the 56 V board are from memory.
struct PartRatings {
  float supply, capacitors, mosfets;

  /// What an aluminium capacitor bears for seconds, as when a motor brakes (IEC 60384-4: 1.15 x rated).
  constexpr float capacitor_surge() const { return 1.15f * capacitors; }
  constexpr float weakest() const { return capacitor_surge() < mosfets ? capacitor_surge() : mosfets; }
};
constexpr PartRatings part_ratings(VoltageVariant variant) {
  return variant == VoltageVariant::v24 ? PartRatings{24.0f, 25.0f, 30.0f} : PartRatings{56.0f, 63.0f, 60.0f};
}

/// V, at which the drive trips whatever its parameters say: 7 % above the nominal supply, where the vendor's
/// firmware does (25.7 and 59.9 V), but so far below the weakest part that what is returned until the bridges
/// are off does not reach it: 20 A into 1 mF for two ticks, 100 us, 2 V.
constexpr float supply_ceiling(VoltageVariant variant) {
  const PartRatings parts = part_ratings(variant);
  const float of_vendor = 1.07f * parts.supply, of_parts = parts.weakest() - 2.0f;
  return of_vendor < of_parts ? of_vendor : of_parts;
}

}  // namespace kmax::board::odrive_v3
