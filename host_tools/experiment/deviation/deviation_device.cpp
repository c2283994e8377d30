#include "host_tools/experiment/deviation/deviation_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/experiment/restored_afterwards.hpp"
#include "host_tools/experiment/touch_journal.hpp"

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
  json = {{"deviation_before_m", touch.measure.without},
          {"deviation_m", touch.measure.with},
          {"pulses", touch.measure.pulses},
          {"contact_share", touch.contact_share},
          {"limited_share", touch.limited_share},
          {"aborted", touch.aborted},
          {"lost_records", touch.lost_records}};
}

void from_json(const RunJournal::Json& json, DeviationDeviceTouch& touch) {
  json.at("deviation_before_m").get_to(touch.measure.without);
  json.at("deviation_m").get_to(touch.measure.with);
  json.at("pulses").get_to(touch.measure.pulses);
  json.at("contact_share").get_to(touch.contact_share);
  json.at("limited_share").get_to(touch.limited_share);
  json.at("aborted").get_to(touch.aborted);
  json.at("lost_records").get_to(touch.lost_records);
}

RunJournal::Json journal_settings(device::Device& device, const DeviationDeviceSettings& settings) {
  const DeviationProtocol& protocol = settings.protocol;
  RunJournal::Json all = {{"experiment", "deviation"}};
  all.update(device_circumstances(device, settings.axis));
  all.update(RunJournal::Json{{"other_axis", device_circumstances(device, 1 - settings.axis)},
                              {"stiffness_n_per_m", protocol.stiffness},
                              {"haptic_rate_hz", protocol.haptic_rate},
                              {"rest_s", protocol.rest},
                              {"pulse_on_s", protocol.pulse_on},
                              {"pulse_off_s", protocol.pulse_off},
                              {"pulses", protocol.pulses},
                              {"force_limit_n", settings.force_limit},
                              {"abort_amplitude_m", settings.abort_amplitude},
                              {"wall_abort_amplitude_m", settings.wall_abort_amplitude}});
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

DeviationDeviceTouch touch_once(device::Device& device, const DeviationDeviceSettings& settings,
                                const paper::DeviationCell& pair, const std::string& name,
                                const TouchSession& session) {
  const DeviationProtocol& protocol = settings.protocol;
  // The touch before has left its last forces behind.
  device.apply(device::parse_assignments(assignments_for(protocol, settings.axis), settings.axis));
  TouchWatch watch;
  watch.axis = settings.axis;
  watch.name = name;
  watch.hold_time = protocol.duration() + 0.1;
  watch.contact_patience = settings.patience;
  watch.abort_amplitude = settings.abort_amplitude;
  const std::string later = pair.background > 0.0 ? fmt::format(", and after {:g} s {:g} N away from it",
                                                                protocol.onset(), pair.background)
                                                  : "";
  if (session.prompter != nullptr)
    session.prompter->ask(
        fmt::format("{}: hold the handle outside the wall; after Enter press it firmly against the wall "
                    "and keep it on the spot "
                    "for {:g} s (pulses of {:g} N act along the wall{})",
                    name, watch.hold_time, pair.interference, later));
  const auto changes = deviation_changes(protocol, pair.background, pair.interference);
  const TwoAxisTouch touch =
      watch_two_axes(device, watch, changes, session.tell, settings.wall_abort_amplitude);
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
  std::vector<std::string> protective = protective_assignments(device, settings.axis, settings.force_limit);
  for (const std::string& other : protective_assignments(device, 1 - settings.axis, settings.force_limit))
    if (!other.starts_with("link.")) protective.push_back(other);
  std::vector<std::string> changed = assignments_for(settings.protocol, settings.axis);
  changed.insert(changed.end(), protective.begin(), protective.end());
  const RestoredAfterwards restored(device, settings.axis, changed, notice);
  device.apply(device::parse_assignments(protective, settings.axis));

  const TouchSession session{prompter, journal, tell};
  DeviationDeviceResult all;
  all.force_limit = device.read_number(fmt::format("axis{}.force.limit", settings.axis));
  for (const paper::DeviationCell& pair : settings.pairs) {
    const std::string name = fmt::format("F_B = {:g} N, F_I = {:g} N", pair.background, pair.interference);
    const auto touch = journaled_touch<DeviationDeviceTouch>(
        session, name, name, [&] { return touch_once(device, settings, pair, name, session); });
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
