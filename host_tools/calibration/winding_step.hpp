#pragma once

#include <span>

#include "host_tools/calibration/phase_response.hpp"
#include "host_tools/calibration/step.hpp"
#include "host_tools/calibration/winding_excitation.hpp"
#include "host_tools/calibration/winding_fit.hpp"

namespace kmax::calibration {

// Resistance and inductance of the winding and the bridge's dead time, after a look whether all phases and
// both current sensors are there.
//
// The voltage begins at a tenth of a volt and rises by half until the wanted current flows, as a square wave
// of a millisecond: it has no mean, so the handle trembles but does not travel. A synchronous motor is then
// held by a bias current, which turns it by up to half an electrical turn.
class WindingStep final : public Step {
 public:
  std::string_view name() const override { return "winding"; }
  StepSet set() const override { return StepSet::electrical; }
  std::vector<std::string_view> needs() const override { return {"current_offsets"}; }
  void run(Bench& bench, MotorKnowledge& known, StepReport& report) override;

 private:
  struct Response {
    PhaseResponse phases;
    std::vector<Recording> recordings;
  };

  Response respond(Bench& bench, double voltage, double angle);
  void search(Bench& bench, MotorKnowledge& known);
  WindingFit rough_fit(Bench& bench, const MotorKnowledge& known);
  WindingFit fit_across(Bench& bench, const MotorKnowledge& known, const WindingFit& rough, double angle,
                        const Estimate& resistance);
  WindingFit fit_along(Bench& bench, const MotorKnowledge& known, const WindingFit& rough, double angle);
  void measure_brushed(Bench& bench, MotorKnowledge& known, const WindingFit& rough, StepReport& report);
  void measure_vector(Bench& bench, MotorKnowledge& known, const WindingFit& rough, StepReport& report);
  void finish(Bench& bench, MotorKnowledge& known, StepReport& report);
};

}  // namespace kmax::calibration
