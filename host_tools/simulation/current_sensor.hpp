#pragma once
// The current sensors of one axis: shunts between the lower FETs of the legs B and C and ground, an amplifier
// each, and what the converter's pins then see. Leg A has none.
//
//   pin = 1.65 V + offset + gain x (shunt x current + noise), bounded to 0 .. 3.3 V
//
// Current into the motor reads above the middle. It passes the shunt only while the lower FET or its diode
// conducts; at other times the shunt's voltage is 0. The amplifier's filter and settling time (about 1 us)
// are not modelled: sample well after the edges. Quantization is the converter's, not done here.
//
// The noise is the amplifier's own, referred to its input, so it grows with the gain; it is white from sample
// to sample and the same for the same seed on every machine (noise_generator.hpp).

#include <array>
#include <cstdint>
#include <optional>

#include "host_tools/simulation/model_field.hpp"
#include "host_tools/simulation/noise_generator.hpp"

namespace kmax::simulation {

// Defaults: ODrive v3.6, DRV8301 at its gain of 40 V/V; no defects.
struct CurrentSensorConfig {
  double shunt = 0.5e-3;  // ohm
  double gain = 40.0;     // V/V, until set_gain()
  double noise = 0.0;     // V at the amplifier's input, standard deviation; 10 uV is 20 mA with 0.5 mOhm
  double offset_b = 0.0;  // V at the pin
  double offset_c = 0.0;  // V at the pin
};

inline constexpr std::array current_sensor_fields{
    ModelField<CurrentSensorConfig>{"shunt", &CurrentSensorConfig::shunt, 1e-6, 1.0, "ohm"},
    ModelField<CurrentSensorConfig>{"gain", &CurrentSensorConfig::gain, 1.0, 1000.0, "V/V"},
    ModelField<CurrentSensorConfig>{"noise", &CurrentSensorConfig::noise, 0.0, 1.0, "V"},
    ModelField<CurrentSensorConfig>{"offset_b", &CurrentSensorConfig::offset_b, -1.65, 1.65, "V"},
    ModelField<CurrentSensorConfig>{"offset_c", &CurrentSensorConfig::offset_c, -1.65, 1.65, "V"},
};

class CurrentSensor {
 public:
  enum class Channel : std::uint8_t { b, c };
  static constexpr double reference = 3.3;  // V, of the converter and of the amplifiers

  // Throws std::invalid_argument.
  explicit CurrentSensor(const CurrentSensorConfig& config = {}, std::uint64_t seed = 1);

  // V at the converter's pin. `shunt_current`: A, 0 while nothing conducts below. Every call is one sample:
  // it draws new noise. A current that is not finite throws std::invalid_argument.
  double sample(Channel channel, double shunt_current);

  // The gate driver's settings. Throws std::invalid_argument for a gain outside the range of the table.
  void set_gain(double gain);
  double gain() const { return config_.gain; }
  // Shorts the amplifier's inputs (DC_CAL): the pin shows the offset and the noise alone.
  void short_inputs(Channel channel, bool shorted) { shorted_[static_cast<std::size_t>(channel)] = shorted; }
  // Defect: the shunt's wires are exchanged, so that the current reads with the wrong sign.
  void invert(Channel channel, bool inverted) { inverted_[static_cast<std::size_t>(channel)] = inverted; }
  // Defect: the pin stands at this voltage, bounded to 0 .. 3.3 V, whatever flows. None: mended.
  void set_stuck(Channel channel, std::optional<double> volts) {
    stuck_[static_cast<std::size_t>(channel)] = volts;
  }
  // Defect: no amplifier drives the pins. They drift about the middle, as inputs do that pick up their
  // surroundings (a guess: 50 mV of noise, a drift that covers half of the range within 0.1 s).
  void set_floating(bool floating) { floating_ = floating; }

  const CurrentSensorConfig& config() const { return config_; }

 private:
  CurrentSensorConfig config_;
  std::array<bool, 2> shorted_{};
  std::array<bool, 2> inverted_{};
  std::array<std::optional<double>, 2> stuck_{};
  bool floating_ = false;
  std::array<double, 2> drift_{};  // V, of pins that float
  std::array<NoiseGenerator, 2> noise_;
};

}  // namespace kmax::simulation
