#pragma once
// The square waves that the winding fit needs, and how to come to them without knowing the motor.
//
//  1. Search the amplitude: alternation `first_voltage`, half period `first_half_period`, no bias; times
//     `voltage_factor` until the current's peak-to-peak span reaches the wanted current (or the supply's
//     bound: a phase is open, or the supply too low). fit_winding() of that record gives the first R and L/R.
//  2. Brushed: brushed_excitation(), one record, motion free; the current changes its sign, which shows the
//     dead time.
//  3. Synchronous, along: vector_excitation() at the angle 0, motion standing: R and L_d. The dead time comes
//     from a wave without bias.
//  4. Synchronous, across: across_excitation(), and again with winding_slow_half_period() of its half period,
//     both in one call with motion free, fit_dead_time = false, known_resistance = R of step 3: L_q. The
//     rotor swings with the wave; the two half periods separate its back-EMF from the inductance.
//
// Half period: 3 L/R shows both the slope (L) and the end (R); at least 10 ticks, so that the motion's slope
// shows beside them.
//
// Evidence, five simulated motors (tests/host_tools/calibration; 2 ohm 0.1 mH to 11 ohm 3.9 mH, 50 mOhm
// 25 uH; 30 mA of noise per sample, converter steps of 40 and 80 mA, dead time, sag, cogging, friction), 4000
// samples a record, worst of 20 seeds: R 1.0 %, L_d and L 0.8 %, L_q 1.0 %. 1500 samples: R 1.9 %, L 0.8 %
// (brushed, one record), R 0.4 % (two records). One record without bias at 4 ticks: L wrong by up to 15 %.

#include <cstddef>

namespace kmax::calibration {

struct WindingExcitation {
  double bias = 0.0;         // V along the axis
  double alternation = 0.0;  // V, square wave
  int half_period = 0;       // ticks
  std::size_t samples = 0;   // of one capture at every tick, after the settling time
  double settling = 0.0;     // s before the capture, for ramp and alignment
};

inline constexpr double first_voltage = 0.1;  // V
inline constexpr double voltage_factor = 1.5;
inline constexpr int first_half_period = 20;  // ticks
inline constexpr double fewest_time_constants = 3.0;
inline constexpr int shortest_half_period = 10;  // ticks
inline constexpr int longest_half_period = 200;  // ticks
inline constexpr std::size_t winding_samples = 4000;

// Half period for a time constant L/R (s): 3 L/R, 10 to 200 ticks.
int winding_half_period(double time_constant, double tick);

// Of the second, slower record across a bias: three times as long, at most 40 ticks: the rotor swings with
// it, a light one with little resistance by so much that the fit's linear motion fails beyond (drone: 87
// ticks, L_q 25 % off).
int winding_slow_half_period(int half_period);

// Brushed: no bias (it would drive the shaft away), alternating current `current` (A).
WindingExcitation brushed_excitation(double resistance, double inductance, double current, double tick);
// Synchronous, along the bias: bias current `current`, alternating half of it, so that no phase current
// changes its sign and dead time is a constant.
WindingExcitation vector_excitation(double resistance, double inductance, double current, double tick);
// Synchronous, across the bias: the same bias, alternating 0.4 of it: below 1/sqrt(3), no phase current
// changes its sign.
WindingExcitation across_excitation(double resistance, double inductance, double current, double tick);

}  // namespace kmax::calibration
