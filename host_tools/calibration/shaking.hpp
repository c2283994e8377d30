#pragma once

#include <string>
#include <vector>

#include "host_tools/calibration/bench.hpp"
#include "host_tools/calibration/motor_knowledge.hpp"
#include "host_tools/calibration/recording.hpp"

namespace kmax::calibration {

// The handle shaken by a square wave of torque-making current around the middle of its travel.
//
// The wave comes up over eight of its half periods: had it its full amplitude at once, the handle would run
// off in the first half wave's direction. The half period is found by trying: short at first, longer until
// the handle moves by about `stroke` (m, peak to peak). Where the encoder counts nothing the induced voltage
// decides: a motor that turns is not shaken for longer, since the same encoder would have to watch its
// travel.
//
// Throws StepFailed: encoder_dead, motor_blocked, and what trips.
class Shaking {
 public:
  Shaking(Bench& bench, const MotorKnowledge& known, double current, double stroke)
      : bench_(bench), known_(known), current_(current), stroke_(stroke) {}

  void prepare();
  // `samples` at every `interval` ticks, once the wave is up. `voltage`, `current` and `count` must be among
  // the channels.
  Recording record(const std::vector<std::string>& channels, std::size_t samples, int interval);

  // The same wave with another half period, from now on.
  void set_half_period(int ticks) { half_period_ = ticks; }
  int half_period() const { return half_period_; }  // ticks

 private:
  ExcitationPlan wave(std::size_t ticks) const;
  int longest() const;  // half period, ticks
  // From the middle of the travel, where it cannot be seen that a record before it was cut off.
  Recording record_centred(const ExcitationPlan& excitation, const RecordPlan& plan);
  void require_living_encoder(const Recording& seen, int interval) const;

  Bench& bench_;
  const MotorKnowledge& known_;
  double current_, stroke_;
  int half_period_ = 40;
  double seen_ = 0.0;
};

}  // namespace kmax::calibration
