#include "host_tools/experiment/watched_touch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "host_tools/device/drive.hpp"

namespace kmax::experiment {

using device::TraceSample;
using std::chrono::milliseconds;

namespace {
constexpr double afterwards = 0.3;                         // s of the release, for the picture
constexpr auto longest_silence = std::chrono::seconds(2);  // of the trace; each request takes < 1 s
constexpr double trace_rate = 500.0;                       // records per s: 8 kB/s of 11.5 at 115200 baud
constexpr double longest_timeout = 1.0;                    // s an axis may push that nobody watches

/// Removes the force whatever happens.
class ArmedWhile {
 public:
  ArmedWhile(device::Device& device, std::size_t axis) : drive_(device, axis) { drive_.arm(); }
  ~ArmedWhile() {
    try {
      if (armed_) drive_.disarm();
    } catch (const std::exception&) {
      // The link is gone: link.timeout removes the force on the device.
    }
  }
  ArmedWhile(const ArmedWhile&) = delete;
  ArmedWhile& operator=(const ArmedWhile&) = delete;

  void require_armed() {
    const device::DriveStatus status = drive_.status();
    if (!status.armed()) fail_without_force(status);
  }
  /// An axis that stays armed is an error to be told.
  void disarm() {
    drive_.disarm();
    armed_ = false;
  }
  /// After disarming: what the touch was aborted for at `time` of the trace happened under force.
  void require_force_until(double time, const LateAbort& late) {
    const device::DriveStatus status = drive_.status();
    if (late.is_late(time, status)) fail_without_force(status);
  }

 private:
  [[noreturn]] static void fail_without_force(const device::DriveStatus& status) {
    throw device::DeviceError(
        fmt::format("the axis lost its force during the trial: {}",
                    status.faulty() ? status.fault_words() : std::string(device::to_string(status.state()))));
  }

  device::Drive drive_;
  bool armed_ = true;
};

/// Whether contact_measure.hpp has enough to judge: two samples in every quarter of the window.
bool can_be_judged(const std::vector<simulation::ContactSample>& positions,
                   const simulation::ContactCriterion& criterion) {
  std::array<std::size_t, 4> count{};
  const double length = criterion.window_end - criterion.window_begin;
  for (const simulation::ContactSample& sample : positions) {
    if (sample.time < criterion.window_begin || sample.time >= criterion.window_end) continue;
    const double part = (sample.time - criterion.window_begin) / length * 4.0;
    ++count[std::min<std::size_t>(3, static_cast<std::size_t>(part))];
  }
  return *std::min_element(count.begin(), count.end()) >= 2;
}

/// Whoever pressed in the trial before may still be inside the wall, where arming is refused: waits until the
/// handle is out, as long as the patience lasts.
void wait_until_outside(device::Device& device, const WatchedTouch& touch, const TouchWatch& watch,
                        const ReportText& report) {
  const auto begin = device.link().now();
  const auto outside = [&] {
    return touch.side * (axis_number(device, watch.axis, "measured.position") - touch.surface) > 0.0;
  };
  while (!outside() && device.link().now() - begin < std::chrono::duration<double>(watch.contact_patience)) {
    report(fmt::format("{}: take the handle out of the wall", watch.name));
    device.link().wait(milliseconds(200));
  }
}

/// What the loop knows of the samples so far.
class Progress {
 public:
  Progress(const TouchWatch& watch, WatchedTouch& touch) : watch_(watch), touch_(touch) {}

  /// Looks at the samples that have come since the last time. False: there are none.
  bool look() {
    if (looked_at_ == touch_.samples.size()) return false;
    for (; looked_at_ < touch_.samples.size() && !touch_.aborted_at; ++looked_at_) {
      const TraceSample& sample = touch_.samples[looked_at_];
      if (!touched() && touch_.side * (sample.position - touch_.surface) <= 0.0) {
        first_ = looked_at_;
        touched_ = sample.time;
      }
      if (!touched() || watch_.abort_amplitude <= 0.0 || sample.time > touched_ + watch_.hold_time) continue;
      const std::span<const TraceSample> since(&touch_.samples[first_], looked_at_ - first_ + 1);
      const double amplitude = oscillation(since, watch_.abort_window);
      if (amplitude <= watch_.abort_amplitude) continue;
      touch_.aborted_at = sample.time - touched_;
      touch_.aborted_amplitude = amplitude;
    }
    return true;
  }

  double now() const { return touch_.samples.empty() ? 0.0 : touch_.samples.back().time; }
  bool touched() const { return touched_ >= 0.0; }
  double touched_at() const { return touched_; }
  bool over() const { return touched() && now() >= touched_ + watch_.hold_time + afterwards; }

  std::string words() const {
    if (!touched()) return fmt::format("{}: waiting for the touch", watch_.name);
    return fmt::format("{}: holding, {:.1f} of {:.1f} s", watch_.name,
                       std::min(now() - touched_, watch_.hold_time), watch_.hold_time);
  }

