#pragma once
// The largest stiffness at which a wall stays stable under one simulated person's hand (paper 1, section
// 4.2): from a low stiffness upwards in equal steps, the last one before any of a set of touches is unstable.
//
// The papers do not say how their subjects touched the wall. Here every stiffness is touched at each approach
// speed with each push force, and one unstable touch decides. A touch that never gets into the wall says
// nothing. The stiffness is not found by halving: whether a wall is stable need not change once only.

#include <cstdint>
#include <span>
#include <vector>

#include "host_tools/experiment/max_stiffness/stiffness_climb.hpp"
#include "host_tools/experiment/simulated_touch.hpp"

namespace kmax::experiment {

struct TouchProtocol {
  std::vector<double> approach_speeds{0.05, 0.1, 0.2, 0.5, 1.0};  // m/s
  std::vector<double> pushes{0.3, 0.6, 1.0};                      // N
  // Each of them so often, begun a share of a sample's way further out each time: near the limit it hangs on
  // where between two samples the handle meets the surface.
  std::size_t phases = 1;
  double threshold = simulation::unstable_motion;  // m peak to peak
  double force_threshold = 0.0;                    // N: simulated_touch.hpp
  std::size_t touches() const { return approach_speeds.size() * pushes.size() * phases; }
  // By the force if there is a threshold for it, else by the position.
  TouchJudgement judgement() const {
    const bool by_force = force_threshold > 0.0;
    return {by_force, by_force ? force_threshold : threshold};
  }
};

struct MaxStiffness {
  double stiffness = 0.0;      // N/m; 0: even the first one was unstable (or all that lie below it)
  bool beyond_last = false;    // nothing was unstable up to `last`
  bool never_touched = false;  // not one touch at the last stiffness tried got into the wall
  double ending_speed = 0.0;   // m/s, intended, and N: the touch that was unstable
  double ending_push = 0.0;
  double ending_peak_to_peak = 0.0;  // m
  double saturated_share = 0.0;      // largest over the touches at `stiffness`, simulated_touch.hpp
  std::uint64_t touches = 0;
  std::uint64_t event_limit_hits = 0;
  double simulated_time = 0.0;  // s
};

// `setup`: everything but stiffness, approach speed, push and criterion, which the protocol has. Throws
// std::invalid_argument.
MaxStiffness search_max_stiffness(const TouchSetup& setup, const TouchProtocol& protocol,
                                  const StiffnessSteps& steps);

// By several protocols at once, which differ in their thresholds, and in their phases as one and the largest
// number of them do. In their order, each to the last bit what it gives alone; but a touch that several ask
// for is simulated once, which is half of the time for the two criteria. Throws std::invalid_argument.
std::vector<MaxStiffness> search_max_stiffness_by_each(const TouchSetup& setup,
                                                       std::span<const TouchProtocol> protocols,
                                                       const StiffnessSteps& steps);

}  // namespace kmax::experiment
