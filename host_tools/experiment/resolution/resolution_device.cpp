#include "host_tools/experiment/resolution/resolution_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "control/resolution_criterion.hpp"
#include "host_tools/experiment/journal_fields.hpp"

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

constexpr auto journal_fields = [](auto& touch, const auto& field) {
  field("speed_m_per_s", touch.speed);
  field("unstable", touch.unstable);
  field("without_contact", touch.without_contact);
  field("aborted", touch.aborted);
  field("peak_to_peak_m", touch.peak_to_peak);
  field("lost_records", touch.lost_records);
};
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
  write_fields(json, touch, journal_fields);
}

void from_json(const RunJournal::Json& json, ResolutionDeviceTouch& touch) {
  read_fields(json, touch, journal_fields);
}

RunJournal::Json journal_settings(device::Device& device, const ResolutionDeviceSettings& settings) {
  return touch_settings("resolution", device, settings,
                        {{"stiffness_n_per_m", settings.wall.stiffness},
                         {"haptic_rate_hz", settings.wall.haptic_rate},
                         {"hold_time_s", settings.wall.hold},
                         {"threshold_m", settings.wall.threshold},
                         {"rounding", static_cast<int>(settings.wall.rounding)},
                         {"resolutions_m", settings.resolutions},
                         {"speeds_m_per_s", settings.speeds},
                         {"touches", settings.touches}});
}

namespace {
ResolutionDeviceTouch touch_once(const LimitedTouches& touches, const ResolutionWall& wall, double speed,
                                 const std::string& name) {
  touches.ask(
      fmt::format("{}: hold the handle outside the wall, lightly; after Enter touch the wall at "
                  "about {:g} mm in a second "
                  "and press on for {:g} s",
                  name, speed * 1e3, wall.hold));
  const WatchedTouch touch = touches.watch(name, wall.hold);
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
  LimitedTouches touches(device, settings, assignments_for(wall, 0.0), {prompter, journal, tell, notice});
  ResolutionDeviceResult all;
  all.force_limit = touches.force_limit();
  for (const double resolution : settings.resolutions) {
    touches.set(assignments_for(wall, resolution));
    const double step = device.read_number(fmt::format("axis{}.measured.resolution", settings.axis));
    for (const double speed : settings.speeds) {
      for (int number = 0; number < settings.touches; ++number) {
        const std::string name = fmt::format("steps of {:g} mm, {:g} mm/s, touch {} of {}", step * 1e3,
                                             speed * 1e3, number + 1, settings.touches);
        // The same step and speed may be asked for twice; the place in the run is asked for once.
        const std::string key = fmt::format("{}: {}", all.cells.size() + 1, name);
        const auto touch = touches.touch<ResolutionDeviceTouch>(
            key, name, [&] { return touch_once(touches, wall, speed, name); });
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
