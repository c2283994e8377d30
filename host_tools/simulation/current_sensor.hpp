#pragma once
// The current sensors of one axis: shunts between the lower FETs of the legs B and C and ground, an amplifier
// each, and what the converter's pins then see. Leg A has none.
//
//   pin = 1.65 V + offset + gain x (drift x (T - 25 degC) + driven + (1 + gain error) x shunt x current +
//         noise), bounded to 0 .. 3.3 V
//
// Current into the motor reads above the middle. It passes the shunt only while the lower FET or its diode
// conducts; at other times the shunt's voltage is 0. Quantization is the converter's, not done here.
//
// Settling: after the lower FET's command changes, nothing happens for `delay`; then the shunt's voltage
// steps, and passes the filter before the amplifier and the amplifier, two low-passes one after the other.
// What is left of the step after 1.5, 2.5 and 3.75 us (half of the low side's time at a duty of 0.94, 0.90
// and 0.85), of which the dead time of 0.125 us is lost: 20, 3 and 0.3 % at a gain of 80.
//
// The noise is the amplifier's own, referred to its input, so it grows with the gain; it is white from sample
// to sample and the same for the same seed on every machine (noise_generator.hpp).

#include <array>
#include <cstdint>
#include <optional>

#include "board/odrive_v3/description.hpp"
#include "host_tools/simulation/model_field.hpp"
#include "host_tools/simulation/noise_generator.hpp"

namespace kmax::simulation {

// Defaults: ODrive v3.6, DRV8301 at its gain of 40 V/V; no defects. The filter is the schematic's (ODrive
// v3.5: 120 ohm and 2.2 nF before the amplifier, 22 ohm and 2.2 nF behind it, whose 48 ns are in the delay),
// the settling the DRV8301's (0.3, 0.6, 1.2 and 2.4 us to 1 % at its gains). Guesses: the drift, and what the
// gate driver takes of the delay, 130 ns. Of the worst board, also by guess: offset 4 mV x gain, driven
// 0.1 mV, gains that differ by 6 %.
struct CurrentSensorConfig {
  double shunt = board::odrive_v3::description.shunt;  // ohm
  double gain = 40.0;                                  // V/V, until set_gain()
  double noise = 0.0;     // V at the amplifier's input, standard deviation; 10 uV is 20 mA with 0.5 mOhm
  double offset_b = 0.0;  // V at the pin
  double offset_c = 0.0;  // V at the pin
  // V at the amplifier's input.
  double drift_b = 10e-6;  // per degC of the board above 25 degC
  double drift_c = 10e-6;
  double driven_b = 0.0;  // while the bridge is driven
  double driven_c = 0.0;
  double gain_error_b = 0.0;  // share
  double gain_error_c = 0.0;
  double filter = 0.264e-6;   // s, time constant
  double settling = 0.03e-6;  // s per V/V, of the amplifier to 1 %; 0 with a filter of 0: at once
  double delay = 0.178e-6;    // s
};

inline constexpr std::array current_sensor_fields{
    ModelField<CurrentSensorConfig>{"shunt", &CurrentSensorConfig::shunt, 1e-6, 1.0, "ohm",
                                    "resistance of a shunt"},
    ModelField<CurrentSensorConfig>{"gain", &CurrentSensorConfig::gain, 1.0, 1000.0, "V/V",
                                    "gain of the amplifiers, until the firmware sets it"},
    ModelField<CurrentSensorConfig>{"noise", &CurrentSensorConfig::noise, 0.0, 1.0, "V",
                                    "standard deviation at the amplifier input"},
    ModelField<CurrentSensorConfig>{"offset_b", &CurrentSensorConfig::offset_b, -1.65, 1.65, "V",
                                    "offset of channel B at the pin"},
    ModelField<CurrentSensorConfig>{"offset_c", &CurrentSensorConfig::offset_c, -1.65, 1.65, "V",
                                    "offset of channel C at the pin"},
    ModelField<CurrentSensorConfig>{"drift_b", &CurrentSensorConfig::drift_b, -1e-3, 1e-3, "V/degC",
                                    "drift of channel B at the amplifier input, above 25 degC"},
    ModelField<CurrentSensorConfig>{"drift_c", &CurrentSensorConfig::drift_c, -1e-3, 1e-3, "V/degC",
                                    "drift of channel C at the amplifier input, above 25 degC"},
    ModelField<CurrentSensorConfig>{"driven_b", &CurrentSensorConfig::driven_b, -0.1, 0.1, "V",
                                    "shift of channel B at the amplifier input while the bridge is driven"},
    ModelField<CurrentSensorConfig>{"driven_c", &CurrentSensorConfig::driven_c, -0.1, 0.1, "V",
                                    "shift of channel C at the amplifier input while the bridge is driven"},
    ModelField<CurrentSensorConfig>{"gain_error_b", &CurrentSensorConfig::gain_error_b, -0.5, 0.5, "",
                                    "relative gain error of channel B"},
    ModelField<CurrentSensorConfig>{"gain_error_c", &CurrentSensorConfig::gain_error_c, -0.5, 0.5, "",
                                    "relative gain error of channel C"},
    ModelField<CurrentSensorConfig>{"filter", &CurrentSensorConfig::filter, 0.0, 1e-5, "s",
                                    "time constant of the filter before the amplifier"},
    ModelField<CurrentSensorConfig>{
        "settling", &CurrentSensorConfig::settling, 0.0, 1e-6, "s",
        "settling of the amplifier to 1 %, per V/V of gain; with a filter of 0: at once"},
    ModelField<CurrentSensorConfig>{"delay", &CurrentSensorConfig::delay, 0.0, 1e-5, "s",
                                    "from a switching to its first effect at the pin"},
};

class CurrentSensor {
 public:
  enum class Channel : std::uint8_t { b, c };

  // Throws std::invalid_argument.
  explicit CurrentSensor(const CurrentSensorConfig& config = {}, std::uint64_t seed = 1);

  // When in the PWM period; each has noise of its own.
  enum class Half : std::uint8_t { low_sides, high_sides };

  // V at the converter's pin. `shunt_current`: A, 0 while nothing conducts below. Every call is one sample:
  // it draws new noise. A current that is not finite throws std::invalid_argument.
  double sample(Channel channel, double shunt_current, Half half = Half::low_sides);
  // Share of a step of the shunt's voltage that the pin does not show yet, `seconds` after the command of the
  // lower FET; 1 before.
  double left_after(double seconds) const;

  // Of the amplifiers, degC; not the power stage's, whose temperature sensor is beside its transistors.
  void set_temperature(double celsius) { temperature_ = celsius; }
  void set_driven(bool driven) { driven_ = driven; }

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
  double temperature_ = 25.0;
  bool driven_ = false;
  std::array<NoiseGenerator, 4> noise_;
};

}  // namespace kmax::simulation
