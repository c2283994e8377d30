#include "host_tools/experiment/contact_experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "host_tools/device/drive.hpp"
#include "host_tools/device/errors.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::experiment {

using device::TraceSample;

std::vector<ContactCondition> contact_conditions() {
  const auto magnetic = [](const char* coefficient) {
    return std::vector<std::string>{"wall.law=magnetic",
                                    fmt::format("wall.magnetic_coefficient={}", coefficient)};
  };
  const auto adaptive = [](const char* mode) {
    return std::vector<std::string>{"wall.law=adaptive", fmt::format("wall.adaptive_mode={}", mode)};
  };
  return {
      {"F_MC = 0 N", "9", magnetic("0"), "large sustained oscillation", false},
      {"F_MC = 1 N", "10", magnetic("1"), "smaller oscillation, not stable", false},
      {"F_MC = 2 N", "11", magnetic("2"), "stable", true},
      {"adaptive, instant", "12", adaptive("instant"), "stable", true},
      {"adaptive, latched", "12", adaptive("latched"), "stable", true},
      {"adaptive, peak_hold", "12", adaptive("peak_hold"), "stable", true},
  };
}

std::vector<std::string> contact_setup(const ContactSettings& settings) {
  return {fmt::format("wall.stiffness={}", settings.stiffness),
          fmt::format("haptic.rate={}", settings.haptic_rate),
          "wall.damping=0",
          "wall.magnetic_length=0.001",
          "wall.adaptive_gain=2.4",
          "wall.adaptive_offset=0.8",
          "wall.adaptive_velocity_max=2.4",
          "wall.adaptive_relation=linear",
          "wall.adaptive_velocity=approach",
          "wall.adaptive_force_min=0.8",
          "wall.adaptive_force_max=2",
          "wall.adaptive_hold_time=1.2",
          "interference.mode=none"};
}

namespace {

/// Removes the force whatever happens.
class ArmedWhile {
 public:
  ArmedWhile(device::Device& device, std::size_t axis) : drive_(device, axis) { drive_.arm(); }
  ~ArmedWhile() {
    try {
      drive_.disarm();
    } catch (const std::exception&) {
      // The link is gone: link.timeout removes the force on the device.
    }
  }
  ArmedWhile(const ArmedWhile&) = delete;
  ArmedWhile& operator=(const ArmedWhile&) = delete;

  void require_armed() {
    const device::DriveStatus status = drive_.status();
    if (status.armed()) return;
    throw device::DeviceError(
        fmt::format("the axis lost its force during the trial: {}",
                    status.faulty() ? status.fault_words() : std::string(device::words_of(status.state()))));
  }

 private:
  device::Drive drive_;
};

double number(device::Device& device, std::size_t axis, const char* name) {
  return device.read_number(fmt::format("axis{}.{}", axis, name));
}

/// Whoever pressed in the trial before may still be inside the wall, where arming is refused: waits until the
/// handle is out, as long as the patience lasts.
void wait_until_outside(device::Device& device, const ContactResult& result, const ContactSettings& settings,
                        const std::function<void(const std::string&)>& tell) {
  const auto begin = device.link().now();
  const auto outside = [&] {
    return result.side * (number(device, settings.axis, "measured.position") - result.surface) > 0.0;
  };
  while (!outside() &&
         device.link().now() - begin < std::chrono::duration<double>(settings.contact_patience)) {
    tell(fmt::format("{}: take the handle out of the wall", result.condition.name));
    device.link().wait(std::chrono::milliseconds(200));
  }
}

}  // namespace

RestoredAfterwards::RestoredAfterwards(device::Device& device, const ContactSettings& settings)
    : device_(device) {
  std::vector<std::string> changed = contact_setup(settings);
  changed.push_back("wall.law=plain");
  changed.push_back("wall.magnetic_coefficient=0");
  changed.push_back("wall.adaptive_mode=instant");
  before_ = device::parse_assignments(changed, settings.axis);
  for (device::Assignment& assignment : before_) assignment.raw = device_.read(assignment.parameter);
}

RestoredAfterwards::~RestoredAfterwards() {
  try {
    device_.apply(before_);
  } catch (const std::exception&) {
    // The link is gone, and with it the way to put anything back.
  }
}

