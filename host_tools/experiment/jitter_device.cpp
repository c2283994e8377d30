#include "host_tools/experiment/jitter_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/experiment/restored_afterwards.hpp"

namespace kmax::experiment {

std::vector<std::string> jitter_assignments(const JitterWall& wall, const paper::JitterCell& pair) {
  return {"wall.law=plain",
          "wall.damping=0",
          "position.resolution=0",
          "interference.mode=perpendicular",
          "interference.onset_time=0",
          fmt::format("wall.stiffness={}", wall.stiffness),
          fmt::format("haptic.rate={}", wall.haptic_rate),
          fmt::format("interference.force={}", pair.interference),
          fmt::format("interference.background_force={}", pair.background)};
}

JitterDeviceResult run_jitter_on_device(device::Device& device, const JitterDeviceSettings& settings,
                                        calibration::Prompter* prompter, const Tell& tell) {
  const JitterWall& wall = settings.wall;
  std::vector<std::string> changed = jitter_assignments(wall, {});
  const auto protective = protective_assignments(device, settings.axis, settings.force_limit);
  changed.insert(changed.end(), protective.begin(), protective.end());
  const RestoredAfterwards restored(device, settings.axis, changed);
  device.apply(device::parse_assignments(protective, settings.axis));

  JitterDeviceResult all;
  all.force_limit = device.read_number(fmt::format("axis{}.force.limit", settings.axis));
  for (const paper::JitterCell& pair : settings.pairs) {
    device.apply(device::parse_assignments(jitter_assignments(wall, pair), settings.axis));
    std::vector<JitterMeasure> measures;
    std::size_t aborted = 0;
    for (int number = 0; number < settings.touches; ++number) {
      TouchWatch watch;
      watch.axis = settings.axis;
      watch.name = fmt::format("F_B = {:g} N, F_I = {:g} N, touch {} of {}", pair.background,
                               pair.interference, number + 1, settings.touches);
      watch.hold_time = wall.window;
      watch.contact_patience = settings.patience;
      watch.abort_amplitude = settings.abort_amplitude;
      const std::string at_once =
          pair.background > 0.0 ? fmt::format("{:g} N act at once, ", pair.background) : "";
      if (prompter != nullptr)
        prompter->ask(
            fmt::format("{}: hold the handle outside the wall; after Enter touch the wall and keep the "
                        "handle there for {:g} s "
                        "({}inside {:g} N push it back)",
                        watch.name, wall.window, at_once, pair.background + pair.interference));
      const WatchedTouch touch = watch_touch(device, watch, tell);
      all.lost_records += touch.lost_records;
      all.limited_share = std::max(all.limited_share, touch.limited_share);
      if (touch.aborted_at) {
        ++aborted;
        continue;
      }
      std::vector<JitterSample> samples;
      for (const device::TraceSample& sample : touch.samples)
        samples.push_back({sample.time, touch.side * (sample.position - touch.surface), sample.force});
      measures.push_back(measure_jitter(samples, wall));
    }
    all.results.push_back(mean_jitter(pair, measures));
    all.results.back().aborted = aborted;
  }
  return all;
}

}  // namespace kmax::experiment
