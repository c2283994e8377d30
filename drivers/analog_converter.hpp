#pragma once

namespace kmax::drivers {

/// The analog-to-digital converter that every driver here reads: codes from 0, which are so many, over a
/// range of 0 to the reference (RM0090, ADC; all boards so far supply it with 3.3 V).
inline constexpr double converter_reference = 3.3;  ///< V
inline constexpr unsigned converter_codes = 4096;

}  // namespace kmax::drivers
