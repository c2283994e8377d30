#include "host_tools/experiment/watched_touch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "host_tools/device/drive.hpp"

namespace kmax::experiment {

using device::TraceSample;
using std::chrono::milliseconds;

namespace {
constexpr auto longest_silence = std::chrono::seconds(2);  // of the trace; each request takes < 1 s
constexpr double shortest_round = 0.03;                    // s, from one look at the trace to the next
constexpr double longest_timeout = 1.0;                    // s an axis may push that nobody watches

/// Somebody came to the wall between the look and the arming, which was refused.
class CameTooSoon : public base::DeviceError {
 public:
  using base::DeviceError::DeviceError;
};

/// Removes the force of all axes whatever happens.
class ArmedAxes {
 public:
  ArmedAxes(device::Device& device, const std::vector<std::size_t>& axes) {
    for (const std::size_t axis : axes) drives_.emplace_back(device, axis);
    try {
      for (device::Drive& drive : drives_) arm(drive);
    } catch (...) {
      disarm_quietly();
      throw;
    }
  }
  ~ArmedAxes() {
    if (armed_) disarm_quietly();
  }
  ArmedAxes(const ArmedAxes&) = delete;
  ArmedAxes& operator=(const ArmedAxes&) = delete;

  void require_armed() {
    for (device::Drive& drive : drives_) {
      const device::DriveStatus status = drive.status();
      if (!status.armed()) fail_without_force(drive.axis(), status);
    }
  }
  /// An axis that stays armed is an error to report.
  void disarm() {
    for (device::Drive& drive : drives_) drive.disarm();
    armed_ = false;
  }
  /// After disarming: what the touch was aborted for at `time` of the trace happened under force.
  void require_force_until(double time, const LateAbort& late) {
    for (device::Drive& drive : drives_) {
      const device::DriveStatus status = drive.status();
      if (late.is_late(time, status)) fail_without_force(drive.axis(), status);
    }
  }

 private:
  static void arm(device::Drive& drive) {
    try {
      drive.arm();
    } catch (const base::DeviceError& error) {
      // What the device says: the handle may be out again by now.
      if (drive.status().refusal != firmware::Refusal::handle_inside_wall) throw;
      throw CameTooSoon(error.what());
    }
  }
  [[noreturn]] static void fail_without_force(std::size_t axis, const device::DriveStatus& status) {
    throw base::DeviceError(
        fmt::format("axis {} lost its force during the touch: {}", axis,
                    status.faulty() ? status.fault_words() : std::string(device::to_string(status.state()))));
  }
  void disarm_quietly() {
    for (device::Drive& drive : drives_) {
      try {
        drive.disarm();
      } catch (const std::exception&) {
        // The link is gone: link.timeout removes the force on the device.
      }
    }
  }

  std::vector<device::Drive> drives_;
  bool armed_ = true;
};

class Watch {
 public:
  Watch(device::Device& device, const TouchWatch& watch, const ReportText& report)
      : device_(device), watch_(watch), report_(report) {}

  WatchedTouch run() {
    if (wall_traced()) {
      touch_.surface = axis_number(device_, wall(), "wall.position");
      touch_.side = axis_number(device_, wall(), "wall.side");
    }
    wait_until_outside();
    const double thinning =
        std::max(1.0, std::round(axis_number(device_, traced(), "haptic.rate") / watch_.trace_rate));
    device::TraceReader trace(device_, traced(), static_cast<std::uint16_t>(thinning));
    {
      ArmedAxes armed(device_, watch_.axes);
      record(trace, armed);
      if (!touch_.aborted_at) armed.require_armed();
      armed.disarm();
      if (touch_.aborted_at) armed.require_force_until(touched_ + *touch_.aborted_at, late_);
    }
    trace.stop();
    for (const std::size_t axis : watch_.axes) {
      const double all = axis_number(device_, axis, "measured.armed_samples");
      if (all > 0)
        touch_.limited_share =
            std::max(touch_.limited_share, axis_number(device_, axis, "measured.limited_samples") / all);
    }
    touch_.lost_records = trace.lost();
    if (!looks_.empty())
      touch_.contact_share = static_cast<double>(touching_) / static_cast<double>(looks_.size());
    for (TraceSample& sample : touch_.samples) sample.time -= touched_;
    return std::move(touch_);
  }

 private:
  std::size_t traced() const { return watch_.axes.front(); }
  std::size_t wall() const { return watch_.axes.back(); }
  bool wall_traced() const { return traced() == wall(); }
  bool touched() const { return touched_ >= 0.0; }
  double now() const { return touch_.samples.empty() ? 0.0 : touch_.samples.back().time; }
  /// s
  double link_time() const { return std::chrono::duration<double>(device_.link().now()).count(); }
  /// Of the trace, as it is on the device: a slow link hands the records over late, but the least lag so far.
  double device_time() const { return link_time() + ahead_; }
  bool over() const { return touched() && now() >= touched_ + watch_.hold_time + watch_.release; }

  /// Of the wall's axis from the surface, m, as the device has it when it refuses to be armed inside.
  double distance() { return axis_number(device_, wall(), "measured.distance"); }

  /// Whoever pressed in the touch before may still be inside the wall, where arming is refused: waits until
  /// the handle is out, as long as the patience lasts.
  void wait_until_outside() {
    const auto begin = device_.link().now();
    while (distance() <= 0.0 &&
           device_.link().now() - begin < std::chrono::duration<double>(watch_.contact_patience)) {
      report_(fmt::format("{}: take the handle out of the wall", watch_.name));
      device_.link().wait(milliseconds(200));
    }
  }

