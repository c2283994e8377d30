#include "host_tools/experiment/resolution/resolution_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "control/resolution_criterion.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/setting_check.hpp"

namespace kmax::experiment {

namespace {
constexpr auto resolution_touch_fields = [](auto& touch, const auto& field) {
  field("speed_m_per_s", touch.speed);
  field("unstable", touch.unstable);
  field("without_contact", touch.without_contact);
  field("aborted", touch.aborted);
  field("peak_to_peak_m", touch.peak_to_peak);
  field("lost_records", touch.lost_records);
};

ResolutionTouch judged_touch(const RigTouch& touch) {
  return {touch.speed,
          touch.judgement.verdict == simulation::ContactVerdict::unstable,
          touch.judgement.verdict == simulation::ContactVerdict::no_contact,
          touch.aborted_at.has_value(),
          touch.judgement.peak_to_peak,
          touch.lost_records};
}

ResolutionCell cell_at(const ResolutionWall& wall, double resolution, double step, double speed) {
  ResolutionCell cell;
  cell.resolution = resolution;
  cell.step = step;
  cell.speed = speed;
  cell.force_step = control::force_step(wall.stiffness, step, 1.0, speed, 1.0 / wall.haptic_rate);
  return cell;
}

void add_touch(ResolutionCell& cell, const ResolutionTouch& touch) {
  ++cell.touches;
  cell.without_contact += touch.without_contact ? 1 : 0;
  cell.unstable += touch.unstable ? 1 : 0;
  cell.peak_to_peak = std::max(cell.peak_to_peak, touch.peak_to_peak);
}
}  // namespace

SimulatedRig rig_with(const ResolutionHand& hand, std::vector<simulation::OperatorModel> people,
                      SimulatedHands hands) {
  constexpr SettingCheck check("resolution");
  check("grip", hand.grip, 1e-3, 1e3);
  check("delay", hand.delay, 0.0, 1.0);
  hands.device.delay = hand.delay;
  for (simulation::OperatorModel& person : people) {
    person.grip_stiffness *= hand.grip;
    person.grip_damping *= hand.grip;
  }
  return {"resolution", std::move(people), hands};
}

RigWall rig_wall(const ResolutionWall& wall, double resolution) {
  RigWall set;
  set.stiffness = wall.stiffness;
  set.haptic_rate = wall.haptic_rate;
  set.resolution = resolution;
  set.rounding = wall.rounding;
  return set;
}

TouchPlan resolution_plan(const ResolutionWall& wall, double step, double speed, int number, int touches) {
  TouchPlan plan;
  plan.name = fmt::format("steps of {:g} mm, {:g} mm/s, touch {} of {}", step * 1e3, speed * 1e3, number + 1,
                          touches);
  plan.request = fmt::format(
      "{}: hold the handle outside the wall, lightly; after Enter touch the wall at about {:g} mm in a "
      "second and press on for {:g} s",
      plan.name, speed * 1e3, wall.hold);
  plan.hold_time = wall.hold;
  plan.threshold = wall.threshold;
  plan.phase = static_cast<double>(number) / touches;
  plan.approach_speed = speed;
  return plan;
}

void to_json(RunJournal::Json& json, const ResolutionTouch& touch) {
  write_fields(json, touch, resolution_touch_fields);
}

void from_json(const RunJournal::Json& json, ResolutionTouch& touch) {
  read_fields(json, touch, resolution_touch_fields);
}

RunJournal::Json journal_settings(device::Device& device, const TouchLimits& limits,
                                  const ResolutionSettings& settings) {
  return touch_settings("resolution", device, limits,
                        {{"stiffness_n_per_m", settings.wall.stiffness},
                         {"haptic_rate_hz", settings.wall.haptic_rate},
                         {"hold_time_s", settings.wall.hold},
                         {"threshold_m", settings.wall.threshold},
                         {"rounding", static_cast<int>(settings.wall.rounding)},
                         {"resolutions_m", settings.resolutions},
                         {"speeds_m_per_s", settings.speeds},
                         {"touches", settings.touches}});
}

ResolutionTouches run_resolution(Rig& rig, const ResolutionSettings& settings,
                                 const ProgressReport& progress) {
  constexpr SettingCheck check("resolution");
  check("hold", settings.wall.hold, 1.0, 1000.0);
  check("touches", settings.touches, 1, 1000);
  for (const double speed : settings.speeds) check("speed", speed, 1e-3, 10.0);
  if (settings.pushes.empty() || settings.speeds.empty() || settings.resolutions.empty())
    throw std::invalid_argument("resolution: give at least one resolution, one speed and one push");
  const std::vector<double> pushes = rig.simulated() ? settings.pushes : std::vector{0.0};
  const std::size_t all = settings.resolutions.size() * settings.speeds.size();
  std::size_t done = 0;
  ResolutionTouches run;
  for (const double resolution : settings.resolutions) {
    rig.set(rig_wall(settings.wall, resolution));
    const double step = rig.resolution_step();
    for (const double speed : settings.speeds) {
      if (progress) progress(done++, all);
      ResolutionCell cell = cell_at(settings.wall, resolution, step, speed);
      for (std::size_t person = 0; person < rig.people(); ++person) {
        const std::size_t unstable_before = cell.unstable;
        for (const double push : pushes) {
          for (int number = 0; number < settings.touches; ++number) {
            TouchPlan plan = resolution_plan(settings.wall, step, speed, number, settings.touches);
            // The same step and speed may be asked for twice; the place in the run is asked for once.
            plan.key = fmt::format("{}: {}", run.cells.size() + 1, plan.name);
            plan.person = person;
            plan.push = push;
            const auto touch = rig.touch<ResolutionTouch>(plan, judged_touch);
            run.aborted += touch.aborted ? 1 : 0;
            run.lost_records += touch.lost_records;
            if (!rig.simulated()) cell = cell_at(settings.wall, resolution, step, touch.speed);
            add_touch(cell, touch);
            if (rig.simulated()) continue;
            cell.people = 1;
            cell.people_unstable = cell.unstable;
            run.cells.push_back(cell);
          }
        }
        ++cell.people;
        cell.people_unstable += cell.unstable > unstable_before ? 1 : 0;
      }
      if (rig.simulated()) run.cells.push_back(cell);
    }
  }
  return run;
}

std::vector<ResolutionRun> run_hands(const ResolutionSettings& settings, const ResolutionHand& weak,
                                     const SimulatedHands& hands,
                                     const std::vector<simulation::OperatorModel>& people,
                                     const ProgressReport& progress) {
  const std::array<ResolutionHand, 4> each{{{1.0, 0.0}, {1.0, weak.delay}, {weak.grip, 0.0}, weak}};
  std::vector<ResolutionRun> runs;
  for (const ResolutionHand& hand : each) {
    SimulatedRig rig = rig_with(hand, people, hands);
    runs.push_back(
        {hand, run_resolution(rig, settings, part_of(progress, runs.size(), 1, each.size())).cells});
  }
  return runs;
}

namespace {
std::vector<ResolutionCell> at_resolution(std::span<const ResolutionCell> cells, double resolution) {
  std::vector<ResolutionCell> found;
  for (const ResolutionCell& cell : cells)
    if (cell.resolution == resolution && cell.judged()) found.push_back(cell);
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.speed < b.speed; });
  return found;
}

