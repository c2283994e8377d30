#include "host_tools/experiment/contact/contact_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "host_tools/device/value_text.hpp"

namespace kmax::experiment {

std::vector<ContactCondition> contact_conditions() {
  std::vector<ContactCondition> conditions;
  for (const paper::ContactVerdict& verdict : paper::contact_verdicts) {
    const auto add = [&](const std::string& name, std::vector<std::string> assignments) {
      conditions.push_back({name, std::string(verdict.figure), std::move(assignments),
                            std::string(verdict.words), verdict.stable});
    };
    if (!verdict.adaptive) {
      const std::string coefficient = fmt::format("{:g}", verdict.magnetic_coefficient);
      add(fmt::format("F_MC = {} N", coefficient),
          {"wall.law=magnetic", fmt::format("wall.magnetic_coefficient={}", coefficient)});
      continue;
    }
    for (const char* mode : {"instant", "latched", "peak_hold"})
      add(fmt::format("adaptive, {}", mode),
          {"wall.law=adaptive", fmt::format("wall.adaptive_mode={}", mode)});
  }
  return conditions;
}

std::vector<std::string> contact_setup(const ContactSettings& settings) {
  return {fmt::format("wall.stiffness={}", settings.stiffness),
          fmt::format("haptic.rate={}", settings.haptic_rate),
          "wall.damping=0",
          "position.resolution=0",
          "wall.magnetic_length=0.001",
          "wall.adaptive_gain=2.4",
          "wall.adaptive_offset=0.8",
          "wall.adaptive_velocity_max=2.4",
          "wall.adaptive_relation=linear",
          "wall.adaptive_velocity=approach",
          "wall.adaptive_force_min=0.8",
          "wall.adaptive_force_max=2",
          "wall.adaptive_hold_time=1.2",
          "interference.mode=none"};
}

std::vector<std::string> contact_changes(const ContactSettings& settings) {
  std::vector<std::string> changed = contact_setup(settings);
  for (const char* name :
       {"wall.law", "wall.magnetic_coefficient", "wall.adaptive_mode", "force.limit", "link.timeout"})
    changed.push_back(name);
  return changed;
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

ContactResult run_contact(device::Device& device, const ContactCondition& condition,
                          const ContactSettings& settings, const Tell& tell) {
  std::vector<std::string> assignments = contact_setup(settings);
  for (const auto& more :
       {condition.assignments, protective_assignments(device, settings.axis, settings.force_limit)})
    assignments.insert(assignments.end(), more.begin(), more.end());
  device.apply(device::parse_assignments(assignments, settings.axis));
  const device::Parameter estimator(firmware::entry_of<"velocity.estimator">(), settings.axis);

  ContactResult result;
  result.condition = condition;
  result.velocity_estimator = device::value_text(estimator, device.read(estimator));
  TouchWatch watch;
  watch.axis = settings.axis;
  watch.name = condition.name;
  watch.hold_time = settings.hold_time;
  watch.contact_patience = settings.contact_patience;
  watch.abort_amplitude = settings.abort_amplitude;
  WatchedTouch touch = watch_touch(device, watch, tell);
  result.measure = measure_touch(touch, settings.hold_time, settings.threshold);
  result.surface = touch.surface;
  result.side = touch.side;
  result.judged_to = settings.hold_time;
  result.judged_from = settings.hold_time - std::min(1.0, settings.hold_time);
  result.limited_share = touch.limited_share;
  result.lost_records = touch.lost_records;
  result.aborted_at = touch.aborted_at;
  result.samples = std::move(touch.samples);
  return result;
}

}  // namespace kmax::experiment
