#pragma once

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// A brushed motor's direction: short pushes with a voltage, to and fro, each longer than the one before,
// until the encoder counts. The current says by itself whether the motor turns: it falls below voltage /
// resistance by what the turning shaft induces. So a motor that turns under an encoder that does not is told
// apart from one that stands.
class PushDirectionStep final : public Step {
 public:
  std::string_view name() const override { return "direction"; }
  StepSet set() const override { return StepSet::encoder; }
  std::vector<std::string_view> needs() const override { return {"winding", "hand_direction"}; }
  bool applies(const MotorKnowledge& known) const override { return known.brushed(); }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;
};

}  // namespace kmax::calibration
