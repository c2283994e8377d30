#include "host_tools/experiment/resolution_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "control/resolution_criterion.hpp"
#include "host_tools/experiment/restored_afterwards.hpp"

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

ResolutionDeviceResult run_resolution_on_device(device::Device& device,
                                                const ResolutionDeviceSettings& settings,
                                                calibration::Prompter* prompter, const Tell& tell) {
  const ResolutionWall& wall = settings.wall;
  std::vector<std::string> changed = assignments_for(wall, 0.0);
  const auto protective = protective_assignments(device, settings.axis, settings.force_limit);
  changed.insert(changed.end(), protective.begin(), protective.end());
  const RestoredAfterwards restored(device, settings.axis, changed);
  device.apply(device::parse_assignments(protective, settings.axis));

  ResolutionDeviceResult all;
  all.force_limit = device.read_number(fmt::format("axis{}.force.limit", settings.axis));
  for (const double resolution : settings.resolutions) {
    device.apply(device::parse_assignments(assignments_for(wall, resolution), settings.axis));
    const double step = device.read_number(fmt::format("axis{}.measured.resolution", settings.axis));
    for (const double speed : settings.speeds) {
      for (int number = 0; number < settings.touches; ++number) {
        TouchWatch watch;
        watch.axis = settings.axis;
        watch.name = fmt::format("steps of {:g} mm, {:g} mm/s, touch {} of {}", step * 1e3, speed * 1e3,
                                 number + 1, settings.touches);
        watch.hold_time = wall.hold;
        watch.contact_patience = settings.patience;
        watch.abort_amplitude = settings.abort_amplitude;
        if (prompter != nullptr)
          prompter->ask(
              fmt::format("{}: hold the handle outside the wall, lightly; after Enter touch the wall at "
                          "about {:g} mm in a second "
                          "and press on for {:g} s",
                          watch.name, speed * 1e3, wall.hold));
        const WatchedTouch touch = watch_touch(device, watch, tell);
        const simulation::ContactMeasure measure = measure_touch(touch, wall.hold, wall.threshold);

        ResolutionCell cell;
        cell.resolution = resolution;
        cell.step = step;
        cell.speed = std::max(0.0, touch_speed(touch));
        cell.force_step =
            control::force_step(wall.stiffness, cell.step, 1.0, cell.speed, 1.0 / wall.haptic_rate);
        cell.touches = cell.people = 1;
        cell.unstable = cell.people_unstable =
            measure.verdict == simulation::ContactVerdict::unstable ? 1 : 0;
        cell.without_contact = measure.verdict == simulation::ContactVerdict::no_contact ? 1 : 0;
        cell.peak_to_peak = measure.peak_to_peak;
        all.cells.push_back(cell);
        all.asked_speeds.push_back(speed);
        all.aborted.push_back(touch.aborted_at.has_value());
        all.lost_records += touch.lost_records;
      }
    }
  }
  return all;
}

}  // namespace kmax::experiment
