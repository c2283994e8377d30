#pragma once

#include <cstdint>

#include "drivers/analog_converter.hpp"

// Supply voltage behind a resistive divider, from a 12-bit code (analog_converter.hpp).
//
//   volt = code * reference / codes * ratio
//
// The ratio is that of the supply to the voltage at the tap: 11 has a full scale of
// 36.3 V, 19 one of 62.7 V.

namespace kmax::drivers {

class SupplyDivider {
 public:
  constexpr explicit SupplyDivider(float ratio)
      : volts_per_code_(static_cast<float>(converter_reference) *
                        (1.0F / static_cast<float>(converter_codes)) * ratio) {}

  constexpr float volts(std::uint32_t code) const { return static_cast<float>(code) * volts_per_code_; }
  /// The supply may be anything above what the code says.
  constexpr bool saturated(std::uint32_t code) const { return code >= converter_codes - 1; }

 private:
  float volts_per_code_;
};

}  // namespace kmax::drivers
