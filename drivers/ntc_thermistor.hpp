#pragma once

#include <array>
#include <cstdint>

#include "drivers/analog_converter.hpp"

// Temperature of an NTC thermistor from the converter's reference (top) to the tap, with a resistor from the
// tap to ground: ratiometric, the reference voltage cancels.
//
//   R(T) = R_25 exp(beta (1/T - 1/298.15 K)),   code = 4096 R_ground / (R_ground + R(T))
//
// A table of 129 temperatures at equal steps of the code, made by the compiler from this formula, and
// straight lines between them: one multiplication, no logarithm, no division at run time. 516 bytes of flash
// when the object is constexpr.
//
// Largest difference from the formula with 10 kOhm, beta 3434 and 3.3 kOhm: 0.02 K from 0 to 120 degC, 0.07 K
// from -20 to 150 degC, 0.7 K from -40 to 180 degC. The step of one code is 0.034 K at 25 degC and 0.081 K at
// 120 degC. How far the part follows its beta is the part's matter (+-1 % in beta is 2.4 K at 120 degC).

namespace kmax::drivers {

struct NtcThermistorConfig {
  double resistance_25_ohm;
  double beta_kelvin;
  double ground_resistor_ohm;
  std::uint16_t open_below;     // code
  std::uint16_t shorted_above;  // code
};

enum class NtcState : std::uint8_t {
  ok,
  open,     // no current from the reference: thermistor or its wire broken
  shorted,  // tap at the reference
};

struct NtcReading {
  NtcState state;
  float celsius;  // the end of the range that was left when open or shorted; no measurement then
};

namespace detail {
/// Natural logarithm for x > 0, for the compiler alone: ln x = k ln 2 + 2 artanh((m - 1) / (m + 1)), m in
/// [0.7, 1.4].
consteval double natural_logarithm(double x) {
  constexpr double ln_2 = 0.69314718055994530942;
  double sum = 0.0;
  while (x > 1.4) {
    x *= 0.5;
    sum += ln_2;
  }
  while (x < 0.7) {
    x *= 2.0;
    sum -= ln_2;
  }
  const double y = (x - 1.0) / (x + 1.0);
  double power = y;
  for (int n = 1; n < 40; n += 2) {
    sum += 2.0 * power / n;
    power *= y * y;
  }
  return sum;
}
}  // namespace detail

class NtcThermistor {
 public:
  consteval explicit NtcThermistor(const NtcThermistorConfig& config)
      : open_below_(config.open_below), shorted_above_(config.shorted_above) {
    for (unsigned i = 0; i <= segments; ++i) {
      // The ends have no temperature (R infinite or zero): the nearest code that has.
      const double code = i == 0          ? 1.0
                          : i == segments ? converter_codes - 1.0
                                          : static_cast<double>(i * step);
      const double resistance = config.ground_resistor_ohm * (converter_codes / code - 1.0);
      const double inverse = 1.0 / 298.15 + detail::natural_logarithm(resistance / config.resistance_25_ohm) /
                                                config.beta_kelvin;
      table_[i] = static_cast<float>(1.0 / inverse - 273.15);
    }
  }

  /// Codes 0 to 4095; larger ones read as 4095.
  constexpr NtcReading read(std::uint16_t code) const {
    if (code < open_below_) return {NtcState::open, celsius(open_below_)};
    if (code > shorted_above_) return {NtcState::shorted, celsius(shorted_above_)};
    return {NtcState::ok, celsius(code)};
  }

 private:
  static constexpr unsigned step = 32;
  static constexpr unsigned segments = converter_codes / step;

  constexpr float celsius(std::uint16_t code) const {
    const unsigned bounded = std::uint32_t{code} >= converter_codes ? converter_codes - 1 : code;
    const unsigned i = bounded / step;
    const float fraction = static_cast<float>(bounded % step) * (1.0F / step);
    return table_[i] + (table_[i + 1] - table_[i]) * fraction;
  }

  std::array<float, segments + 1> table_{};
  std::uint16_t open_below_;
  std::uint16_t shorted_above_;
};

}  // namespace kmax::drivers
