#pragma once
// Cogging and gravity as forces of the device on its handle, over position, and Coulomb friction, from slow
// sweeps in both directions.
//
//   motor force + device force(angle) = friction sgn(x')                 (slow: no mass, no damping)
//   device force(angle) = gravity_constant + gravity_cosine cos angle + gravity_sine sin angle
//                       + cogging_cosine_1 cos N angle + cogging_sine_1 sin N angle
//                       + cogging_cosine_2 cos 2 N angle + cogging_sine_2 sin 2 N angle
//
// in N at the handle along +x, the terms of ForceCompensationConfig (control/force_compensation.hpp: the
// compensation adds the opposite). angle = 2 pi count / counts_per_turn of the shaft, in the encoder's
// direction; the bare count as it is given, without half a count for what it has been rounded by: so it will
// be used. Minus the mean of both directions at a place is cogging and gravity, half their difference
// friction. A constant error of the current sensor lands in gravity_constant, a wrong torque constant scales
// everything.
//
// Method: samples at which the shaft moved with 1/4 to 4 times the sweep's median speed, so that standing and
// slipping do not count; means in 6000 places per turn; least squares. N is the whole number up to
// `most_periods` whose fundamental leaves the smallest residual; half of it when that explains more (a strong
// second harmonic). It is determined when the sweep covers 2 periods or more. Gravity's once-per-turn terms
// need `gravity_range` turns; below, or when they explain nothing, they are left out and the constant stands
// for them over the swept range. Standard errors take the noise as white.
//
// What it needs: a sweep each way over 0.3 turns or more, so slow that inertia does not show as cogging (a
// mass m adds m (N v / transmission)^2 to the stiffness), from a position loop whose stiffness is above twice
// the cogging's own (N x amplitude / transmission in N/m), 3000 samples or more a sweep. Found on three
// simulated motors with 0.1 to 0.18 N of cogging, worst of 5 seeds: amplitude within 6 mN, N right. Friction
// within 3 %, but 13 % too small where the current's noise (0.5 N) shakes the handle at 1 mm/s by more than
// its friction (0.2 N): the motion fit's friction is the better one there.

#include <span>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/calibration/estimate.hpp"

namespace kmax::calibration {

// One sweep, one direction.
struct CoggingSweep {
  std::span<const double> force;        // N at the handle: torque constant x current / transmission
  std::span<const double> shaft_angle;  // rad
};

struct CoggingFitConfig {
  double interval = firmware::tick_interval;  // s between samples
  double counts_per_turn = 4000.0;
  int least_periods = 2;  // per shaft turn
  int most_periods = 400;
  double gravity_range = 0.4;  // turns
  double uneven_limit = 0.4;   // of uneven_share
  double significance = 4.0;   // amplitude / its standard error, from which a term is kept
};

enum class CoggingCause {
  none,
  too_little_data,    // found: samples that moved
  not_finite,         // found: index
  no_motion,          // found: turns swept
  one_direction,      // all sweeps went the same way; found: sweeps backwards
  uneven_motion,      // the shaft jumps from detent to detent; found: share of the samples left out
  range_too_short,    // less than 2 periods swept; gravity constant and friction are valid; found: turns
  periods_ambiguous,  // another number of periods fits nearly as well; found: that number
};
std::string_view to_string(CoggingCause cause);

struct CoggingFit {
  Estimate friction{.unit = "N"};
  Estimate gravity_constant{.unit = "N"};
  Estimate gravity_cosine{.unit = "N"};
  Estimate gravity_sine{.unit = "N"};
  int cogging_periods = 0;  // 0: no cogging above the noise
  Estimate cogging_cosine_1{.unit = "N"};
  Estimate cogging_sine_1{.unit = "N"};
  Estimate cogging_cosine_2{.unit = "N"};
  Estimate cogging_sine_2{.unit = "N"};
  bool gravity_turns = false;  // cosine and sine of gravity were told apart from the constant
  double residual = 0.0;       // N rms
  double speed = 0.0;          // rad/s of the shaft, the slowest sweep's median
  double uneven_share = 0.0;   // of the samples, that stood or jumped and were left out
  double range = 0.0;          // turns of the shaft swept in both directions
  Finding<CoggingCause> finding;

  double device_force_at(double shaft_angle) const;  // N, without friction
};

CoggingFit fit_cogging(std::span<const CoggingSweep> sweeps, const CoggingFitConfig& config);

}  // namespace kmax::calibration
