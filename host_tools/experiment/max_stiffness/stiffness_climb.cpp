#include "host_tools/experiment/max_stiffness/stiffness_climb.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace kmax::experiment {

StiffnessClimb::StiffnessClimb(const StiffnessSteps& steps, bool adaptive)
    : steps_(steps), first_(steps.first_of(adaptive)), stiffness_(first_) {
  if (!(steps.first > 0.0 && steps.first_of(true) > 0.0 && steps.step > 0.0 && steps.growth >= 0.0 &&
        steps.last >= first_ && steps.last <= 1e7))
    throw std::invalid_argument(
        fmt::format("stiffness from {} N/m (adaptive {}) by {} N/m (or {} of it) to {} N/m: allowed are "
                    "steps above 0 and an end from the first one to 1e7 N/m",
                    steps.first, steps.first_of(true), steps.step, steps.growth, steps.last));
}

std::optional<double> StiffnessClimb::next() const {
  if (given_up_ || (unstable_seen_ && (stable_seen_ || !steps_.goes_down))) return std::nullopt;
  // Of a step: what is left of it where the way down ends at 0.
  constexpr double rounding = 1e-9;
  if (stiffness_ > steps_.last * (1.0 + 1e-12) || stiffness_ < rounding * steps_.step) return std::nullopt;
  return stiffness_;
}

void StiffnessClimb::record(bool stable) {
  if (stable) {
    stable_seen_ = true;
    best_ = stiffness_;
  } else {
    unstable_seen_ = true;
  }
  number_ += unstable_seen_ ? -1 : 1;
  // Counted in steps, so that thousands of them add no rounding.
  const bool by_share = !unstable_seen_ && steps_.growth * stiffness_ > steps_.step;
  stiffness_ = by_share ? stiffness_ * (1.0 + steps_.growth) : first_ + steps_.step * number_;
}

}  // namespace kmax::experiment
