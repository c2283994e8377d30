#pragma once
// An NTC thermistor from the 3.3 V reference to the converter's pin, a resistor from the pin to ground:
//
//   R = R_25 exp(beta (1/T - 1/298.15 K)),   pin = 3.3 V x R_ground / (R_ground + R)
//
// Also its faults: the thermistor or its wire broken (0 V), and shorted (3.3 V).

#include <cmath>
#include <cstdint>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/analog_converter.hpp"
#include "drivers/ntc_thermistor.hpp"

namespace kmax::simulation {

class TemperatureSensor {
 public:
  enum class Wiring : std::uint8_t { intact, open, shorted };

  explicit TemperatureSensor(const drivers::NtcThermistorConfig& config) : config_(config) {}

  // degC, -100 to 500. Throws std::invalid_argument.
  void set_temperature(double celsius) {
    if (!(celsius >= -100.0 && celsius <= 500.0))
      throw std::invalid_argument(fmt::format("temperature = {} degC: allowed is -100 to 500 degC", celsius));
    celsius_ = celsius;
  }
  double temperature() const { return celsius_; }
  void set_wiring(Wiring wiring) { wiring_ = wiring; }

  // V. One exponential: for the rate at which temperatures are read.
  double pin_voltage() const {
    if (wiring_ == Wiring::open) return 0.0;
    if (wiring_ == Wiring::shorted) return drivers::converter_reference;
    const double ratio = std::exp(config_.beta_kelvin * (1.0 / (celsius_ + 273.15) - 1.0 / 298.15));
    const double ground = config_.ground_resistor_ohm;
    return drivers::converter_reference * ground / (ground + config_.resistance_25_ohm * ratio);
  }

 private:
  drivers::NtcThermistorConfig config_;
  double celsius_ = 25.0;
  Wiring wiring_ = Wiring::intact;
};

}  // namespace kmax::simulation
