#include "host_tools/calibration/direction_verdict.hpp"

#include <fmt/format.h>

namespace kmax::calibration {

int settle_direction(Bench& bench, const MotorKnowledge& known, bool agrees, const std::string& evidence,
                     StepReport& report) {
  if (agrees) {
    if (!known.hand_checked)
      report.values.push_back({"encoder.direction", static_cast<double>(known.direction), 0.0, "",
                               static_cast<double>(known.direction)});
    return known.direction;
  }
  if (known.hand_checked)
    throw StepFailed(
        {"phases_swapped", evidence + "; the hand has shown that the encoder counts the right way",
         known.brushed() ? "exchange the motor's two wires" : "exchange any two of the motor's wires"});
  const int direction = -known.direction;
  report.remarks.push_back(
      {"encoder_reversed_or_phases_swapped", evidence,
       fmt::format("encoder.direction becomes {:+d}, which cures both; --hand tells which of the two it is",
                   direction)});
  const double displacement = bench.displacement();
  bench.set_result({fmt::format("encoder.direction={:+d}", direction)});
  bench.rehome(-displacement);
  report.values.push_back(
      {"encoder.direction", static_cast<double>(direction), 0.0, "", static_cast<double>(known.direction)});
  return direction;
}

}  // namespace kmax::calibration
