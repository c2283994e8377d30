#include "host_tools/experiment/resolution/resolution_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "control/resolution_criterion.hpp"
#include "host_tools/experiment/restored_afterwards.hpp"
#include "host_tools/experiment/touch_journal.hpp"

namespace kmax::experiment {
namespace {
std::vector<std::string> assignments_for(const ResolutionWall& wall, double resolution) {
  constexpr const char* roundings[] = {"nearest", "floor", "hysteresis"};
  return {"wall.law=plain",
          "wall.damping=0",
          "interference.mode=none",
          fmt::format("wall.stiffness={}", wall.stiffness),
          fmt::format("haptic.rate={}", wall.haptic_rate),
          fmt::format("position.resolution={}", resolution),
          fmt::format("position.rounding={}", roundings[static_cast<std::size_t>(wall.rounding)])};
}

}  // namespace

double touch_speed(const WatchedTouch& touch) {
  constexpr double span = 0.03;  // s
  const device::TraceSample* first = nullptr;
  const device::TraceSample* last = nullptr;
  for (const device::TraceSample& sample : touch.samples) {
    if (sample.time < -span || sample.time > 0.0) continue;
    if (first == nullptr) first = &sample;
    last = &sample;
  }
  if (first == nullptr || last->time <= first->time) return 0.0;
  return -touch.side * (last->position - first->position) / (last->time - first->time);
}

void to_json(RunJournal::Json& json, const ResolutionDeviceTouch& touch) {
  json = {{"speed_m_per_s", touch.speed},
          {"unstable", touch.unstable},
          {"without_contact", touch.without_contact},
          {"aborted", touch.aborted},
          {"peak_to_peak_m", touch.peak_to_peak},
          {"lost_records", touch.lost_records}};
}

void from_json(const RunJournal::Json& json, ResolutionDeviceTouch& touch) {
  json.at("speed_m_per_s").get_to(touch.speed);
  json.at("unstable").get_to(touch.unstable);
  json.at("without_contact").get_to(touch.without_contact);
  json.at("aborted").get_to(touch.aborted);
  json.at("peak_to_peak_m").get_to(touch.peak_to_peak);
  json.at("lost_records").get_to(touch.lost_records);
}

RunJournal::Json journal_settings(device::Device& device, const ResolutionDeviceSettings& settings) {
  RunJournal::Json all = {{"experiment", "resolution"}};
  all.update(device_circumstances(device, settings.axis));
  all.update(RunJournal::Json{{"stiffness_n_per_m", settings.wall.stiffness},
                              {"haptic_rate_hz", settings.wall.haptic_rate},
                              {"hold_time_s", settings.wall.hold},
                              {"threshold_m", settings.wall.threshold},
                              {"rounding", static_cast<int>(settings.wall.rounding)},
                              {"resolutions_m", settings.resolutions},
                              {"speeds_m_per_s", settings.speeds},
                              {"touches", settings.touches},
                              {"force_limit_n", settings.force_limit},
                              {"abort_amplitude_m", settings.abort_amplitude}});
  return all;
}

namespace {
ResolutionDeviceTouch touch_once(device::Device& device, const ResolutionDeviceSettings& settings,
                                 double speed, const std::string& name, const TouchSession& session) {
  const ResolutionWall& wall = settings.wall;
  TouchWatch watch;
  watch.axis = settings.axis;
  watch.name = name;
  watch.hold_time = wall.hold;
  watch.contact_patience = settings.patience;
  watch.abort_amplitude = settings.abort_amplitude;
  if (session.prompter != nullptr)
    session.prompter->ask(
        fmt::format("{}: hold the handle outside the wall, lightly; after Enter touch the wall at "
                    "about {:g} mm in a second "
                    "and press on for {:g} s",
                    name, speed * 1e3, wall.hold));
  const WatchedTouch touch = watch_touch(device, watch, session.tell);
  const simulation::ContactMeasure measure = measure_touch(touch, wall.hold, wall.threshold);
  ResolutionDeviceTouch made;
  made.speed = std::max(0.0, touch_speed(touch));
  made.unstable = measure.verdict == simulation::ContactVerdict::unstable;
  made.without_contact = measure.verdict == simulation::ContactVerdict::no_contact;
  made.aborted = touch.aborted_at.has_value();
  made.peak_to_peak = measure.peak_to_peak;
  made.lost_records = touch.lost_records;
  return made;
}

ResolutionCell cell_of(const ResolutionDeviceTouch& touch, const ResolutionWall& wall, double resolution,
                       double step) {
  ResolutionCell cell;
  cell.resolution = resolution;
  cell.step = step;
  cell.speed = touch.speed;
  cell.force_step = control::force_step(wall.stiffness, cell.step, 1.0, cell.speed, 1.0 / wall.haptic_rate);
  cell.touches = cell.people = 1;
  cell.unstable = cell.people_unstable = touch.unstable ? 1 : 0;
  cell.without_contact = touch.without_contact ? 1 : 0;
  cell.peak_to_peak = touch.peak_to_peak;
  return cell;
}
}  // namespace

ResolutionDeviceResult run_resolution_on_device(device::Device& device,
                                                const ResolutionDeviceSettings& settings,
                                                calibration::Prompter* prompter, const Tell& tell,
                                                RunJournal* journal, const Tell& notice) {
  const ResolutionWall& wall = settings.wall;
  std::vector<std::string> changed = assignments_for(wall, 0.0);
  const auto protective = protective_assignments(device, settings.axis, settings.force_limit);
  changed.insert(changed.end(), protective.begin(), protective.end());
  const RestoredAfterwards restored(device, settings.axis, changed, notice);
  device.apply(device::parse_assignments(protective, settings.axis));

  const TouchSession session{prompter, journal, tell};
  ResolutionDeviceResult all;
  all.force_limit = device.read_number(fmt::format("axis{}.force.limit", settings.axis));
  for (const double resolution : settings.resolutions) {
    device.apply(device::parse_assignments(assignments_for(wall, resolution), settings.axis));
    const double step = device.read_number(fmt::format("axis{}.measured.resolution", settings.axis));
    for (const double speed : settings.speeds) {
      for (int number = 0; number < settings.touches; ++number) {
        const std::string name = fmt::format("steps of {:g} mm, {:g} mm/s, touch {} of {}", step * 1e3,
                                             speed * 1e3, number + 1, settings.touches);
        // The same step and speed may be asked for twice; the place in the run is asked for once.
        const std::string key = fmt::format("{}: {}", all.cells.size() + 1, name);
        const auto touch = journaled_touch<ResolutionDeviceTouch>(
            session, key, name, [&] { return touch_once(device, settings, speed, name, session); });
        all.cells.push_back(cell_of(touch, wall, resolution, step));
        all.asked_speeds.push_back(speed);
        all.aborted.push_back(touch.aborted);
        all.lost_records += touch.lost_records;
      }
    }
  }
  return all;
}

}  // namespace kmax::experiment
