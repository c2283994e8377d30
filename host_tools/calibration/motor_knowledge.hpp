#pragma once

#include <algorithm>
#include <numbers>

#include "firmware/drive/motor_control.hpp"

namespace kmax::calibration {

// What is known of the axis: at first what its parameters say, later what the steps have found.
struct MotorKnowledge {
  firmware::MotorKind kind = firmware::MotorKind::dc;
  double tick = 50e-6;             // s
  double pwm_frequency = 20000.0;  // Hz
  double supply = 0.0;             // V
  double current_limit = 0.0;      // A
  double transmission = 0.0;       // m per rad of the shaft
  double counts_per_turn = 0.0;
  int direction = 1;  // encoder.direction
  int pole_pairs = 1;
  double resistance = 0.0;          // ohm
  double resistance_error = 0.0;    // standard error; 0: not measured in this run
  double inductance = 0.0;          // H, along d
  double inductance_q = 0.0;        // H
  double dead_time = 0.0;           // s
  double compensation_limit = 0.0;  // N, before the calibration
  double dead_time_error = 0.0;     // s; 0: not measured in this run
  double electrical_offset = 0.0;   // rad
  double torque_constant = 0.0;     // N m/A
  double mass = 0.0;                // kg
  double friction = 0.0;            // N
  bool mass_known = false;          // found in this run, or by a calibration before
  bool calibrated = false;          // motor.calibrated: what the parameters say was measured
  bool searches_index = false;      // counts are referred to an index
  bool hand_checked = false;        // a hand has shown that encoder.direction is right

  // What the excitation uses.
  double current = 0.0;         // A
  double search_voltage = 0.0;  // V, of the square wave that drives about `current`; 0: not known yet

  bool brushed() const { return kind == firmware::MotorKind::dc; }
  double count_length() const { return 2.0 * std::numbers::pi * transmission / counts_per_turn; }  // m
  // m of the handle per electrical turn of the field.
  double electrical_turn() const { return 2.0 * std::numbers::pi * transmission / pole_pairs; }
  double force_per_ampere() const { return torque_constant / transmission; }
  // Current that dies within the dead time, A: below it the dead time takes less.
  double dead_time_band() const {
    return inductance > 0.0 ? std::max(supply * dead_time / inductance, 0.01) : 0.01;
  }
  // Largest voltage that the bridge can give: between two legs, or the amplitude of a vector.
  double largest_voltage() const { return 0.85 * supply * (brushed() ? 1.0 : 0.5773502691896258); }
};

}  // namespace kmax::calibration
