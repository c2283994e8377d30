#include "host_tools/experiment/resolution/resolution_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "control/resolution_criterion.hpp"
#include "host_tools/experiment/setting_check.hpp"
#include "host_tools/experiment/simulated_touch.hpp"

namespace kmax::experiment {

double step_in_use(double resolution, double count_length) {
  return control::resampler_step(resolution, count_length) * count_length;
}

namespace {
constexpr SettingCheck check("resolution");

void require(const ResolutionSettings& settings, const ResolutionHand& hand) {
  check("stiffness", settings.wall.stiffness, 1.0, 1e6);
  check("hold", settings.wall.hold, 1.0, 1000.0);
  check("touches", settings.touches, 1, 1000);
  check("grip", hand.grip, 1e-3, 1e3);
  check("delay", hand.delay, 0.0, 1.0);
  for (const double resolution : settings.resolutions) check("resolution", resolution, 0.0, 0.1);
  for (const double speed : settings.speeds) check("speed", speed, 1e-3, 10.0);
  if (settings.pushes.empty() || settings.speeds.empty() || settings.resolutions.empty())
    throw std::invalid_argument("resolution: give at least one resolution, one speed and one push");
}
}  // namespace

TouchSetup resolution_touch(const ResolutionSettings& settings, const ResolutionHand& hand,
                            const simulation::OperatorModel& person, double resolution) {
  const ResolutionWall& wall = settings.wall;
  TouchSetup setup;
  setup.device = settings.device;
  setup.device.delay = hand.delay;
  setup.person = person;
  setup.person.grip_stiffness *= hand.grip;
  setup.person.grip_damping *= hand.grip;
  setup.threshold = wall.threshold;
  setup.motion.hold_time = wall.hold;
  setup.wall = touched_wall(wall.haptic_rate, settings.count_length, settings.device.force_limit);
  setup.wall.wall.kind = control::WallKind::plain;
  setup.wall.wall.stiffness = static_cast<float>(wall.stiffness);
  setup.wall.position_resolution = resolution;
  setup.wall.position_rounding = wall.rounding;
  return setup;
}

ResolutionCell simulate_resolution(const ResolutionSettings& settings, const ResolutionHand& hand,
                                   const std::vector<simulation::OperatorModel>& people, double resolution,
                                   double speed) {
  require(settings, hand);
  const ResolutionWall& wall = settings.wall;
  ResolutionCell cell;
  cell.resolution = resolution;
  cell.step = step_in_use(resolution, settings.count_length);
  cell.speed = speed;
  cell.force_step = control::force_step(wall.stiffness, cell.step, 1.0, speed, 1.0 / wall.haptic_rate);
  cell.people = people.size();
  for (const simulation::OperatorModel& person : people) {
    TouchSetup setup = resolution_touch(settings, hand, person, resolution);
    setup.motion.approach_speed = speed;
    bool vibrates = false;
    for (const double push : settings.pushes) {
      setup.motion.push_force = push;
      for (int touch = 0; touch < settings.touches; ++touch) {
        const double phase = static_cast<double>(touch) / settings.touches;
        setup.motion.start_position = 0.02 + phase * speed / wall.haptic_rate;
        const TouchOutcome outcome = simulate_touch(setup);
        ++cell.touches;
        cell.without_contact += outcome.verdict == simulation::ContactVerdict::no_contact ? 1 : 0;
        cell.unstable += outcome.unstable() ? 1 : 0;
        vibrates = vibrates || outcome.unstable();
        cell.peak_to_peak = std::max(cell.peak_to_peak, outcome.peak_to_peak);
      }
    }
    cell.people_unstable += vibrates ? 1 : 0;
  }
  return cell;
}

std::vector<ResolutionRun> run_resolution(const ResolutionSettings& settings,
                                          const std::vector<simulation::OperatorModel>& people,
                                          const ProgressReport& tell) {
  check.require_somebody(people);
  const std::array<ResolutionHand, 4> hands{
      {{1.0, 0.0}, {1.0, settings.weak.delay}, {settings.weak.grip, 0.0}, settings.weak}};
  const std::size_t all = hands.size() * settings.resolutions.size() * settings.speeds.size();
  std::size_t done = 0;
  std::vector<ResolutionRun> runs;
  for (const ResolutionHand& hand : hands) {
    runs.push_back({hand, {}});
    for (const double resolution : settings.resolutions) {
      for (const double speed : settings.speeds) {
        if (tell) tell(done, all);
        runs.back().cells.push_back(simulate_resolution(settings, hand, people, resolution, speed));
        ++done;
      }
    }
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
auto varied_numbers(const ResolutionSettings& settings) {
  return std::tuple(settings.weak.grip, settings.weak.delay, settings.device.friction,
                    settings.wall.threshold, settings.pushes, settings.wall.rounding);
}
}  // namespace

std::vector<ResolutionVariation> vary_resolution(const ResolutionSettings& settings,
                                                 const std::vector<simulation::OperatorModel>& people,
                                                 const ProgressReport& tell) {
  std::vector<std::pair<std::string, ResolutionSettings>> changes;
  const auto change = [&](std::string name, auto make) {
    ResolutionSettings changed = settings;
    make(changed);
    // What is the setting's own number already differs in none.
    if (varied_numbers(changed) != varied_numbers(settings)) changes.emplace_back(std::move(name), changed);
  };
  for (const double grip : {0.15, 0.2, 0.25, 0.3, 0.4})
    change(fmt::format("grip x {:g}", grip), [&](ResolutionSettings& s) { s.weak.grip = grip; });
  for (const double delay : {0.25e-3, 0.75e-3, 1e-3})
    change(fmt::format("delay {:g} ms", delay * 1e3), [&](ResolutionSettings& s) { s.weak.delay = delay; });
  for (const double friction : {0.03, 0.093})
    change(fmt::format("friction {:g} N", friction),
           [&](ResolutionSettings& s) { s.device.friction = friction; });
  for (const double threshold : {0.1e-3, 0.25e-3})
    change(fmt::format("threshold {:g} mm", threshold * 1e3),
           [&](ResolutionSettings& s) { s.wall.threshold = threshold; });
  change("push 1 N only", [](ResolutionSettings& s) { s.pushes = {1.0}; });
  change("rounding floor", [](ResolutionSettings& s) { s.wall.rounding = control::Rounding::floor; });
  change("rounding hysteresis",
         [](ResolutionSettings& s) { s.wall.rounding = control::Rounding::hysteresis; });

  std::vector<ResolutionVariation> variations;
  for (const auto& [name, changed] : changes) {
    if (tell) tell(variations.size(), changes.size());
    std::vector<ResolutionCell> cells;
    for (const double resolution : changed.resolutions)
      for (const double speed : changed.speeds)
        cells.push_back(simulate_resolution(changed, changed.weak, people, resolution, speed));
    variations.push_back({name, judge_resolution(cells),
                          onset_speed(cells, paper::resolution_verdicts[1].resolution),
                          onset_speed(cells, paper::resolution_verdicts[0].resolution)});
  }
  return variations;
}

}  // namespace kmax::experiment