  void record(device::TraceReader& trace, ArmedAxes& armed) {
    auto last_record = device_.link().now();
    for (int round = 0;; ++round) {
      device_.link().wait(milliseconds(20));
      trace.read(touch_.samples);
      if (!touch_.samples.empty()) ahead_ = std::max(ahead_, now() - link_time());
      if (looked_at_ < touch_.samples.size()) last_record = device_.link().now();
      late_.looked(now());
      if (!wall_traced()) look_at_wall();
      look_at_trace();
      if (touch_.aborted_at || over()) return;
      // Without this the axes would stay armed for ever.
      if (device_.link().now() - last_record > longest_silence)
        throw base::DeviceError("the trace has stopped during the touch; does another program use it?");
      if (!touched() && now() > watch_.contact_patience)
        throw NobodyTouched(
            fmt::format("nobody touched the wall within {} s of arming; press the handle against it",
                        watch_.contact_patience));
      if (touched()) make_changes();
      if (round % 10 != 0) continue;
      armed.require_armed();
      report_(words());
    }
  }

  void begin_touch(double time) { touched_ = disturbed_ = time; }

  /// At the samples that have come since the last time.
  void look_at_trace() {
    for (; looked_at_ < touch_.samples.size() && !touch_.aborted_at; ++looked_at_) {
      const TraceSample& sample = touch_.samples[looked_at_];
      if (!touched() && wall_traced() && touch_.side * (sample.position - touch_.surface) <= 0.0)
        begin_touch(sample.time);
      if (!touched() || sample.time < touched_) {
        first_ = looked_at_ + 1;
        continue;
      }
      if (watch_.abort_amplitude <= 0.0 || sample.time > touched_ + watch_.hold_time) continue;
      const std::span<const TraceSample> since(&touch_.samples[first_], looked_at_ - first_ + 1);
      const double amplitude = oscillation(since, watch_.abort_window);
      if (amplitude > watch_.abort_amplitude) abort(sample.time, amplitude);
    }
  }

  /// By one reading.
  void look_at_wall() {
    const double here = distance();
    if (!touched() && here <= 0.0) begin_touch(now());
    if (!touched()) return;
    looks_.push_back({now(), here, 0.0, 0.0});
    touching_ += here <= 0.0 ? 1 : 0;
    const auto settled = std::ranges::find_if(
        looks_, [&](const TraceSample& look) { return look.time >= disturbed_ + wall_settling; });
    const double limit = watch_.wall_abort_amplitude, amplitude = oscillation(looks_, watch_.abort_window);
    if (limit <= 0.0 ||
        (oscillation({settled, looks_.end()}, watch_.abort_window) <= limit && amplitude <= 5.0 * limit))
      return;
    abort(now(), amplitude);
  }

  void abort(double time, double amplitude) {
    touch_.aborted_at = time - touched_;
    touch_.aborted_amplitude = amplitude;
  }

  void make_changes() {
    double earlier = 0.0;  // s, when the change before was due
    for (std::size_t first = touch_.change_times.size(), made = first; made < watch_.changes.size(); ++made) {
      const TimedChange& next = watch_.changes[made];
      if (made > first && next.time - earlier < shortest_round) {
        const double left = touched_ + touch_.change_times.back() + next.time - earlier - device_time();
        if (left > 0.0) device_.link().wait(std::chrono::microseconds(std::llround(left * 1e6)));
      } else if (device_time() < touched_ + next.time) {
        return;
      }
      earlier = next.time;
      const double at = device_time();
      device_.apply(device::parse_assignments(next.assignments, wall()));
      touch_.change_times.push_back(at - touched_);
      if (next.moves_wall_axis) disturbed_ = at;
    }
  }

  std::string words() const {
    if (!touched()) return fmt::format("{}: waiting for the touch", watch_.name);
    return fmt::format("{}: holding, {:.1f} of {:.1f} s", watch_.name,
                       std::min(now() - touched_, watch_.hold_time), watch_.hold_time);
  }

  device::Device& device_;
  const TouchWatch& watch_;
  const ReportText& report_;
  WatchedTouch touch_;
  LateAbort late_;
  std::size_t looked_at_ = 0,
              first_ = 0;  ///< of the samples: the next to be looked at, the first of the touch
  double touched_ = -1.0;
  double ahead_ = -std::numeric_limits<double>::infinity();  ///< s, of the trace's time against the link's
  double disturbed_ = -1.0;         ///< the touch or the last change that moved the wall's axis
  std::vector<TraceSample> looks_;  ///< at the wall's axis, since the touch
  std::size_t touching_ = 0;        ///< of the looks
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
  const auto sound = [](double value, bool may_be_0) {
    return std::isfinite(value) && (value > 0.0 || (may_be_0 && value == 0.0));
  };
  if (watch.axes.empty()) throw std::invalid_argument("a touch on no axis: name the wall's");
  if (sound(watch.hold_time, false) && sound(watch.contact_patience, false) &&
      sound(watch.abort_window, false) && sound(watch.trace_rate, false) && sound(watch.release, true) &&
      sound(watch.abort_amplitude, true) && sound(watch.wall_abort_amplitude, true))
    return;
  throw std::invalid_argument(
      fmt::format("a touch held for {} s, waited for {} s, traced {} times a second and for {} s after the "
                  "hold, ended by {} m, or {} m of the wall, within {} s: all must be finite, the amplitudes "
                  "and the time after the hold 0 or above, the others above 0",
                  watch.hold_time, watch.contact_patience, watch.trace_rate, watch.release,
                  watch.abort_amplitude, watch.wall_abort_amplitude, watch.abort_window));
}

WatchedTouch watch_touch(device::Device& device, const TouchWatch& watch, const ReportText& report) {
  require_sound(watch);
  const auto begin = device.link().now();
  for (;;) {
    try {
      return Watch(device, watch, report).run();
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
  if (!simulation::can_be_judged(positions, criterion)) return {};
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
