#pragma once
// Resistance and inductance of a winding, seen along one axis, from voltages and currents at tick rate.
//
//   L di/dt = v - R i - V_dt sat(i / band) - offset - e
//   de/dt = motion_rate x (i - its mean) - e / motion_decay
//
// One axis is: a brushed motor between B and C; or a synchronous motor along a fixed direction of the stator
// (alternation `along` a bias: L_d; `across` it: L_q), amplitudes kept, so that R and L are those of a phase.
// R contains the on-resistance of the legs. It is the circuit that the controller drives.
//
// Timing. Sample k is taken at tick k, voltage[k] acts from k + 1/2 to k + 3/2 (ticks). From one sample to
// the next, therefore,
//   i[k+1] = a i[k] + (1/R) (s (1 - s) u[k-1] + (1 - s) u[k]),   a = e^(-R T/L),  s = sqrt(a)
// with u the voltage less dead time, offset and e: exact for every L/R, also far below a tick.
//
// Dead time. Each leg loses supply x f x t_dead against its current's sign. V_dt is what that amounts to
// along the axis (brushed: 2 legs; synchronous at the angle 0: 4/3 of a leg), band the current below which it
// fades (host_tools/simulation/inverter.hpp): V_dt / (f L legs). It shows only where the current changes its
// sign: with |bias current| > |alternating current| it is a constant and lands in `offset`; then V_dt is not
// determined and left out (dead_time_voltage unknown). R and L are right both ways.
//
// Motion. A brushed motor's shaft turns to and fro with the wave. Without friction its back-EMF is the
// integral of the current, motion_rate = k^2 / (inertia) in V/(A s); it is fitted when `motion` is free. Set
// it to `standing` along the d axis. When shaft angles are given, the back-EMF is taken from them instead
// (k x speed, k fitted); use that for motions of more than some 20 counts per half wave.
//
// Method: a scan over L/R (0.1 to 1000 ticks) with everything else solved linearly, as a start that no start
// value can spoil, once with and once without dead time and motion; then the output error, sum of (measured -
// simulated current)^2, is minimised by damped Gauss-Newton from both. Current noise does not bias it
// (equation-error fits it does, by much at L/R of 100 ticks). The voltage that acted before the first sample
// is not known: sample 1 is fitted.
//
// Standard errors: from the residual's variance, taken as white. They do not know what the model leaves out:
// across a bias the rotor's swing, with few samples the converter's steps. Errors of 3 to 4 of them were seen
// for R, which are 0.2 %.
//
// What it needs, and what was found: winding_excitation.hpp.
// Cost: 5 to 20 ms per 1000 samples.

#include <span>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/calibration/estimate.hpp"

namespace kmax::calibration {

// One capture. All spans have the same length or, where marked optional, are empty.
struct WindingRecord {
  std::span<const double> voltage;      // V along the axis, as applied: see applied_voltage.hpp
  std::span<const double> current;      // A along the axis
  std::span<const double> supply;       // V, optional: corrects the sag between the tick and the pulse
  std::span<const double> shaft_angle;  // rad, optional
};

enum class WindingMotion { standing, free };

struct WindingFitConfig {
  double tick = firmware::tick_interval;  // s
  double pwm_frequency = 20000.0;         // Hz
  double switching_legs = 2.0;            // legs whose dead time makes V_dt: 2 brushed, 4/3 synchronous
  // False where the current that is measured does not make the dead time's voltage: across a bias that keeps
  // the signs of the phase currents.
  bool fit_dead_time = true;
  WindingMotion motion = WindingMotion::standing;
  double saturated_share =
      0.9;  // |voltage| above this share of the supply was not given; 1/sqrt(3) of it for vectors
  double lowest_current = 0.1;  // A, peak to peak of the wave's currents, below which nothing flows
  double noise_hint = 0.03;     // A, per sample; weighs start values and what is known before
  // R as another fit found it, with its standard error: L_q is sharper for it (the motion that the q current
  // makes looks like resistance). Unknown: R is free.
  Estimate known_resistance{};
};

enum class WindingCause {
  none,
  too_little_data,   // found: samples
  not_finite,        // found: index of the first such sample
  no_alternation,    // the voltage does not change; found: V peak to peak
  supply_saturated,  // the voltage asked for is beyond the supply; found: V
  no_current,        // a phase is open, or the bridge is off; found: A peak to peak
  current_constant,  // current flows but does not follow the voltage: dead sensor; found: correlation
  current_inverted,  // the current goes against the voltage: sensor inverted; found: correlation
  not_resolved,      // R or L is not determined by this record; found: relative standard error
  bad_fit,           // the residual is far above the noise: not a winding; found: A rms
};
std::string_view to_string(WindingCause cause);

struct WindingFit {
  Estimate resistance{.unit = "ohm"};
  Estimate inductance{.unit = "H"};
  Estimate dead_time_voltage{.unit = "V"};  // V_dt, unknown when the current keeps its sign
  Estimate offset_voltage{.unit = "V"};
  Estimate motion_rate{.unit = "V/(A s)"};        // unknown when standing, or with angles
  Estimate back_emf_constant{.unit = "V s/rad"};  // with shaft angles only
  double residual = 0.0;                          // A rms per sample
  double current_span = 0.0;                      // A peak to peak, of the fitted current
  std::size_t samples = 0;
  Finding<WindingCause> finding;

  double time_constant() const { return inductance.value / resistance.value; }  // s
};

// `records`: one or more captures of the same winding, e.g. of two amplitudes. Values are given as far as
// they could be computed also when there is a finding.
WindingFit fit_winding(std::span<const WindingRecord> records, const WindingFitConfig& config = {});

}  // namespace kmax::calibration
