#pragma once
// The torque constant, from the voltage that the turning shaft induces.
//
//   brushed       v   = R i   + L di/dt   + k speed + V_dt x share(i) + offset
//   synchronous   v_q = R i_q + L di_q/dt + (2 k/3 + p L_d i_d) speed + V_dt x share_q(i, angle) + offset
//                 (flux = 2 k / (3 p); N m per A of q current = V s/rad x 3/2)
//
// averaged over windows, so that nothing is differentiated:
//   mean v - L (i_end - i_begin) / time
//     = R mean i + k (angle_end - angle_begin) / time + V_dt mean share + offset
// Linear least squares for k, R, V_dt and offset; R and V_dt are pulled to what the winding fit found by the
// standard errors that are given for it (infinite: free). share is the dead time's sign: brushed 2 x current
// / dead_time_current within -2 .. 2; synchronous that of the three phases' currents at the electrical angle,
// turned into the q direction. V_dt therefore is per leg. Voltage k acts from k + 1/2 to k + 3/2.
//
// Window: of 10, 20, 40, 80, 160 ticks the one that gives k the smallest standard error. The encoder's
// rounding (1/6 count^2 for a difference) is taken off the normal equations, where it would make k too small.
//
// The shaft should move by its own torque: speed then is a quarter wave behind the current, and an error of R
// does not fall on k. `speed_current_correlation` says how far that holds; near +-1 k is as good as the
// resistance given.
//
// Found on five simulated motors, worst of 20 seeds: k 0.6 % with
// 0.25 to 4.4 V rms induced, 1.5 % with half the current and 1 mm of swing (0.08 to 1.3 V). Cost: 10 ms per
// 6000 samples.

#include <limits>
#include <span>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/calibration/estimate.hpp"

namespace kmax::calibration {

struct BackEmfRecord {
  std::span<const double> voltage;           // V (brushed) or V along q
  std::span<const double> current;           // A (brushed) or A along q
  std::span<const double> shaft_angle;       // rad of the motor's shaft: count x 2 pi / counts_per_turn
  std::span<const double> current_d;         // A, synchronous, optional: 0
  std::span<const double> electrical_angle;  // rad, synchronous, optional: without it no dead time is fitted
};

struct BackEmfConfig {
  double tick = firmware::tick_interval;  // s
  bool synchronous = false;
  int pole_pairs = 1;
  double inductance = 0.0;                                            // H, along q
  double inductance_d = 0.0;                                          // H
  double resistance = 0.0;                                            // ohm, the start; its error below
  double resistance_error = std::numeric_limits<double>::infinity();  // infinite: R is free
  double dead_time_voltage = 0.0;                                     // V per leg
  double dead_time_voltage_error = std::numeric_limits<double>::infinity();
  double dead_time_current = 0.05;  // A, band in which a phase's share goes through zero
  double counts_per_turn = 4000.0;
  int window = 0;  // ticks; 0: 10 to 160, by the speed
};

enum class BackEmfCause {
  none,
  too_little_data,  // found: windows
  not_finite,       // found: index
  no_motion,        // found: counts rms per window
  no_voltage,       // turns, but induces nothing: found V rms
  reversed,         // k is negative: phases or encoder reversed; found: N m/A
  not_resolved,     // found: relative standard error
};
std::string_view to_string(BackEmfCause cause);

struct BackEmfFit {
  Estimate torque_constant{.unit = "N m/A"};
  Estimate resistance{.unit = "ohm"};
  Estimate dead_time_voltage{.unit = "V"};  // per leg
  double residual = 0.0;                    // V rms, mean over a window
  double induced_voltage = 0.0;             // V rms of k x speed
  double speed_current_correlation = 0.0;
  std::size_t windows = 0;
  Finding<BackEmfCause> finding;
};

BackEmfFit fit_back_emf(std::span<const BackEmfRecord> records, const BackEmfConfig& config);

}  // namespace kmax::calibration
