#pragma once

#include <cstdint>

// Supply voltage behind a resistive divider, from a 12-bit code.
//
//   volt = code * reference / 4096 * ratio
//
// ODrive v3.6: 1 kOhm below, 10 kOhm above (ratio 11, full scale 36.3 V) on the 24 V board; 18 kOhm above
// (ratio 19, 62.7 V) on the 56 V board. Nothing on the board tells the variants apart, so the ratio is
// configuration; the wrong one reads 1.7 times too much or 0.58 of the truth.

namespace kmax::drivers {

struct SupplyDividerConfig {
  float ratio = 19.0F;  // supply / voltage at the tap
  float reference_volt = 3.3F;
};

class SupplyDivider {
 public:
  constexpr explicit SupplyDivider(const SupplyDividerConfig& config = {})
      : volts_per_code_(config.reference_volt * (1.0F / 4096.0F) * config.ratio) {}

  constexpr float volts(std::uint16_t code) const { return static_cast<float>(code) * volts_per_code_; }
  /// The supply may be anything above what the code says.
  constexpr bool saturated(std::uint16_t code) const { return code >= 4095; }

 private:
  float volts_per_code_;
};

}  // namespace kmax::drivers
