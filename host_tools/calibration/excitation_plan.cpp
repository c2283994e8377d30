#include "host_tools/calibration/excitation_plan.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace kmax::calibration {

std::vector<std::string> ExcitationPlan::assignments() const {
  const auto number = [](const char* name, double value) {
    // As many digits as a float32 has.
    return fmt::format("excitation.{}={:.9g}", name, value);
  };
  return {fmt::format("excitation.kind={}", kind),
          number("bias", bias),
          number("alternation", alternation),
          fmt::format("excitation.half_period={}", half_period),
          fmt::format("excitation.alternation_axis={}", across ? "across" : "along"),
          number("angle", std::remainder(angle, 2.0 * std::numbers::pi)),
          number("angle_rate", angle_rate),
          number("angle_span", angle_span),
          number("ramp", ramp),
          number("duration", duration),
          number("stiffness", stiffness),
          number("damping", damping),
          number("speed", speed),
          number("stroke", stroke)};
}

}  // namespace kmax::calibration
