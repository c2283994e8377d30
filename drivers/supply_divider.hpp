#pragma once

#include <cstdint>

// Supply voltage behind a resistive divider, from a 12-bit code.
//
//   volt = code * reference / 4096 * ratio
//
// The reference is 3.3 V. The ratio is that of the supply to the voltage at the tap: 11 has a full scale of
// 36.3 V, 19 one of 62.7 V.

namespace kmax::drivers {

class SupplyDivider {
 public:
  constexpr explicit SupplyDivider(float ratio) : volts_per_code_(3.3F * (1.0F / 4096.0F) * ratio) {}

  constexpr float volts(std::uint32_t code) const { return static_cast<float>(code) * volts_per_code_; }
  /// The supply may be anything above what the code says.
  constexpr bool saturated(std::uint32_t code) const { return code >= 4095; }

 private:
  float volts_per_code_;
};

}  // namespace kmax::drivers
