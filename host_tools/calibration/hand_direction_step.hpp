#pragma once

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// Somebody moves the handle towards the end that is to be positive, without force: the count must grow, else
// encoder.direction is turned. With this known, a motor that turns the other way has two phases swapped; and
// an encoder that stands still under the hand is dead, whatever the motor does.
//
// Left out if there is nobody to ask.
class HandDirectionStep final : public Step {
 public:
  std::string_view name() const override { return "hand_direction"; }
  StepSet set() const override { return StepSet::encoder; }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;
};

}  // namespace kmax::calibration
