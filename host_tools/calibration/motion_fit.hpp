#pragma once
// Mass and friction of what the motor moves, at the handle, from force and position while the force is a
// square wave and nobody touches the handle.
//
//   mass x'' = force - damping x' - friction sgn(x') + bias       (bias: gravity, constant along the stroke)
//
// Weak form: both sides are multiplied by a bump w(t) = sin^4(pi t / width) and integrated by parts, so that
// the position is never differentiated:
//   sum force w = mass sum x w'' - damping sum x w' + friction sum sgn(x') w - bias sum w
// which is linear in the four unknowns; neighbouring bumps are an eighth of the width apart. sgn(x') comes
// from the position's advance over some samples. Where it does not advance by 2 counts the handle may stick,
// and friction there is anything up to its limit: bumps with more than `unsure_share` of their weight on such
// samples are left out.
//
// Width: a fifth of half a wave, or longer where the counts' rounding needs it (as an acceleration 1.5 c (pi
// / width)^2 / sqrt(samples) it shall be 5 % of the wave's, which makes the mass 0.25 % too small). A first
// pass with half waves gives the mass for that choice.
//
// Standard errors: white noise of the force, times 2 for the overlap of the bumps. Damping and friction are
// strongly correlated when all records have one speed; damping is held at 0 where it would come out negative.
// Cogging that is not fitted along (`cogging_periods`) averages out over strokes of many of its periods and
// else lands in all four.
//
// Found on five simulated motors, worst of 20 seeds: mass 2.3 %, friction 8 %. Cost: 20 ms per 6000 samples.

#include <span>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/calibration/estimate.hpp"

namespace kmax::calibration {

// What the handle is shaken with: square waves of force, of which one has about `motion_force_ratio` times
// the friction, with the half period of its swing and with a third of it, in turn. One speed cannot tell
// damping from friction: on five simulated motors (tests/host_tools/calibration, worst of 20 seeds each)
// friction was wrong by up to 57 % with one, by 12 % with both and the same number of samples.
inline constexpr double motion_force_ratio = 5.0;          // force / friction
inline constexpr double motion_second_period = 1.0 / 3.0;  // of the first half period

struct MotionRecord {
  std::span<const double> force;     // N at the handle: torque constant x current / transmission
  std::span<const double> position;  // m
};

struct MotionFitConfig {
  double interval = firmware::tick_interval;  // s between samples (capture.interval x tick)
  double count_length = 16e-6;                // m per count
  double width = 0.0;                         // s of a bump; 0: chosen as said above
  double unsure_share = 0.15;                 // of a bump's weight
  double transmission = 0.0;     // m/rad; with cogging_periods: a cogging force is fitted along (2 harmonics)
  double cogging_periods = 0.0;  // per shaft turn
};

enum class MotionCause {
  none,
  too_little_data,    // found: usable bumps
  not_finite,         // found: index
  no_force,           // found: N peak to peak
  no_motion,          // sticks, blocked or the encoder is dead; found: m
  reversed,           // accelerates against the force; found: kg
  negative_friction,  // held or pushed meanwhile; found: N
  not_resolved,       // found: relative standard error of the mass
};
std::string_view to_string(MotionCause cause);

struct MotionFit {
  Estimate mass{.unit = "kg"};
  Estimate damping{.unit = "N s/m"};
  Estimate friction{.unit = "N"};
  Estimate bias{.unit = "N"};
  double residual = 0.0;        // N rms of a bump's mean
  double sticking_share = 0.0;  // of the samples
  double stroke = 0.0;          // m
  std::size_t bumps = 0;
  Finding<MotionCause> finding;
};

MotionFit fit_motion(std::span<const MotionRecord> records, const MotionFitConfig& config);

}  // namespace kmax::calibration
