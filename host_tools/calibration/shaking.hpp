#pragma once
// The handle moved by the motor, under an encoder that may have died: shaken, and brought back to the middle.

#include <span>
#include <string>
#include <vector>

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// Whether the motor turns under an encoder that stands: a turning motor induces a voltage, so that more (or,
// turning back, less) of it is needed for the same current than its resistance takes. Neither needs the
// encoder, which is what excitation.travel relies on.
struct InducedVoltage {
  double volts = 0.0;  // in a wave: rms of its rise over a half wave
  double error = 0.0;  // standard error of that

  // Beyond what noise, a warm winding or a sagging supply make of it.
  bool sure(const MotorKnowledge& known, double current) const;
};

// From channels `voltage` and `current` (A, along the torque) while the current is a square wave: each half
// wave's rise of voltage - resistance x current from its third to its sixth tenth to the last three; with a
// channel `voltage_d` the rise of the vector. `half_period` in samples, the record begins with a half wave;
// `first` and `end` bound the samples that count. Fewer than 10 samples in half a wave, or half waves of less
// than 3.5 ms, in which the current controller is still at work: 0 with an infinite error.
InducedVoltage induced_in_waves(const Waveforms& seen, const MotorKnowledge& known, std::size_t half_period,
                                std::size_t first, std::size_t end);

// While the current pushes one way: voltage - resistance x current, over the last third.
InducedVoltage induced_in_push(const Waveforms& seen, const MotorKnowledge& known);

// Of a count, in counts.
bool stands(std::span<const double> count);

// The diagnosis of a handle whose encoder stands: encoder_dead if a voltage is induced, else motor_blocked.
// A synchronous motor that seems to stand is first dragged along by a turning field, half an electrical turn.
[[noreturn]] void throw_standing(Bench& bench, const MotorKnowledge& known, bool induced,
                                 const std::string& evidence);

// Moves the handle back to where it was at the beginning; a handle that is nearer than 15 % of the travel
// stays. Needs direction, commutation and resistance. Afterwards the axis is disarmed, so that the next
// excitation has all of the travel to both sides.
//
// A spring of 500 N/m, whose other end moves at 5 cm/s, pulls for 40 ms at a time: pulled for as long as the
// way back takes, a handle whose encoder has died would be out of its travel by metres. A piece that
// brings it no nearer is followed by one that is longer by two fifths, unless nothing is counted and the
// motor shows by its induced voltage that it turns.
//
// Throws StepFailed: encoder_dead, and what trips.
void centre_handle(Bench& bench, const MotorKnowledge& known);

// The handle shaken by a square wave of torque-making current around the middle of its travel.
//
// The wave comes up over eight of its half periods: had it its full amplitude at once, the handle would run
// off in the first half wave's direction. The half period is found by trying: short at first, longer until
// the handle moves by about `stroke` (m, peak to peak). Where the encoder counts nothing the induced voltage
// decides whether a brushed motor turns. A synchronous one runs on under a dead encoder, 317 mm with waves
// that grew to 150 ms: if its voltage says that it turns, or a shorter wave has moved it, a field leads it by
// half an electrical turn, and without a count there nothing is shaken any more. A handle that would have
// swung by the stroke if it were free, as far as its mass is known, is shaken for no longer either.
//
// Throws StepFailed: encoder_dead, motor_blocked, and what trips.
class Shaking {
 public:
  Shaking(Bench& bench, const MotorKnowledge& known, double current, double stroke)
      : bench_(bench), known_(known), current_(current), stroke_(stroke) {}

  void prepare();
  // `samples` at every `interval` ticks, once the wave is up. `voltage`, `current` and `count` must be among
  // the channels.
  Waveforms record(const std::vector<std::string>& channels, std::size_t samples, int interval);

  // The same wave with another half period, from now on.
  void set_half_period(int ticks) { half_period_ = ticks; }
  int half_period() const { return half_period_; }  // ticks

 private:
  ExcitationPlan wave(std::size_t ticks) const;
  // ticks, in which a free handle swings by `stroke` (m, peak to peak); the slowest while its mass is not
  // known.
  int half_period_of(double stroke) const;
  bool runs_on() const;
  StillLimits still_in_wave() const;
  // From the middle of the travel, where it cannot be seen that a record before it was cut off.
  Waveforms record_centred(const ExcitationPlan& excitation, const CapturePlan& plan);
  void require_living_encoder(const Waveforms& seen, int interval) const;
  std::string evidence(const InducedVoltage& induced) const;

  Bench& bench_;
  const MotorKnowledge& known_;
  double current_, stroke_;
  int half_period_ = 40;
  double seen_ = 0.0;
};

}  // namespace kmax::calibration
