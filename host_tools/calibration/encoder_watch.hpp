#pragma once

#include <span>
#include <string>

#include "host_tools/calibration/bench.hpp"
#include "host_tools/calibration/motor_knowledge.hpp"
#include "host_tools/calibration/recording.hpp"

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
// wave's rise of voltage - resistance x current from its third to its sixth tenth to the last three, in the
// direction of the current. `half_period` in samples, the record begins with a half wave; `first` and `end`
// bound the samples that count. Fewer than 10 samples in half a wave: 0 with an infinite error.
InducedVoltage induced_in_waves(const Recording& seen, const MotorKnowledge& known, std::size_t half_period,
                                std::size_t first, std::size_t end);

// While the current pushes one way: voltage - resistance x current, over the last third.
InducedVoltage induced_in_push(const Recording& seen, const MotorKnowledge& known);

// Of a count, in counts.
bool stands(std::span<const double> count);

// The diagnosis of a handle whose encoder stands: encoder_dead if a voltage is induced, else motor_blocked.
// A synchronous motor that seems to stand is first dragged along by a turning field, half an electrical turn.
[[noreturn]] void throw_standing(Bench& bench, const MotorKnowledge& known, bool induced,
                                 const std::string& evidence);

}  // namespace kmax::calibration
