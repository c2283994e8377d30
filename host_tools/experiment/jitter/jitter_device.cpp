#include "host_tools/experiment/jitter/jitter_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/experiment/journal_fields.hpp"

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

namespace {
constexpr auto journal_fields = [](auto& touch, const auto& field) {
  field("touched", touch.measure.touched);
  field("settled", touch.measure.settled);
  field("jitter_m", touch.measure.amplitude);
  field("adjustment_time_s", touch.measure.adjustment_time);
  field("beyond_limit_share", touch.measure.beyond_limit_share);
  field("aborted", touch.aborted);
  field("limited_share", touch.limited_share);
  field("lost_records", touch.lost_records);
};
}  // namespace

void to_json(RunJournal::Json& json, const JitterDeviceTouch& touch) {
  write_fields(json, touch, journal_fields);
}

void from_json(const RunJournal::Json& json, JitterDeviceTouch& touch) {
  read_fields(json, touch, journal_fields);
}

RunJournal::Json journal_settings(device::Device& device, const JitterDeviceSettings& settings) {
  return touch_settings("jitter", device, settings,
                        {{"stiffness_n_per_m", settings.wall.stiffness},
                         {"haptic_rate_hz", settings.wall.haptic_rate},
                         {"window_s", settings.wall.window},
                         {"settled_time_s", settings.wall.settled_time},
                         {"touches", settings.touches}});
}

namespace {
JitterDeviceTouch touch_once(const LimitedTouches& touches, const JitterWall& wall,
                             const paper::JitterCell& pair, const std::string& name) {
  const std::string at_once =
      pair.background > 0.0 ? fmt::format("{:g} N act at once, ", pair.background) : "";
  touches.ask(
      fmt::format("{}: hold the handle outside the wall; after Enter touch the wall and keep the "
                  "handle there for {:g} s "
                  "({}inside {:g} N push it back)",
                  name, wall.window, at_once, pair.background + pair.interference));
  const WatchedTouch touch = touches.watch(name, wall.window);
  JitterDeviceTouch made;
  made.lost_records = touch.lost_records;
  made.limited_share = touch.limited_share;
  made.aborted = touch.aborted_at.has_value();
  if (made.aborted) return made;
  std::vector<JitterSample> samples;
  for (const device::TraceSample& sample : touch.samples)
    samples.push_back({sample.time, touch.side * (sample.position - touch.surface), sample.force});
  made.measure = measure_jitter(samples, wall);
  return made;
}
}  // namespace

JitterDeviceResult run_jitter_on_device(device::Device& device, const JitterDeviceSettings& settings,
                                        calibration::Prompter* prompter, const Tell& tell,
                                        RunJournal* journal, const Tell& notice) {
  const JitterWall& wall = settings.wall;
  LimitedTouches touches(device, settings, jitter_assignments(wall, {}), {prompter, journal, tell, notice});
  JitterDeviceResult all;
  all.force_limit = touches.force_limit();
  for (const paper::JitterCell& pair : settings.pairs) {
    touches.set(jitter_assignments(wall, pair));
    std::vector<JitterMeasure> measures;
    std::size_t aborted = 0;
    for (int number = 0; number < settings.touches; ++number) {
      const std::string name = fmt::format("F_B = {:g} N, F_I = {:g} N, touch {} of {}", pair.background,
                                           pair.interference, number + 1, settings.touches);
      const auto touch =
          touches.touch<JitterDeviceTouch>(name, name, [&] { return touch_once(touches, wall, pair, name); });
      all.lost_records += touch.lost_records;
      all.limited_share = std::max(all.limited_share, touch.limited_share);
      if (touch.aborted) {
        ++aborted;
      } else if (touch.lost_records > 0) {
        if (notice)
          notice(fmt::format("{}: not counted, {} records of its trace were lost", name, touch.lost_records));
      } else {
        measures.push_back(touch.measure);
      }
    }
    all.results.push_back(mean_jitter(pair, measures));
    all.results.back().aborted = aborted;
  }
  return all;
}

}  // namespace kmax::experiment
