#pragma once

#include <string>

#include "host_tools/calibration/bench.hpp"
#include "host_tools/calibration/motor_knowledge.hpp"
#include "host_tools/calibration/step_report.hpp"

namespace kmax::calibration {

// What follows from a motor that does or does not turn the way the encoder counts. Turned against it, either
// the encoder is reversed or two of the motor's wires are swapped. The first is cured by encoder.direction,
// and if nobody has shown where positive is, so is the second. If a hand has shown it, it is the wires:
// throws StepFailed.
//
// Sets encoder.direction as a result and adds it to the report. Returns it.
int settle_direction(Bench& bench, const MotorKnowledge& known, bool agrees, const std::string& evidence,
                     StepReport& report);

}  // namespace kmax::calibration
