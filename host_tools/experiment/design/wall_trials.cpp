#include "host_tools/experiment/design/wall_trials.hpp"

#include <algorithm>
#include <numeric>

#include "host_tools/experiment/touch_price.hpp"

namespace kmax::experiment {

WallTrials::WallTrials(const DesignTask& task) : task_(task), touched_(task.set.subjects.size()) {
  for (const Subject& subject : task.set.subjects)
    tables_.push_back(
        std::make_shared<simulation::PropagatorTable>(task.set.device, subject.person, study_gain_bits));
}

TouchOutcome WallTrials::touch(const DesignedWall& wall, std::size_t number, double phase) {
  const TouchCase by = case_of(task_, number);
  TouchSetup setup = touch_of(task_, wall, by);
  setup.matrices = tables_[by.person];
  setup.motion.start_position += phase * by.speed / task_.rate;
  const TouchOutcome outcome = simulate_touch(setup);
  ++touches_;
  event_limit_hits_ += outcome.event_limit_hits;
  if (outcome.verdict != simulation::ContactVerdict::no_contact) touched_[by.person] = 1;
  return outcome;
}

std::optional<EndingTouch> WallTrials::first_not_held(const DesignedWall& wall,
                                                      std::vector<std::size_t>& numbers) {
  std::fill(touched_.begin(), touched_.end(), 0);
  for (auto at = numbers.begin(); at != numbers.end(); ++at) {
    const TouchOutcome outcome = touch(wall, *at);
    if (outcome.held()) continue;
    const EndingTouch found{*at, outcome.by_force, outcome.peak_to_peak, outcome.rendered_share,
                            !outcome.unstable()};
    std::rotate(numbers.begin(), at, at + 1);
    return found;
  }
  return std::nullopt;
}

std::optional<EndingTouch> WallTrials::first_not_held(const DesignedWall& wall) {
  std::vector<std::size_t> all(task_.touches());
  std::iota(all.begin(), all.end(), 0U);
  return first_not_held(wall, all);
}

bool WallTrials::everybody_touched() const {
  return std::all_of(touched_.begin(), touched_.end(), [](char touched) { return touched != 0; });
}

WallTrials::Deepest WallTrials::deepest(const DesignedWall& wall) {
  Deepest deepest;
  for (std::size_t number = 0; number < task_.touches(); ++number) {
    const TouchCase by = case_of(task_, number);
    TouchSetup setup = touch_of(task_, wall, by);
    setup.matrices = tables_[by.person];
    const double depth = price_of(setup).depth;
    ++touches_;
    if (depth > deepest.depth) deepest = {depth, number};
  }
  return deepest;
}

}  // namespace kmax::experiment
