#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace kmax::experiment {
namespace {

void require(const TouchProtocol& protocol, const StiffnessSteps& steps) {
  if (protocol.touches() == 0)
    throw std::invalid_argument("no touch: name at least one approach speed, one push force and one phase");
  const double first_adaptive = steps.first_adaptive.value_or(steps.first);
  if (!(steps.first > 0.0 && first_adaptive > 0.0 && steps.step > 0.0 && steps.growth >= 0.0 &&
        steps.last >= std::max(steps.first, first_adaptive) && steps.last <= 1e7))
    throw std::invalid_argument(
        fmt::format("stiffness from {} N/m (adaptive {}) by {} N/m (or {} of it) to {} N/m: allowed are "
                    "steps above 0 and "
                    "an end from the first one to 1e7 N/m",
                    steps.first, first_adaptive, steps.step, steps.growth, steps.last));
}

/// Every touch of the protocol at one stiffness, up to the first one that is unstable.
class TouchesOfStiffness {
 public:
  TouchesOfStiffness(const TouchSetup& setup, const TouchProtocol& protocol)
      : touch_(setup),
        protocol_(protocol),
        period_(1.0 / setup.wall.tick_rate),
        start_position_(setup.motion.start_position) {
    if (!touch_.matrices)
      touch_.matrices =
          std::make_shared<simulation::PropagatorTable>(setup.device, setup.person, study_gain_bits);
    touch_.threshold = protocol.threshold;
    touch_.force_threshold = protocol.force_threshold;
  }

  /// True: none was unstable, and `result` has this stiffness unless there was no touch.
  bool stable(double stiffness, MaxStiffness& result) {
    touch_.wall.wall.stiffness = static_cast<float>(stiffness);
    Found found;
    for (const double speed : protocol_.approach_speeds) {
      for (const double push : protocol_.pushes) {
        for (std::size_t phase = 0; phase < protocol_.phases; ++phase) {
          if (unstable(speed, push, phase, result, found)) return false;
        }
      }
    }
    result.never_touched = !found.touched;
    if (!found.touched) return true;
    result.stiffness = stiffness;
    result.saturated_share = found.saturated;
    return true;
  }

 private:
  struct Found {
    double saturated = 0.0;
    bool touched = false;
  };

  bool unstable(double speed, double push, std::size_t phase, MaxStiffness& result, Found& found) {
    touch_.motion.approach_speed = speed;
    touch_.motion.push_force = push;
    const double share = static_cast<double>(phase) / static_cast<double>(protocol_.phases);
    touch_.motion.start_position = start_position_ + touch_.motion.wall_side * share * speed * period_;
    const TouchOutcome outcome = simulate_touch(touch_);
    ++result.touches;
    result.simulated_time += static_cast<double>(outcome.samples) * period_;
    result.event_limit_hits += outcome.event_limit_hits;
    found.saturated = std::max(found.saturated, outcome.saturated_share);
    found.touched = found.touched || outcome.verdict != simulation::ContactVerdict::no_contact;
    if (!outcome.unstable()) return false;
    result.ending_speed = speed;
    result.ending_push = push;
    result.ending_peak_to_peak = outcome.peak_to_peak;
    return true;
  }

  TouchSetup touch_;
  const TouchProtocol& protocol_;
  double period_, start_position_;
};

/// Below a first stiffness that is unstable.
void go_down(TouchesOfStiffness& touches, double first, double step, MaxStiffness& result) {
  for (std::uint64_t n = 1;; ++n) {
    const double stiffness = first - step * static_cast<double>(n);
    // Of a step: what is left of it where the way down ends at 0.
    if (stiffness < 1e-9 * step || touches.stable(stiffness, result)) break;
  }
}

}  // namespace

MaxStiffness search_max_stiffness(const TouchSetup& setup, const TouchProtocol& protocol,
                                  const StiffnessSteps& steps) {
  require(protocol, steps);
  MaxStiffness result;
  TouchesOfStiffness touches(setup, protocol);
  const bool adaptive = control::follows_velocity(setup.wall.wall.kind);
  const double first = adaptive ? steps.first_adaptive.value_or(steps.first) : steps.first;
  // Counted in steps, so that thousands of them add no rounding.
  double stiffness = first;
  for (std::uint64_t n = 1; stiffness <= steps.last * (1.0 + 1e-12); ++n) {
    if (!touches.stable(stiffness, result)) {
      if (n == 1 && steps.goes_down) go_down(touches, first, steps.step, result);
      return result;
    }
    if (result.never_touched) return result;
    stiffness = steps.growth * stiffness > steps.step ? stiffness * (1.0 + steps.growth)
                                                      : first + steps.step * static_cast<double>(n);
  }
  result.beyond_last = true;
  return result;
}

}  // namespace kmax::experiment
