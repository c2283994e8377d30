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

namespace kmax::simulation {

// Defaults: ODrive v3.6 (NCP15XH103).
struct TemperatureSensorConfig {
  double resistance_25 = 10'000.0;   // ohm at 25 degC
  double beta = 3434.0;              // K
  double ground_resistor = 3'300.0;  // ohm
};

class TemperatureSensor {
 public:
  enum class Wiring : std::uint8_t { intact, open, shorted };
  static constexpr double reference = 3.3;  // V

  explicit TemperatureSensor(const TemperatureSensorConfig& config = {}) : config_(config) {}

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
    if (wiring_ == Wiring::shorted) return reference;
    const double ratio = std::exp(config_.beta * (1.0 / (celsius_ + 273.15) - 1.0 / 298.15));
    return reference * config_.ground_resistor / (config_.ground_resistor + config_.resistance_25 * ratio);
  }

 private:
  TemperatureSensorConfig config_;
  double celsius_ = 25.0;
  Wiring wiring_ = Wiring::intact;
};

}  // namespace kmax::simulation
