#pragma once
// The current that a winding would show, tick by tick, for given voltages: the equation of
// calibration/winding_fit.hpp; and the lag that it is without dead time and motion.
//
// Every tick is two halves, the first under the voltage of the tick before. In each half the current
// approaches its final value exponentially; dead time acts with the half's mean current, which is solved for
// exactly (linear inside the band, constant outside).

#include <span>
#include <vector>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::bench {

struct WindingParameters {
  double resistance = 1.0;         // ohm
  double inductance = 1e-3;        // H
  double dead_time_voltage = 0.0;  // V
  double dead_time_band = 0.0;     // A
  double offset_voltage = 0.0;     // V
  double motion_rate = 0.0;        // V/(A s)
  double back_emf_constant = 0.0;  // V s/rad
  double first_current = 0.0;      // A, of sample 1
  double first_induced = 0.0;      // V at sample 1, of the motion
};

// Time constant with which the motion's voltage dies out, s: friction does that to a shaft. It also keeps the
// integral of the current from collecting small offsets. Long against half a wave, short against a record.
inline constexpr double motion_decay = 0.01;

struct WindingInput {
  std::span<const double> voltage;        // V, [k] acts from k + 1/2 to k + 3/2
  std::span<const double> speed;          // rad/s, mean of the tick from k to k + 1; optional
  double mean_current = 0.0;              // A, about which motion_rate integrates
  double tick = firmware::tick_interval;  // s
};

// Writes samples 1 .. of `current` (as long as `voltage`); sample 0 is set to sample 1, since the voltage
// that acted before it is not known.
void simulate_winding(const WindingParameters& parameters, const WindingInput& input,
                      std::span<double> current);

// Voltage behind a first-order lag, V in the tick's samples: the current times the resistance of a winding
// with this time constant (s). The voltage computed at a tick acts from half a tick after its sample to half
// a tick after the next; the lag is exact for that.
std::vector<double> lagged_voltage(std::span<const double> voltage, double time_constant, double tick);

// The same lag for something that changes slowly and is given at its samples.
std::vector<double> lagged(std::span<const double> values, double time_constant, double tick);

// Calls `residual_of(time constant)` on a grid from a tenth of a tick to 100 ticks, and finer around the
// best: the time constant with the smallest residual, to 2 %.
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

}  // namespace kmax::bench
