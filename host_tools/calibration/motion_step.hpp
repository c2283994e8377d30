#pragma once

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// Mass, damping and Coulomb friction felt at the handle, from shaking it hard, and with some five times the
// friction slowly and fast: one speed cannot tell damping from friction.
class MotionStep final : public Step {
 public:
  std::string_view name() const override { return "motion"; }
  StepSet set() const override { return StepSet::mechanical; }
  std::vector<std::string_view> needs() const override {
    return {"direction", "field_turn", "torque_constant"};
  }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;
};

}  // namespace kmax::calibration
