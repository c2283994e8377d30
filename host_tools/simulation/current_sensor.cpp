#include "host_tools/simulation/current_sensor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace kmax::simulation {

CurrentSensor::CurrentSensor(const CurrentSensorConfig& config, std::uint64_t seed)
    // Two generators, so that what one channel reads does not depend on how often the other is sampled.
    : config_(config), noise_{NoiseGenerator(seed), NoiseGenerator(~seed)} {
  require_allowed(config, std::span<const ModelField<CurrentSensorConfig>>(current_sensor_fields),
                  "current_sensor");
}

double CurrentSensor::sample(Channel channel, double shunt_current) {
  if (!std::isfinite(shunt_current))
    throw std::invalid_argument(fmt::format("shunt current = {} A: allowed is a number", shunt_current));
  const auto index = static_cast<std::size_t>(channel);
  if (floating_) {
    double& drift = drift_[index];
    drift = std::clamp(drift + 0.02 * noise_[index].gaussian(), -0.8, 0.8);
    return 0.5 * reference + drift + 0.05 * noise_[index].gaussian();
  }
  double input = shorted_[index] ? 0.0 : config_.shunt * shunt_current;
  if (inverted_[index]) input = -input;
  if (config_.noise > 0.0) input += config_.noise * noise_[index].gaussian();
  if (stuck_[index]) return std::clamp(*stuck_[index], 0.0, reference);
  const double offset = channel == Channel::b ? config_.offset_b : config_.offset_c;
  return std::clamp(0.5 * reference + offset + config_.gain * input, 0.0, reference);
}

void CurrentSensor::set_gain(double gain) {
  CurrentSensorConfig changed = config_;
  changed.gain = gain;
  require_allowed(changed, std::span<const ModelField<CurrentSensorConfig>>(current_sensor_fields),
                  "current_sensor");
  config_ = changed;
}

}  // namespace kmax::simulation
