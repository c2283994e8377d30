#include "host_tools/calibration/winding_excitation.hpp"

#include <algorithm>
#include <cmath>

namespace kmax::calibration {

int winding_half_period(double time_constant, double tick) {
  const double ticks = std::ceil(fewest_time_constants * time_constant / tick);
  if (!(ticks < longest_half_period)) return longest_half_period;
  return std::max(static_cast<int>(ticks), shortest_half_period);
}

int winding_slow_half_period(int half_period) {
  return std::max(half_period, std::min(3 * half_period, 40));
}

WindingExcitation brushed_excitation(double resistance, double inductance, double current, double tick) {
  return {0.0, resistance * current, winding_half_period(inductance / resistance, tick), winding_samples,
          0.02};
}

WindingExcitation vector_excitation(double resistance, double inductance, double current, double tick) {
  return {resistance * current, 0.5 * resistance * current,
          winding_half_period(inductance / resistance, tick), winding_samples, 1.0};
}

WindingExcitation across_excitation(double resistance, double inductance, double current, double tick) {
  return {resistance * current, 0.4 * resistance * current,
          winding_half_period(inductance / resistance, tick), winding_samples, 1.0};
}

}  // namespace kmax::calibration
