#pragma once

#include <string_view>
#include <vector>

#include "host_tools/calibration/bench.hpp"
#include "host_tools/calibration/calibration_settings.hpp"
#include "host_tools/calibration/motor_knowledge.hpp"
#include "host_tools/calibration/step_report.hpp"

namespace kmax::calibration {

// One thing that is identified. run() excites, fits, checks; it adds its values to the report, what later
// steps need to the knowledge, and the parameters it found to the bench (Bench::set_result). It throws
// StepFailed if its verdict is "no"; every other exception is a failure of the device or the link and ends
// the calibration.
class Step {
 public:
  virtual ~Step() = default;
  virtual std::string_view name() const = 0;
  virtual StepSet set() const = 0;
  // Names of steps whose failure makes this one meaningless; steps that are not in the chosen sets do not
  // count.
  virtual std::vector<std::string_view> needs() const { return {}; }
  // Whether there is anything to do on this axis.
  virtual bool applies(const MotorKnowledge&) const { return true; }
  virtual void run(Bench& bench, MotorKnowledge& known, StepReport& report) = 0;
};

}  // namespace kmax::calibration
