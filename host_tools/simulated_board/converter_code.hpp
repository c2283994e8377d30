#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace kmax::simulated_board {

/// What a 12-bit converter with a reference of 3.3 V makes of a voltage: the nearest code, and the ends
/// beyond (RM0090, ADC; STM32F405 data sheet, ADC accuracy: transitions lie half a code below the ideal
/// value). Throws std::invalid_argument for a voltage that is not a number.
inline std::uint16_t converter_code(double volts) {
  if (std::isnan(volts)) throw std::invalid_argument("the voltage to convert is not a number");
  return static_cast<std::uint16_t>(std::clamp(std::floor(volts * (4096.0 / 3.3) + 0.5), 0.0, 4095.0));
}

}  // namespace kmax::simulated_board
