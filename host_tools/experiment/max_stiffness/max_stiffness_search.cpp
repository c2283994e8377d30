#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace kmax::experiment {
namespace {

void require(const TouchProtocol& protocol, const StiffnessSteps& steps) {
  if (protocol.touches() == 0)
    throw std::invalid_argument("no touch: name at least one approach speed and one push force");
  if (!(steps.first > 0.0 && steps.step > 0.0 && steps.growth >= 0.0 && steps.last >= steps.first &&
        steps.last <= 1e7))
    throw std::invalid_argument(
        fmt::format("stiffness from {} N/m by {} N/m (or {} of it) to {} N/m: allowed are steps above 0 and "
                    "an end from the first one to 1e7 N/m",
                    steps.first, steps.step, steps.growth, steps.last));
}

}  // namespace

MaxStiffness search_max_stiffness(const TouchSetup& setup, const TouchProtocol& protocol,
                                  const StiffnessSteps& steps) {
  require(protocol, steps);
  MaxStiffness result;
  TouchSetup touch = setup;
  if (!touch.matrices)
    touch.matrices =
        std::make_shared<simulation::PropagatorTable>(setup.device, setup.person, study_gain_bits);
  touch.threshold = protocol.threshold;
  touch.force_threshold = protocol.force_threshold;
  const double period = 1.0 / setup.wall.tick_rate;
  // Counted in steps, so that thousands of them add no rounding.
  double stiffness = steps.first;
  for (std::uint64_t n = 1; stiffness <= steps.last * (1.0 + 1e-12); ++n) {
    touch.wall.wall.stiffness = static_cast<float>(stiffness);
    double saturated = 0.0;
    bool touched = false;
    for (const double speed : protocol.approach_speeds) {
      for (const double push : protocol.pushes) {
        touch.motion.approach_speed = speed;
        touch.motion.push_force = push;
        const TouchOutcome outcome = simulate_touch(touch);
        ++result.touches;
        result.simulated_time += static_cast<double>(outcome.samples) * period;
        result.event_limit_hits += outcome.event_limit_hits;
        saturated = std::max(saturated, outcome.saturated_share);
        touched = touched || outcome.verdict != simulation::ContactVerdict::no_contact;
        if (!outcome.unstable()) continue;
        result.ending_speed = speed;
        result.ending_push = push;
        result.ending_peak_to_peak = outcome.peak_to_peak;
        return result;
      }
    }
    result.never_touched = !touched;
    if (!touched) return result;
    result.stiffness = stiffness;
    result.saturated_share = saturated;
    stiffness = steps.growth * stiffness > steps.step ? stiffness * (1.0 + steps.growth)
                                                      : steps.first + steps.step * static_cast<double>(n);
  }
  result.beyond_last = true;
  return result;
}

}  // namespace kmax::experiment