/// Does `wanted` hold for all the cells that `chosen` picks? Not tested if it picks none.
template <typename Chosen, typename Wanted>
TestedClaim holds_for_all(const std::vector<ResolutionCell>& cells, Chosen chosen, Wanted wanted) {
  std::vector<TestedClaim> each;
  for (const ResolutionCell& cell : cells)
    if (chosen(cell)) each.emplace_back(wanted(cell));
  return all_hold(each);
}
}  // namespace

std::optional<double> onset_speed(std::span<const ResolutionCell> cells, double resolution) {
  std::optional<double> onset;
  const std::vector<ResolutionCell> found = at_resolution(cells, resolution);
  for (auto cell = found.rbegin(); cell != found.rend() && cell->vibrates(); ++cell) onset = cell->speed;
  return onset;
}

ResolutionVerdict judge_resolution(std::span<const ResolutionCell> cells) {
  ResolutionVerdict verdict;
  const auto fine = at_resolution(cells, paper::resolution_verdicts[0].resolution);
  const auto coarse = at_resolution(cells, paper::resolution_verdicts[1].resolution);
  const auto own = at_resolution(cells, 0.0);
  const auto every = [](const ResolutionCell&) { return true; };
  const auto slow = [](const ResolutionCell& cell) { return cell.speed < paper::vibration_onset_speed; };
  const auto fast = [](const ResolutionCell& cell) { return cell.speed > paper::vibration_onset_speed; };
  const auto vibrates = [](const ResolutionCell& cell) { return cell.vibrates(); };
  const auto is_still = [](const ResolutionCell& cell) { return !cell.vibrates(); };
  verdict.coarse_vibrates = holds_for_all(coarse, every, vibrates);
  verdict.fine_is_still = holds_for_all(fine, slow, is_still);
  verdict.fine_vibrates_fast = holds_for_all(fine, fast, vibrates);
  verdict.any_vibrates =
      std::any_of(cells.begin(), cells.end(), [](const ResolutionCell& cell) { return cell.unstable > 0; });
  for (const ResolutionCell& cell : own) {
    for (const ResolutionCell& other : fine) {
      if (other.speed != cell.speed || !other.vibrates()) continue;
      verdict.onset_from_resolution = verdict.onset_from_resolution.value_or(false) || !cell.vibrates();
    }
  }
  return verdict;
}

