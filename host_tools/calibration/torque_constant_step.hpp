#pragma once

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// The torque constant, from the voltage that the shaking handle induces: what turns current into force turns
// speed into voltage. It needs no force gauge.
class TorqueConstantStep final : public Step {
 public:
  std::string_view name() const override { return "torque_constant"; }
  StepSet set() const override { return StepSet::mechanical; }
  std::vector<std::string_view> needs() const override { return {"winding", "direction", "field_turn"}; }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;
};

}  // namespace kmax::calibration
