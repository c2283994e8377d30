#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "drivers/analog_converter.hpp"

namespace kmax::simulation {

/// What the converter makes of a voltage: the nearest code, and the ends beyond (RM0090, ADC; STM32F405 data
/// sheet, ADC accuracy: transitions lie half a code below the ideal value). Throws std::invalid_argument for
/// a voltage that is not a number.
inline std::uint16_t converter_code(double volts) {
  if (std::isnan(volts)) throw std::invalid_argument("the voltage to convert is not a number");
  constexpr double codes = drivers::converter_codes;
  return static_cast<std::uint16_t>(
      std::clamp(std::floor(volts * (codes / drivers::converter_reference) + 0.5), 0.0, codes - 1.0));
}

}  // namespace kmax::simulation