namespace {
struct VariedSetting {
  ResolutionSettings settings;
  ResolutionHand weak;
  SimulatedHands hands;
  auto numbers() const {
    return std::tuple(weak.grip, weak.delay, hands.device.friction, settings.wall.threshold, settings.pushes,
                      settings.wall.rounding);
  }
};
}  // namespace

std::vector<ResolutionVariation> vary_resolution(const ResolutionSettings& settings,
                                                 const ResolutionHand& weak, const SimulatedHands& hands,
                                                 const std::vector<simulation::OperatorModel>& people,
                                                 const ProgressReport& progress) {
  const VariedSetting own{settings, weak, hands};
  std::vector<std::pair<std::string, VariedSetting>> changes;
  const auto change = [&](std::string name, auto make) {
    VariedSetting changed = own;
    make(changed);
    // What is the setting's own number already differs in none.
    if (changed.numbers() != own.numbers()) changes.emplace_back(std::move(name), changed);
  };
  for (const double grip : {0.15, 0.2, 0.25, 0.3, 0.4})
    change(fmt::format("grip x {:g}", grip), [&](VariedSetting& s) { s.weak.grip = grip; });
  for (const double delay : {0.25e-3, 0.75e-3, 1e-3})
    change(fmt::format("delay {:g} ms", delay * 1e3), [&](VariedSetting& s) { s.weak.delay = delay; });
  for (const double friction : {0.03, 0.093})
    change(fmt::format("friction {:g} N", friction),
           [&](VariedSetting& s) { s.hands.device.friction = friction; });
  for (const double threshold : {0.1e-3, 0.25e-3})
    change(fmt::format("threshold {:g} mm", threshold * 1e3),
           [&](VariedSetting& s) { s.settings.wall.threshold = threshold; });
  change("push 1 N only", [](VariedSetting& s) { s.settings.pushes = {1.0}; });
  for (const auto& [name, rounding] :
       {std::pair("floor", control::Rounding::floor), {"hysteresis", control::Rounding::hysteresis}})
    change(fmt::format("rounding {}", name),
           [rounding = rounding](VariedSetting& s) { s.settings.wall.rounding = rounding; });

  std::vector<ResolutionVariation> variations;
  for (const auto& [name, changed] : changes) {
    if (progress) progress(variations.size(), changes.size());
    SimulatedRig rig = rig_with(changed.weak, people, changed.hands);
    const std::vector<ResolutionCell> cells = run_resolution(rig, changed.settings).cells;
    variations.push_back({name, judge_resolution(cells),
                          onset_speed(cells, paper::resolution_verdicts[1].resolution),
                          onset_speed(cells, paper::resolution_verdicts[0].resolution)});
  }
  return variations;
}

}  // namespace kmax::experiment
