#include "host_tools/experiment/contact/contact_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace kmax::experiment {

namespace {
using control::AdaptiveMode;
constexpr std::pair<AdaptiveMode, const char*> adaptive_modes[] = {{AdaptiveMode::instant, "instant"},
                                                                   {AdaptiveMode::latched, "latched"},
                                                                   {AdaptiveMode::peak_hold, "peak_hold"}};
}  // namespace

std::vector<ContactCondition> contact_conditions() {
  std::vector<ContactCondition> conditions;
  for (const paper::ContactVerdict& verdict : paper::contact_verdicts) {
    const auto add = [&](const std::string& name, std::vector<std::string> assignments, const RigWall& wall) {
      conditions.push_back({name, std::string(verdict.figure), std::move(assignments),
                            std::string(verdict.words), verdict.stable, wall});
    };
    RigWall wall;
    wall.law = verdict.adaptive ? control::WallKind::adaptive : control::WallKind::magnetic;
    wall.magnetic_coefficient = verdict.magnetic_coefficient;
    if (!verdict.adaptive) {
      const std::string coefficient = fmt::format("{:g}", verdict.magnetic_coefficient);
      add(fmt::format("F_MC = {} N", coefficient),
          {"wall.law=magnetic", fmt::format("wall.magnetic_coefficient={}", coefficient)}, wall);
      continue;
    }
    for (const auto& [mode, name] : adaptive_modes) {
      wall.mode = mode;
      add(fmt::format("adaptive, {}", name),
          {"wall.law=adaptive", fmt::format("wall.adaptive_mode={}", name)}, wall);
    }
  }
  return conditions;
}

TouchLimits contact_limits() {
  TouchLimits limits;
  limits.abort_amplitude = 5e-3;
  limits.patience = 10.0;
  return limits;
}

std::string press_request(const std::string& name, double hold_time) {
  return fmt::format(
      "{}: take the handle out of the wall and be ready to press it against the wall for {:g} s", name,
      hold_time);
}

ContactResult worst_of(std::vector<ContactResult> trials) {
  std::size_t unstable = 0;
  std::uint64_t lost = 0;
  for (const ContactResult& trial : trials) {
    unstable += trial.measure.verdict == simulation::ContactVerdict::unstable ? 1 : 0;
    lost += trial.lost_records;
  }
  // An unstable trial outweighs any stable one, whatever a single slip of that one measured.
  ContactResult worst =
      *std::max_element(trials.begin(), trials.end(), [](const ContactResult& a, const ContactResult& b) {
        const auto weight = [](const ContactResult& trial) {
          return std::pair(trial.measure.verdict == simulation::ContactVerdict::unstable,
                           trial.measure.peak_to_peak);
        };
        return weight(a) < weight(b);
      });
  worst.trials = trials.size();
  worst.unstable_trials = unstable;
  worst.lost_records = lost;
  return worst;
}

ContactResult run_contact(Rig& rig, const ContactCondition& condition, const ContactSettings& settings) {
  RigWall wall = settings.wall_of(condition.wall);
  wall.stiffness = settings.stiffness;
  TouchPlan plan;
  plan.wall = wall;
  plan.name = condition.name;
  plan.request = press_request(condition.name, settings.hold_time);
  plan.hold_time = settings.hold_time;
  plan.threshold = settings.threshold;
  return rig.touch<ContactResult>(plan, [&](RigTouch touch) {
    ContactResult result;
    result.condition = condition;
    result.papers_wall = settings.papers_wall();
    result.measure = touch.judgement;
    result.surface = touch.surface;
    result.side = touch.side;
    result.judged_to = settings.hold_time;
    result.judged_from = settings.hold_time - std::min(1.0, settings.hold_time);
    result.contact_speed = touch.speed;
    result.limited_share = touch.limited_share;
    result.lost_records = touch.lost_records;
    result.aborted_at = touch.aborted_at;
    result.samples = std::move(touch.samples);
    return result;
  });
}

std::vector<ContactResult> run_contacts(Rig& rig, const ContactSettings& settings, std::size_t trials,
                                        const std::function<void(std::size_t made, std::size_t all)>& touches,
                                        const std::function<void(const ContactResult&)>& found) {
  const std::vector<ContactCondition> conditions = contact_conditions();
  const std::size_t all = conditions.size() * trials;
  std::vector<ContactResult> results;
  for (const ContactCondition& condition : conditions) {
    std::vector<ContactResult> of_condition;
    while (of_condition.size() < trials) {
      touches(results.size() * trials + of_condition.size(), all);
      of_condition.push_back(run_contact(rig, condition, settings));
    }
    results.push_back(worst_of(std::move(of_condition)));
    if (found) found(results.back());
  }
  return results;
}

}  // namespace kmax::experiment
