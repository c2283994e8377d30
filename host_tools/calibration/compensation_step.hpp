#pragma once

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// compensation.limit as a share of the friction: room for friction that changes (force_compensation.hpp).
inline constexpr double compensation_share = 0.7;

// Cogging, gravity and Coulomb friction over the handle's travel, from slow sweeps in both directions, for
// the compensation in the haptic loop. Its bound is set to `compensation_share` of the friction found, below
// which it cannot move a handle at rest.
class CompensationStep final : public Step {
 public:
  std::string_view name() const override { return "compensation_map"; }
  StepSet set() const override { return StepSet::compensation; }
  std::vector<std::string_view> needs() const override {
    return {"direction", "field_turn", "torque_constant", "motion"};
  }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;
};

}  // namespace kmax::calibration
