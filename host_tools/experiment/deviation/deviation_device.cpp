#include "host_tools/experiment/deviation/deviation_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/experiment/journal_fields.hpp"

namespace kmax::experiment {
namespace {
constexpr const char* no_interference = "interference.force=0";

std::vector<std::string> assignments_for(const DeviationProtocol& protocol, std::size_t wall_axis) {
  const auto other = [&](const char* text) { return fmt::format("axis{}.{}", 1 - wall_axis, text); };
  return {"wall.law=plain",
          "wall.damping=0",
          "position.resolution=0",
          "interference.mode=parallel",
          "interference.onset_time=0",
          no_interference,
          "interference.background_force=0",
          fmt::format("wall.stiffness={}", protocol.stiffness),
          fmt::format("haptic.rate={}", protocol.haptic_rate),
          other("wall.law=none"),
          other("position.resolution=0"),
          other("interference.mode=none"),
          other(fmt::format("haptic.rate={}", protocol.haptic_rate).c_str())};
}

constexpr auto journal_fields = [](auto& touch, const auto& field) {
  field("deviation_before_m", touch.measure.without);
  field("deviation_m", touch.measure.with);
  field("pulses", touch.measure.pulses);
  field("contact_share", touch.contact_share);
  field("limited_share", touch.limited_share);
  field("aborted", touch.aborted);
  field("lost_records", touch.lost_records);
};
}  // namespace

std::vector<TimedChange> deviation_changes(const DeviationProtocol& protocol, double background,
                                           double interference) {
  std::vector<TimedChange> changes;
  for (int pulse = 0; pulse < 2 * protocol.pulses; ++pulse) {
    if (pulse == protocol.pulses)
      changes.push_back(
          {protocol.onset(), {fmt::format("interference.background_force={}", background)}, true});
    const double begin = protocol.pulse_begin(pulse);
    changes.push_back({begin, {fmt::format("interference.force={}", interference)}});
    changes.push_back({begin + protocol.pulse_on, {no_interference}});
  }
  return changes;
}

void to_json(RunJournal::Json& json, const DeviationDeviceTouch& touch) {
  write_fields(json, touch, journal_fields);
}

void from_json(const RunJournal::Json& json, DeviationDeviceTouch& touch) {
  read_fields(json, touch, journal_fields);
}

RunJournal::Json journal_settings(device::Device& device, const DeviationDeviceSettings& settings) {
  const DeviationProtocol& protocol = settings.protocol;
  RunJournal::Json all = touch_settings("deviation", device, settings,
                                        {{"other_axis", device_circumstances(device, 1 - settings.axis)},
                                         {"stiffness_n_per_m", protocol.stiffness},
                                         {"haptic_rate_hz", protocol.haptic_rate},
                                         {"rest_s", protocol.rest},
                                         {"pulse_on_s", protocol.pulse_on},
                                         {"pulse_off_s", protocol.pulse_off},
                                         {"pulses", protocol.pulses}});
  all["wall_abort_amplitude_m"] = settings.wall_abort_amplitude;
  return all;
}

namespace {
/// When the pulses that were made began, s after the touch.
std::vector<double> pulse_begins(const std::vector<TimedChange>& changes, const TwoAxisTouch& touch) {
  std::vector<double> begins;
  for (std::size_t change = 0; change < touch.change_times.size(); ++change) {
    const std::string& assignment = changes[change].assignments.front();
    if (assignment != no_interference && assignment.starts_with("interference.force="))
      begins.push_back(touch.change_times[change]);
  }
  return begins;
}

DeviationDeviceTouch touch_once(device::Device& device, LimitedTouches& touches,
                                const DeviationDeviceSettings& settings, const paper::DeviationCell& pair,
                                const std::string& name) {
  const DeviationProtocol& protocol = settings.protocol;
  // The touch before has left its last forces behind.
  touches.set(assignments_for(protocol, settings.axis));
  const TouchWatch watch = watch_within(settings, name, protocol.duration() + 0.1);
  const std::string later = pair.background > 0.0 ? fmt::format(", and after {:g} s {:g} N away from it",
                                                                protocol.onset(), pair.background)
                                                  : "";
  touches.ask(
      fmt::format("{}: hold the handle outside the wall; after Enter press it firmly against the wall "
                  "and keep it on the spot "
                  "for {:g} s (pulses of {:g} N act along the wall{})",
                  name, watch.hold_time, pair.interference, later));
  const auto changes = deviation_changes(protocol, pair.background, pair.interference);
  const TwoAxisTouch touch =
      watch_two_axes(device, watch, changes, touches.tell(), settings.wall_abort_amplitude);
  std::vector<DeviationSample> samples;
  for (const device::TraceSample& sample : touch.samples)
    samples.push_back({sample.time, sample.position, sample.force});
  DeviationDeviceTouch made;
  made.measure = measure_deviation(samples, pulse_begins(changes, touch), protocol.pulse_on);
  made.contact_share = touch.contact_share;
  made.limited_share = touch.limited_share;
  made.aborted = touch.aborted_at.has_value();
  made.lost_records = touch.lost_records;
  return made;
}
}  // namespace

DeviationDeviceResult run_deviation_on_device(device::Device& device, const DeviationDeviceSettings& settings,
                                              calibration::Prompter* prompter, const Tell& tell,
                                              RunJournal* journal, const Tell& notice) {
  LimitedTouches touches(device, settings, assignments_for(settings.protocol, settings.axis),
                         {prompter, journal, tell, notice}, {1 - settings.axis});
  DeviationDeviceResult all;
  all.force_limit = touches.force_limit();
  for (const paper::DeviationCell& pair : settings.pairs) {
    const std::string name = fmt::format("F_B = {:g} N, F_I = {:g} N", pair.background, pair.interference);
    const auto touch = touches.touch<DeviationDeviceTouch>(
        name, name, [&] { return touch_once(device, touches, settings, pair, name); });
    all.lost_records += touch.lost_records;
    all.limited_share = std::max(all.limited_share, touch.limited_share);
    DeviationTouch measured;
    measured.touched = !touch.aborted && touch.counts();
    measured.contact_share = touch.contact_share;
    measured.measure = touch.measure;
    all.results.push_back(mean_deviation(pair, {&measured, 1}));
    all.results.back().aborted = touch.aborted ? 1 : 0;
    all.results.back().without_contact = touch.counts() ? 0 : 1;
    all.results.back().contact_share = touch.contact_share;
  }
  return all;
}

}  // namespace kmax::experiment
