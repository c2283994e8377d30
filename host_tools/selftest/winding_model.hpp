#pragma once

#include <vector>

#include "host_tools/selftest/recording.hpp"

namespace kmax::selftest {

/// Voltage behind a first-order lag, V in the tick's samples: the current times the resistance of a winding
/// with this time constant (s). The voltage computed at a tick acts from half a tick after its sample to half
/// a tick after the next; the lag is exact for that.
std::vector<double> lagged_voltage(const std::vector<double>& voltage, double time_constant, double tick);

/// The same lag for something that changes slowly and is given at its samples.
std::vector<double> lagged(const std::vector<double>& values, double time_constant, double tick);

/// Calls `residual_of(time constant)` on a grid from a tenth of a tick to 100 ticks, and finer around the
/// best: the time constant with the smallest residual, to 2 %.
template <typename Residual>
double best_time_constant(double tick, Residual residual_of) {
  double best = 0.0, least = 0.0;
  const auto consider = [&](double time_constant) {
    const double residual = residual_of(time_constant);
    if (best != 0.0 && !(residual < least)) return;
    best = time_constant;
    least = residual;
  };
  for (double t = 0.1 * tick; t < 100.0 * tick; t *= 1.4) consider(t);
  const double coarse = best;
  for (double factor = 0.72; factor < 1.4; factor *= 1.04) consider(coarse * factor);
  return best;
}

}  // namespace kmax::selftest
