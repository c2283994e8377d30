#include "host_tools/selftest/winding_estimate.hpp"

#include <algorithm>
#include <cmath>

#include "host_tools/selftest/linear_fit.hpp"
#include "host_tools/selftest/winding_model.hpp"

namespace kmax::selftest {

namespace {
/// A: mean of the last quarter of every half, each with the sign of its voltage.
double amplitude_of(const std::vector<double>& current, double offset, const Recording& recording,
                    std::size_t end) {
  const std::size_t half = recording.pulse.half_period;
  const std::size_t quarter = std::max<std::size_t>(1, half / 4);
  double sum = 0.0, samples = 0.0;
  for (std::size_t k = recording.before + 1; k < end; ++k) {
    // The current of this sample was made by the voltage of the ticks before.
    const std::size_t since = k - recording.before - 1;
    if (since % half < half - quarter && !recording.tripped()) continue;
    const double voltage = recording.voltage[k - 1];
    if (voltage == 0.0) continue;
    sum += voltage > 0.0 ? current[k] - offset : offset - current[k];
    samples += 1.0;
  }
  return samples > 0.0 ? sum / samples : 0.0;
}
}  // namespace

WindingEstimate estimate_winding(const Recording& recording, double tick) {
  WindingEstimate estimate;
  const std::size_t end = end_of_pulse(recording);
  const std::vector<double>* strongest = nullptr;
  double offset = 0.0;
  for (const auto* current : {&recording.current_b, &recording.current_c}) {
    const MeanAndDeviation rest = mean_and_deviation(*current, 0, recording.before);
    const double amplitude = std::abs(amplitude_of(*current, rest.mean, recording, end));
    estimate.noise = std::max(estimate.noise, rest.deviation);
    if (amplitude <= estimate.amplitude && strongest != nullptr) continue;
    estimate.amplitude = amplitude;
    strongest = current;
    offset = rest.mean;
  }
  estimate.time_constant = best_time_constant(tick, [&](double tried) {
    const auto driven = lagged_voltage(recording.voltage, tried, tick);
    LinearFit<2> fit;
    for (std::size_t k = recording.before; k < end; ++k) fit.add({driven[k], 1.0}, (*strongest)[k] - offset);
    const auto found = fit.solve();
    return found ? found->residual : 1e9;
  });
  return estimate;
}

}  // namespace kmax::selftest
