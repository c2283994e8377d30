#include "host_tools/experiment/max_stiffness/device_max_stiffness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "host_tools/experiment/run_journal.hpp"

namespace kmax::experiment {

using simulation::ContactVerdict;

namespace {
constexpr std::array<std::pair<ContactVerdict, std::string_view>, 3> verdict_names = {
    {{ContactVerdict::stable, "stable"},
     {ContactVerdict::unstable, "unstable"},
     {ContactVerdict::no_contact, "no_contact"}}};

constexpr auto journal_fields = [](auto& touch, const auto& field) {
  field("peak_to_peak_m", touch.peak_to_peak);
  field("limited_share", touch.limited_share);
  field("aborted", touch.aborted);
  field("lost_records", touch.lost_records);
};

DeviceStiffnessTouch touch_once(Rig& rig, const StiffnessCondition& condition,
                                const DeviceStiffnessSettings& settings, double stiffness,
                                std::size_t trial) {
  RigWall wall;
  wall.stiffness = stiffness;
  wall.law = condition.law;
  wall.magnetic_coefficient = condition.magnetic_coefficient;
  wall.mode = condition.mode;
  TouchPlan plan;
  plan.wall = settings.touch.wall_of(wall);
  plan.name =
      fmt::format("{}, {:g} N/mm, touch {} of {}", condition.name, stiffness / 1000, trial, settings.trials);
  plan.key = fmt::format("{}, {} N/m, touch {}", condition.name, stiffness, trial);
  plan.request = press_request(plan.name, settings.touch.hold_time);
  plan.hold_time = settings.touch.hold_time;
  plan.threshold = settings.touch.threshold;
  auto made = rig.touch<DeviceStiffnessTouch>(plan, [](const RigTouch& touch) {
    return DeviceStiffnessTouch{0,
                                0,
                                touch.judgement.verdict,
                                touch.judgement.peak_to_peak,
                                touch.limited_share,
                                touch.aborted_at.has_value(),
                                touch.lost_records};
  });
  made.stiffness = stiffness;
  made.trial = trial;
  return made;
}
}  // namespace

void to_json(RunJournal::Json& json, const DeviceStiffnessTouch& touch) {
  const auto name = std::find_if(verdict_names.begin(), verdict_names.end(),
                                 [&](const auto& entry) { return entry.first == touch.verdict; });
  json = {{"verdict", name->second}};
  write_fields(json, touch, journal_fields);
}

void from_json(const RunJournal::Json& json, DeviceStiffnessTouch& touch) {
  const auto& verdict = json.at("verdict").get_ref<const std::string&>();
  const auto entry = std::find_if(verdict_names.begin(), verdict_names.end(),
                                  [&](const auto& one) { return one.second == verdict; });
  if (entry == verdict_names.end()) throw std::invalid_argument("no verdict: " + verdict);
  touch.verdict = entry->first;
  read_fields(json, touch, journal_fields);
}

RunJournal::Json journal_settings(device::Device& device, const TouchLimits& limits,
                                  const DeviceStiffnessSettings& settings) {
  return touch_settings("max-stiffness", device, limits,
                        {{"position_resolution_m", 0},
                         {"haptic_rate_hz", settings.touch.haptic_rate},
                         {"changed", settings.touch.changes.words()},
                         {"hold_time_s", settings.touch.hold_time},
                         {"threshold_m", settings.touch.threshold},
                         {"start_n_per_m", settings.steps.first},
                         {"start_adaptive_n_per_m", settings.steps.first_of(true)},
                         {"step_n_per_m", settings.steps.step},
                         {"last_n_per_m", settings.steps.last},
                         {"trials", settings.trials}});
}

DeviceStiffnessResult find_max_stiffness(Rig& rig, const StiffnessCondition& condition,
                                         const DeviceStiffnessSettings& settings) {
  DeviceStiffnessResult result{condition, {}, {}};
  StiffnessClimb climb(settings.steps, condition.adaptive());
  while (const auto stiffness = climb.next()) {
    bool stable = true;
    double limited = 0.0;
    for (std::size_t trial = 1; stable && trial <= settings.trials; ++trial) {
      const DeviceStiffnessTouch touch = touch_once(rig, condition, settings, *stiffness, trial);
      result.touches.push_back(touch);
      ++result.found.touches;
      limited = std::max(limited, touch.limited_share);
      stable = touch.verdict == ContactVerdict::stable;
      result.found.never_touched = touch.verdict == ContactVerdict::no_contact;
      if (touch.verdict == ContactVerdict::unstable) result.found.ending_peak_to_peak = touch.peak_to_peak;
    }
    if (result.found.never_touched) {
      climb.give_up();
      break;
    }
    climb.record(stable);
    if (stable) result.found.saturated_share = limited;
  }
  result.found.stiffness = climb.result();
  result.found.beyond_last = climb.beyond_last();
  return result;
}

bool order_is_the_papers(const std::vector<DeviceStiffnessResult>& results) {
  const auto measured = [](const DeviceStiffnessResult& result) {
    return !result.found.beyond_last && !result.found.never_touched;
  };
  const auto plain = std::find_if(results.begin(), results.end(), [](const DeviceStiffnessResult& result) {
    return !result.condition.adaptive() && result.condition.magnetic_coefficient == 0.0;
  });
  if (plain == results.end() || !measured(*plain)) return true;
  return std::all_of(results.begin(), results.end(), [&](const DeviceStiffnessResult& result) {
    const bool claimed = result.condition.adaptive() || result.condition.magnetic_coefficient >= 2.0;
    return !claimed || !measured(result) || result.found.stiffness > plain->found.stiffness;
  });
}

}  // namespace kmax::experiment
