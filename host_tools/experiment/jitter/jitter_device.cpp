#include "host_tools/experiment/jitter/jitter_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/experiment/restored_afterwards.hpp"
#include "host_tools/experiment/touch_journal.hpp"

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

void to_json(RunJournal::Json& json, const JitterDeviceTouch& touch) {
  json = {{"touched", touch.measure.touched},
          {"settled", touch.measure.settled},
          {"jitter_m", touch.measure.amplitude},
          {"adjustment_time_s", touch.measure.adjustment_time},
          {"beyond_limit_share", touch.measure.beyond_limit_share},
          {"aborted", touch.aborted},
          {"limited_share", touch.limited_share},
          {"lost_records", touch.lost_records}};
}

void from_json(const RunJournal::Json& json, JitterDeviceTouch& touch) {
  json.at("touched").get_to(touch.measure.touched);
  json.at("settled").get_to(touch.measure.settled);
  json.at("jitter_m").get_to(touch.measure.amplitude);
  json.at("adjustment_time_s").get_to(touch.measure.adjustment_time);
  json.at("beyond_limit_share").get_to(touch.measure.beyond_limit_share);
  json.at("aborted").get_to(touch.aborted);
  json.at("limited_share").get_to(touch.limited_share);
  json.at("lost_records").get_to(touch.lost_records);
}

RunJournal::Json journal_settings(device::Device& device, const JitterDeviceSettings& settings) {
  RunJournal::Json all = {{"experiment", "jitter"}};
  all.update(device_circumstances(device, settings.axis));
  all.update(RunJournal::Json{{"stiffness_n_per_m", settings.wall.stiffness},
                              {"haptic_rate_hz", settings.wall.haptic_rate},
                              {"window_s", settings.wall.window},
                              {"settled_time_s", settings.wall.settled_time},
                              {"touches", settings.touches},
                              {"force_limit_n", settings.force_limit},
                              {"abort_amplitude_m", settings.abort_amplitude}});
  return all;
}

namespace {
JitterDeviceTouch touch_once(device::Device& device, const JitterDeviceSettings& settings,
                             const paper::JitterCell& pair, const std::string& name,
                             const TouchSession& session) {
  const JitterWall& wall = settings.wall;
  TouchWatch watch;
  watch.axis = settings.axis;
  watch.name = name;
  watch.hold_time = wall.window;
  watch.contact_patience = settings.patience;
  watch.abort_amplitude = settings.abort_amplitude;
  const std::string at_once =
      pair.background > 0.0 ? fmt::format("{:g} N act at once, ", pair.background) : "";
  if (session.prompter != nullptr)
    session.prompter->ask(
        fmt::format("{}: hold the handle outside the wall; after Enter touch the wall and keep the "
                    "handle there for {:g} s "
                    "({}inside {:g} N push it back)",
                    name, wall.window, at_once, pair.background + pair.interference));
  const WatchedTouch touch = watch_touch(device, watch, session.tell);
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
  std::vector<std::string> changed = jitter_assignments(wall, {});
  const auto protective = protective_assignments(device, settings.axis, settings.force_limit);
  changed.insert(changed.end(), protective.begin(), protective.end());
  const RestoredAfterwards restored(device, settings.axis, changed, notice);
  device.apply(device::parse_assignments(protective, settings.axis));

  const TouchSession session{prompter, journal, tell};
  JitterDeviceResult all;
  all.force_limit = device.read_number(fmt::format("axis{}.force.limit", settings.axis));
  for (const paper::JitterCell& pair : settings.pairs) {
    device.apply(device::parse_assignments(jitter_assignments(wall, pair), settings.axis));
    std::vector<JitterMeasure> measures;
    std::size_t aborted = 0;
    for (int number = 0; number < settings.touches; ++number) {
      const std::string name = fmt::format("F_B = {:g} N, F_I = {:g} N, touch {} of {}", pair.background,
                                           pair.interference, number + 1, settings.touches);
      const auto touch = journaled_touch<JitterDeviceTouch>(
          session, name, name, [&] { return touch_once(device, settings, pair, name, session); });
      all.lost_records += touch.lost_records;
      all.limited_share = std::max(all.limited_share, touch.limited_share);
      if (touch.aborted) {
        ++aborted;
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
