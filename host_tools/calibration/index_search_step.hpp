#pragma once

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

// Moves a synchronous motor's handle over the allowed travel until the encoder's index has been passed:
// counts are then referred to it, and the electrical offset means the same after every start.
//
// Left out without an index line, with an encoder that knows its angle anyway, and with a brushed motor.
class IndexSearchStep final : public Step {
 public:
  std::string_view name() const override { return "index_search"; }
  StepSet set() const override { return StepSet::encoder; }
  std::vector<std::string_view> needs() const override { return {"winding", "hand_direction"}; }
  bool applies(const MotorKnowledge& known) const override {
    return !known.brushed() && known.searches_index;
  }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;
};

}  // namespace kmax::calibration
