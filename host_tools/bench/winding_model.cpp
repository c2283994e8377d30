#include "host_tools/bench/winding_model.hpp"

#include <algorithm>
#include <cmath>

namespace kmax::bench {

void simulate_winding(const WindingParameters& parameters, const WindingInput& input,
                      std::span<double> current) {
  const std::size_t count = input.voltage.size();
  if (count < 2) return;
  const double halves = 0.5 * input.tick * parameters.resistance / parameters.inductance;
  const double decay = std::exp(-halves);
  const double mean_decay = halves > 1e-9 ? -std::expm1(-halves) / halves : 1.0;
  const double conductance = 1.0 / parameters.resistance;
  // Mean current lost in a half per volt of dead time.
  const double lost = conductance * (1.0 - mean_decay) * parameters.dead_time_voltage;

  double i = parameters.first_current;
  double induced = parameters.first_induced;
  const auto half = [&](double voltage) {
    double final = voltage * conductance;
    if (parameters.dead_time_voltage != 0.0) {
      const double mean = final + (i - final) * mean_decay;
      const double share = std::clamp(mean / (parameters.dead_time_band + std::abs(lost) + 1e-12), -1.0, 1.0);
      final -= conductance * parameters.dead_time_voltage * share;
    }
    i = final + (i - final) * decay;
  };

  current[0] = current[1] = i;
  for (std::size_t k = 1; k + 1 < count; ++k) {
    double against = parameters.offset_voltage + induced;
    if (!input.speed.empty()) against += parameters.back_emf_constant * input.speed[k];
    const double before = i;
    half(input.voltage[k - 1] - against);
    half(input.voltage[k] - against);
    induced += input.tick *
               (parameters.motion_rate * (0.5 * (before + i) - input.mean_current) - induced / motion_decay);
    current[k + 1] = i;
  }
}

std::vector<double> lagged_voltage(std::span<const double> voltage, double time_constant, double tick) {
  const double half = std::exp(-0.5 * tick / time_constant);
  std::vector<double> out(voltage.size(), 0.0);
  for (std::size_t k = 1; k < out.size(); ++k) {
    const double before = k >= 2 ? voltage[k - 2] : 0.0;
    out[k] = half * half * out[k - 1] + (1.0 - half) * (half * before + voltage[k - 1]);
  }
  return out;
}

std::vector<double> lagged(std::span<const double> values, double time_constant, double tick) {
  const double stays = std::exp(-tick / time_constant);
  std::vector<double> out(values.size(), 0.0);
  for (std::size_t k = 1; k < out.size(); ++k)
    out[k] = stays * out[k - 1] + (1.0 - stays) * 0.5 * (values[k - 1] + values[k]);
  return out;
}

}  // namespace kmax::bench
