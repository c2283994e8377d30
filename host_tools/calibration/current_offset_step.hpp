#pragma once

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// The current sensors with the bridge off: no current, little noise.
class CurrentOffsetStep final : public Step {
 public:
  std::string_view name() const override { return "current_offsets"; }
  StepSet set() const override { return StepSet::electrical; }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;
};

}  // namespace kmax::calibration