 private:
  const TouchWatch& watch_;
  WatchedTouch& touch_;
  std::size_t looked_at_ = 0, first_ = 0;
  double touched_ = -1.0;
};
}  // namespace

double axis_number(device::Device& device, std::size_t axis, const char* name) {
  return device.read_number(fmt::format("axis{}.{}", axis, name));
}

double oscillation(std::span<const TraceSample> samples, double window) {
  if (samples.empty()) return 0.0;
  const double begin = samples.back().time - window;
  double low = samples.back().position, high = low;  // of what follows, since this goes backwards
  double rise = 0.0, fall = 0.0;
  for (auto sample = samples.rbegin(); sample != samples.rend() && sample->time >= begin; ++sample) {
    rise = std::max(rise, high - sample->position);
    fall = std::max(fall, sample->position - low);
    low = std::min(low, sample->position);
    high = std::max(high, sample->position);
  }
  return std::min(rise, fall);
}

void require_sound(const TouchWatch& watch) {
  // With a NaN no comparison would ever end the touch.
  const bool times = std::isfinite(watch.hold_time) && watch.hold_time > 0.0 &&
                     std::isfinite(watch.contact_patience) && watch.contact_patience > 0.0;
  const bool abort = std::isfinite(watch.abort_amplitude) && watch.abort_amplitude >= 0.0 &&
                     std::isfinite(watch.abort_window) && watch.abort_window > 0.0;
  if (times && abort) return;
  throw std::invalid_argument(
      fmt::format("a touch held for {} s, waited for {} s, ended by {} m within {} s: all must be finite, "
                  "the times above 0, the amplitude 0 or above",
                  watch.hold_time, watch.contact_patience, watch.abort_amplitude, watch.abort_window));
}

namespace {
/// Somebody came to the wall between the look and the arming, which was refused.
class CameTooSoon : public device::DeviceError {
 public:
  using device::DeviceError::DeviceError;
};

WatchedTouch watch_once(device::Device& device, const TouchWatch& watch, const ReportText& report) {
  WatchedTouch touch;
  touch.surface = axis_number(device, watch.axis, "wall.position");
  touch.side = axis_number(device, watch.axis, "wall.side");
  wait_until_outside(device, touch, watch, report);
  const double thinning =
      std::max(1.0, std::round(axis_number(device, watch.axis, "haptic.rate") / trace_rate));
  device::TraceReader trace(device, watch.axis, static_cast<std::uint16_t>(thinning));
  Progress progress(watch, touch);
  LateAbort late;
  {
    std::optional<ArmedWhile> holding;
    try {
      holding.emplace(device, watch.axis);
    } catch (const device::DeviceError& error) {
      if (touch.side * (axis_number(device, watch.axis, "measured.position") - touch.surface) > 0.0) throw;
      throw CameTooSoon(error.what());
    }
    ArmedWhile& armed = *holding;
    auto last_news = device.link().now();
    for (int round = 0; !progress.over(); ++round) {
      device.link().wait(milliseconds(20));
      trace.read(touch.samples);
      if (progress.look()) last_news = device.link().now();
      late.looked(progress.now());
      if (touch.aborted_at) break;
      // Without this the axis would stay armed for ever.
      if (device.link().now() - last_news > longest_silence)
        throw device::DeviceError("the trace has stopped during the trial; does another program use it?");
      if (!progress.touched() && progress.now() > watch.contact_patience)
        throw NobodyTouched(
            fmt::format("nobody touched the wall within {} s of arming; press the handle against it",
                        watch.contact_patience));
      if (round % 10 != 0 || progress.over()) continue;
      armed.require_armed();
      report(progress.words());
    }
    if (!touch.aborted_at) armed.require_armed();
    armed.disarm();
    if (touch.aborted_at) armed.require_force_until(progress.touched_at() + *touch.aborted_at, late);
  }
  trace.stop();
  const double all = axis_number(device, watch.axis, "measured.armed_samples");
  touch.limited_share = all > 0 ? axis_number(device, watch.axis, "measured.limited_samples") / all : 0.0;
  touch.lost_records = trace.lost();
  for (TraceSample& sample : touch.samples) sample.time -= progress.touched_at();
  return touch;
}
}  // namespace

WatchedTouch watch_touch(device::Device& device, const TouchWatch& watch, const ReportText& report) {
  require_sound(watch);
  const auto begin = device.link().now();
  for (;;) {
    try {
      return watch_once(device, watch, report);
    } catch (const CameTooSoon&) {
      const std::chrono::duration<double> waited = device.link().now() - begin;
      if (waited.count() >= watch.contact_patience) throw;
    }
  }
}

simulation::ContactMeasure measure_touch(const WatchedTouch& touch, double hold_time, double threshold) {
  if (touch.aborted_at) {
    simulation::ContactMeasure measure;
    measure.verdict = simulation::ContactVerdict::unstable;
    measure.peak_to_peak = touch.aborted_amplitude;
    measure.samples = touch.samples.size();
    for (const TraceSample& sample : touch.samples)
      measure.deepest = std::max(measure.deepest, touch.side * (touch.surface - sample.position));
    return measure;
  }
  std::vector<simulation::ContactSample> positions;
  for (const TraceSample& sample : touch.samples) positions.push_back({sample.time, sample.position});
  simulation::ContactCriterion criterion;
  criterion.window_begin = hold_time - std::min(1.0, hold_time);
  criterion.window_end = hold_time;
  criterion.threshold = threshold;
  criterion.wall_position = touch.surface;
  criterion.wall_side = touch.side;
  if (!can_be_judged(positions, criterion)) return {};
  return simulation::measure_contact(positions, criterion);
}

std::vector<std::string> protective_assignments(device::Device& device, std::size_t axis,
                                                double force_limit) {
  std::vector<std::string> assignments;
  if (axis_number(device, axis, "force.limit") > force_limit)
    assignments.push_back(fmt::format("axis{}.force.limit={}", axis, force_limit));
  const double timeout = device.read_number("link.timeout");
  if (timeout <= 0.0 || timeout > longest_timeout)
    assignments.push_back(fmt::format("link.timeout={}", longest_timeout));
  return assignments;
}

}  // namespace kmax::experiment