ContactResult worst_of(std::vector<ContactResult> trials) {
  std::size_t unstable = 0;
  std::uint64_t lost = 0;
  for (const ContactResult& trial : trials) {
    unstable += trial.measure.verdict == simulation::ContactVerdict::unstable ? 1 : 0;
    lost += trial.lost_records;
  }
  // An unstable trial outweighs any stable one, whatever a single slip of that one measured.
  ContactResult worst =
      *std::max_element(trials.begin(), trials.end(), [](const ContactResult& a, const ContactResult& b) {
        const auto weight = [](const ContactResult& trial) {
          return std::pair(trial.measure.verdict == simulation::ContactVerdict::unstable,
                           trial.measure.peak_to_peak);
        };
        return weight(a) < weight(b);
      });
  worst.trials = trials.size();
  worst.unstable_trials = unstable;
  worst.lost_records = lost;
  return worst;
}

ContactResult run_contact(device::Device& device, const ContactCondition& condition,
                          const ContactSettings& settings,
                          const std::function<void(const std::string&)>& tell) {
  ContactResult result;
  result.condition = condition;
  std::vector<std::string> assignments = contact_setup(settings);
  assignments.insert(assignments.end(), condition.assignments.begin(), condition.assignments.end());
  device.apply(device::parse_assignments(assignments, settings.axis));
  result.surface = number(device, settings.axis, "wall.position");
  result.side = number(device, settings.axis, "wall.side");
  const device::Parameter estimator(firmware::entry_of<"velocity.estimator">(), settings.axis);
  result.velocity_estimator = device::value_text(estimator, device.read(estimator));

  wait_until_outside(device, result, settings, tell);
  device::TraceReader trace(device, settings.axis);
  double touched = -1.0;
  {
    ArmedWhile armed(device, settings.axis);
    constexpr double afterwards = 0.3;                         // s of the release, for the picture
    constexpr auto longest_silence = std::chrono::seconds(2);  // of the trace; each request takes < 1 s
    std::size_t looked_at = 0;
    auto last_news = device.link().now();
    for (int round = 0;; ++round) {
      device.link().wait(std::chrono::milliseconds(20));
      trace.read(result.samples);
      if (looked_at < result.samples.size()) last_news = device.link().now();
      for (; looked_at < result.samples.size(); ++looked_at) {
        if (touched < 0 && result.outside_distance(result.samples[looked_at]) <= 0.0)
          touched = result.samples[looked_at].time;
      }
      // Without this the axis would stay armed for ever.
      if (device.link().now() - last_news > longest_silence)
        throw device::DeviceError("the trace has stopped during the trial; does another program use it?");
      const double now = result.samples.empty() ? 0.0 : result.samples.back().time;
      if (touched < 0 && now > settings.contact_patience)
        throw device::DeviceError(
            fmt::format("nobody touched the wall within {} s of arming; press the handle against it",
                        settings.contact_patience));
      if (touched >= 0 && now >= touched + settings.hold_time + afterwards) break;
      if (round % 10 != 0) continue;
      armed.require_armed();
      tell(touched < 0 ? fmt::format("{}: waiting for the touch", condition.name)
                       : fmt::format("{}: holding, {:.1f} of {:.1f} s", condition.name,
                                     std::min(now - touched, settings.hold_time), settings.hold_time));
    }
    armed.require_armed();
    const double all = number(device, settings.axis, "measured.armed_samples");
    result.limited_share = all > 0 ? number(device, settings.axis, "measured.limited_samples") / all : 0.0;
  }
  trace.stop();

  for (TraceSample& sample : result.samples) sample.time -= touched;
  result.lost_records = trace.lost();
  result.judged_to = settings.hold_time;
  result.judged_from = settings.hold_time - std::min(1.0, settings.hold_time);
  std::vector<simulation::ContactSample> positions;
  for (const TraceSample& sample : result.samples) positions.push_back({sample.time, sample.position});
  simulation::ContactCriterion criterion;
  criterion.window_begin = result.judged_from;
  criterion.window_end = result.judged_to;
  criterion.threshold = settings.threshold;
  criterion.wall_position = result.surface;
  criterion.wall_side = result.side;
  result.measure = simulation::measure_contact(positions, criterion);
  return result;
}

}  // namespace kmax::experiment
