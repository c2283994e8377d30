#pragma once

#include "host_tools/calibration/field_turn_fit.hpp"
#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// Direction, pole pairs and electrical offset of a synchronous motor, from sweeps of the stator's field to
// and fro.
class FieldTurnStep final : public Step {
 public:
  std::string_view name() const override { return "field_turn"; }
  StepSet set() const override { return StepSet::encoder; }
  std::vector<std::string_view> needs() const override {
    return {"winding", "hand_direction", "index_search"};
  }
  bool applies(const MotorKnowledge& known) const override { return !known.brushed(); }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;

 private:
  void judge(const FieldTurnFit& fit) const;
  void settle_pole_pairs(Bench& bench, MotorKnowledge& known, const FieldTurnFit& fit, StepReport& report);
};

}  // namespace kmax::calibration
