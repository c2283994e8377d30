#include "host_tools/simulation/current_sensor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/analog_converter.hpp"

namespace kmax::simulation {

CurrentSensor::CurrentSensor(const CurrentSensorConfig& config, std::uint64_t seed)
    // Several generators, so that what one channel reads does not depend on how often the other is sampled.
    : config_(config),
      noise_{NoiseGenerator(seed), NoiseGenerator(~seed), NoiseGenerator(seed + 1),
             NoiseGenerator(~seed - 1)} {
  require_allowed(config, std::span<const ModelField<CurrentSensorConfig>>(current_sensor_fields),
                  "current_sensor");
}

double CurrentSensor::sample(Channel channel, double shunt_current, Half half) {
  if (!std::isfinite(shunt_current))
    throw std::invalid_argument(fmt::format("shunt current = {} A: allowed is a number", shunt_current));
  const auto index = static_cast<std::size_t>(channel);
  if (floating_) {
    double& drift = drift_[index];
    drift = std::clamp(drift + 0.02 * noise_[index].gaussian(), -0.8, 0.8);
    return 0.5 * drivers::converter_reference + drift + 0.05 * noise_[index].gaussian();
  }
  const bool b = channel == Channel::b;
  double input = shorted_[index] ? 0.0 : config_.shunt * shunt_current;
  input *= 1.0 + (b ? config_.gain_error_b : config_.gain_error_c);
  if (inverted_[index]) input = -input;
  input += (b ? config_.drift_b : config_.drift_c) * (temperature_ - 25.0);
  if (driven_) input += b ? config_.driven_b : config_.driven_c;
  const std::size_t stream = half == Half::low_sides ? index : index + 2;
  if (config_.noise > 0.0) input += config_.noise * noise_[stream].gaussian();
  if (stuck_[index]) return std::clamp(*stuck_[index], 0.0, drivers::converter_reference);
  const double offset = b ? config_.offset_b : config_.offset_c;
  return std::clamp(0.5 * drivers::converter_reference + offset + config_.gain * input, 0.0,
                    drivers::converter_reference);
}

double CurrentSensor::left_after(double seconds) const {
  constexpr double to_one_percent = 4.605170185988091;
  const double filter = config_.filter, amplifier = config_.settling * config_.gain / to_one_percent;
  if (filter + amplifier <= 0.0) return 0.0;
  const double after = seconds - config_.delay;
  if (after <= 0.0) return 1.0;
  const double slower = std::max(filter, amplifier), faster = std::min(filter, amplifier);
  // Far below a code.
  if (after > 15.0 * slower) return 0.0;
  // Too alike for a difference of exponentials.
  if (slower - faster < 1e-3 * slower) return (1.0 + after / slower) * std::exp(-after / slower);
  const double fast = faster > 0.0 ? faster * std::exp(-after / faster) : 0.0;
  return (slower * std::exp(-after / slower) - fast) / (slower - faster);
}

void CurrentSensor::set_gain(double gain) {
  CurrentSensorConfig changed = config_;
  changed.gain = gain;
  require_allowed(changed, std::span<const ModelField<CurrentSensorConfig>>(current_sensor_fields),
                  "current_sensor");
  config_ = changed;
}

}  // namespace kmax::simulation
