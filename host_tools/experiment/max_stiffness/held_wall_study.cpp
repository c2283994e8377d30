#include "host_tools/experiment/max_stiffness/held_wall_study.hpp"

#include <algorithm>

#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {
namespace {

HeldWall hold(TouchSetup setup, const TouchProtocol& protocol) {
  HeldWall held;
  setup.threshold = protocol.threshold;
  setup.matrices = std::make_shared<simulation::PropagatorTable>(setup.device, setup.person, study_gain_bits);
  std::vector<TouchSample> whole;  // asked for, so that every touch goes on to its end
  for (const double speed : protocol.approach_speeds) {
    for (const double push : protocol.pushes) {
      setup.motion.approach_speed = speed;
      setup.motion.push_force = push;
      whole.clear();
      const TouchOutcome outcome = simulate_touch(setup, &whole);
      ++held.touches;
      held.unstable += outcome.unstable() ? 1 : 0;
      held.worst = std::max(held.worst, outcome.peak_to_peak);
    }
  }
  return held;
}

const paper::ContactVerdict* printed(const StiffnessCondition& condition) {
  for (const paper::ContactVerdict& verdict : paper::contact_verdicts) {
    if (verdict.adaptive == condition.adaptive &&
        (condition.adaptive || verdict.magnetic_coefficient == condition.magnetic_coefficient))
      return &verdict;
  }
  return nullptr;
}

}  // namespace

std::size_t HeldWallResult::stable_people() const {
  return static_cast<std::size_t>(
      std::count_if(people.begin(), people.end(), [](const HeldWall& held) { return held.stable(); }));
}

double HeldWallResult::median_worst() const {
  if (people.empty()) return 0.0;
  std::vector<double> sorted;
  for (const HeldWall& held : people) sorted.push_back(held.worst);
  std::sort(sorted.begin(), sorted.end());
  return 0.5 * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]);
}

std::vector<HeldWallResult> run_held_walls(const SubjectSet& set, double stiffness, const StiffnessRun& run) {
  simulation::OperatorModel named;
  named.activation_gain = set.subjects.front().person.activation_gain;
  std::vector<HeldWallResult> results;
  std::vector<TouchSetup> setups;  // each condition's people, then the named one
  for (const StiffnessCondition& condition : stiffness_conditions()) {
    const paper::ContactVerdict* verdict = printed(condition);
    if (verdict == nullptr) continue;
    results.push_back({condition, std::string(verdict->figure), verdict->stable, {}, {}});
    results.back().condition.origin = report::Origin::predicted;
    for (const Subject& subject : set.subjects)
      setups.push_back(touch_setup(set.device, subject.person, condition));
    setups.push_back(touch_setup(set.device, named, condition));
  }
  for (TouchSetup& setup : setups) {
    setup.wall.wall.stiffness = static_cast<float>(stiffness);
    setup.integrator = run.integrator;
  }
  const std::vector<HeldWall> held = collect_jobs<HeldWall>(
      setups.size(), run.threads, [&](std::size_t index) { return hold(setups[index], run.protocol); },
      run.progress);
  auto next = held.begin();
  for (HeldWallResult& result : results) {
    const auto end = next + static_cast<std::ptrdiff_t>(set.subjects.size());
    result.people.assign(next, end);
    result.named = *end;
    next = end + 1;
  }
  return results;
}

}  // namespace kmax::experiment
