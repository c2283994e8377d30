#include "host_tools/experiment/deviation_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/experiment/restored_afterwards.hpp"

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
      changes.push_back({protocol.onset(), {fmt::format("interference.background_force={}", background)}});
    const double begin = protocol.pulse_begin(pulse);
    changes.push_back({begin, {fmt::format("interference.force={}", interference)}});
    changes.push_back({begin + protocol.pulse_on, {no_interference}});
  }
  return changes;
}

DeviationDeviceResult run_deviation_on_device(device::Device& device, const DeviationDeviceSettings& settings,
                                              calibration::Prompter* prompter, const Tell& tell) {
  const DeviationProtocol& protocol = settings.protocol;
  const std::vector<std::string> setup = assignments_for(protocol, settings.axis);
  std::vector<std::string> protective = protective_assignments(device, settings.axis, settings.force_limit);
  for (const std::string& other : protective_assignments(device, 1 - settings.axis, settings.force_limit))
    if (!other.starts_with("link.")) protective.push_back(other);
  std::vector<std::string> changed = setup;
  changed.insert(changed.end(), protective.begin(), protective.end());
  const RestoredAfterwards restored(device, settings.axis, changed);
  device.apply(device::parse_assignments(protective, settings.axis));

  DeviationDeviceResult all;
  all.force_limit = device.read_number(fmt::format("axis{}.force.limit", settings.axis));
  for (const paper::DeviationCell& pair : settings.pairs) {
    device.apply(device::parse_assignments(setup, settings.axis));
    TouchWatch watch;
    watch.axis = settings.axis;
    watch.name = fmt::format("F_B = {:g} N, F_I = {:g} N", pair.background, pair.interference);
    watch.hold_time = protocol.duration() + 0.1;
    watch.contact_patience = settings.patience;
    watch.abort_amplitude = settings.abort_amplitude;
    const std::string later = pair.background > 0.0 ? fmt::format(", and after {:g} s {:g} N away from it",
                                                                  protocol.onset(), pair.background)
                                                    : "";
    if (prompter != nullptr)
      prompter->ask(
          fmt::format("{}: hold the handle outside the wall; after Enter press it firmly against the wall "
                      "and keep it on the spot "
                      "for {:g} s (pulses of {:g} N act along the wall{})",
                      watch.name, watch.hold_time, pair.interference, later));
    const auto changes = deviation_changes(protocol, pair.background, pair.interference);
    const TwoAxisTouch touch = watch_two_axes(device, watch, changes, tell);
    all.lost_records += touch.lost_records;
    all.limited_share = std::max(all.limited_share, touch.limited_share);

    std::vector<DeviationSample> samples;
    for (const device::TraceSample& sample : touch.samples)
      samples.push_back({sample.time, sample.position, sample.force});
    std::vector<double> begins;
    for (std::size_t change = 0; change < touch.change_times.size(); ++change) {
      const std::string& assignment = changes[change].assignments.front();
      if (assignment != no_interference && assignment.starts_with("interference.force="))
        begins.push_back(touch.change_times[change]);
    }
    DeviationTouch measured;
    measured.touched = !touch.aborted_at;
    measured.contact_share = touch.contact_share;
    measured.measure = measure_deviation(samples, begins, protocol.pulse_on);
    all.results.push_back(mean_deviation(pair, {&measured, 1}));
    all.results.back().aborted = touch.aborted_at ? 1 : 0;
  }
  return all;
}

}  // namespace kmax::experiment
