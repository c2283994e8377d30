#pragma once

#include <string>

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// A synchronous motor dragged to and fro by a current vector that turns slowly in the stator, over as much of
// the allowed travel as is of use.
//
// prepare() lets the rotor fall in with the vector, turns that by half a turn and sees how far the handle
// goes: from this, and not from motor.pole_pairs, it plans the sweeps, and moves to where they begin. A
// handle that does not move is the place to tell a dead encoder from a blocked motor: a rotor that turns with
// the field induces a voltage across the current, speed x flux, where a standing one leaves speed x
// inductance x current. Throws StepFailed: encoder_dead, motor_blocked, travel_too_small.
class FieldSweep {
 public:
  static constexpr double rate = 12.566370614359172;  // rad/s of the field, 2 turns/s

  FieldSweep(Bench& bench, const MotorKnowledge& known) : bench_(bench), known_(known) {}

  // Half an electrical turn. Throws StepFailed if the encoder does not see it: encoder_dead, motor_blocked.
  void require_half_turn();
  // That, then to the middle of the travel and to where a sweep begins.
  void prepare();
  // One sweep: channels `electrical_angle`, `count` and `voltage_d`. Forwards and backwards must take turns,
  // forwards first.
  Waveforms sweep(bool forwards);

  // Throws StepFailed if the encoder stands at the end of a pair of sweeps: encoder_dead, motor_blocked.
  void require_living_encoder(const Waveforms& to, const Waveforms& fro);

  // Back to the middle of the travel, after whole pairs of sweeps.
  void finish();

  double turns() const { return span_ / 6.283185307179586; }  // electrical, of a sweep

 private:
  void align(double reach = 0.0);
  // Again from where it began, if the host was held up meanwhile.
  Waveforms turn(double by, const std::vector<std::string>& channels, std::size_t samples);
  Waveforms turn_once(double by, const std::vector<std::string>& channels, std::size_t samples);
  void go_back(double angle);
  double angle_by_count();
  void diagnose_still(double counts, const Waveforms& to, const Waveforms& fro);

  Bench& bench_;
  const MotorKnowledge& known_;
  double angle_ = 0.0;  // rad, where the vector is
  double span_ = 0.0;   // rad, of a sweep
  // Of the handle, once it has been seen to move.
  double metres_per_radian_ = 0.0, known_angle_ = 0.0, known_displacement_ = 0.0;
};

}  // namespace kmax::calibration
