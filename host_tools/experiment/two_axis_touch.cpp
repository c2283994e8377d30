#include "host_tools/experiment/two_axis_touch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "host_tools/device/drive.hpp"
#include "host_tools/experiment/watched_touch.hpp"

namespace kmax::experiment {
namespace {
using std::chrono::milliseconds;

/// Records per s: what a serial line carries besides the readings of the wall's axis. At 500 per s a round
/// takes a quarter of a second, in which a wall is unstable unseen.
constexpr double two_axis_trace_rate = 100.0;

/// Removes the force of both axes whatever happens.
class BothArmed {
 public:
  /// The wall's axis last: it is what begins to push.
  BothArmed(device::Device& device, std::size_t wall_axis)
      : drives_{device::Drive(device, along(wall_axis)), device::Drive(device, wall_axis)} {
    try {
      for (device::Drive& drive : drives_) drive.arm();
    } catch (...) {
      disarm_quietly();
      throw;
    }
  }
  ~BothArmed() {
    if (armed_) disarm_quietly();
  }
  BothArmed(const BothArmed&) = delete;
  BothArmed& operator=(const BothArmed&) = delete;

  void require_armed() {
    for (device::Drive& drive : drives_) {
      const device::DriveStatus status = drive.status();
      if (!status.armed()) fail_without_force(drive.axis(), status);
    }
  }
  /// After disarming: what the touch was aborted for at `time` of the trace happened under force.
  void require_force_until(double time, const LateAbort& late) {
    for (device::Drive& drive : drives_) {
      const device::DriveStatus status = drive.status();
      if (late.is_late(time, status)) fail_without_force(drive.axis(), status);
    }
  }
  /// An axis that stays armed is an error to be told.
  void disarm() {
    for (device::Drive& drive : drives_) drive.disarm();
    armed_ = false;
  }

 private:
  [[noreturn]] static void fail_without_force(std::size_t axis, const device::DriveStatus& status) {
    throw device::DeviceError(
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
  std::array<device::Drive, 2> drives_;
  bool armed_ = true;
};

class TwoAxisWatch {
 public:
  TwoAxisWatch(device::Device& device, const TouchWatch& watch, const std::vector<TimedChange>& changes,
               const ReportText& report, double wall_abort_amplitude)
      : device_(device),
        watch_(watch),
        changes_(changes),
        report_(report),
        wall_abort_amplitude_(wall_abort_amplitude) {}

  TwoAxisTouch run() {
    wait_until_outside();
    const double rate = axis_number(device_, along(watch_.axis), "haptic.rate");
    device::TraceReader trace(
        device_, along(watch_.axis),
        static_cast<std::uint16_t>(std::max(1.0, std::round(rate / two_axis_trace_rate))));
    {
      BothArmed armed(device_, watch_.axis);
      record(trace, armed);
      if (!touch_.aborted_at) armed.require_armed();
      armed.disarm();
      if (touch_.aborted_at) armed.require_force_until(touched_ + *touch_.aborted_at, late_);
    }
    trace.stop();
    for (const std::size_t axis : {std::size_t{0}, std::size_t{1}}) {
      const double all = axis_number(device_, axis, "measured.armed_samples");
      if (all > 0)
        touch_.limited_share =
            std::max(touch_.limited_share, axis_number(device_, axis, "measured.limited_samples") / all);
    }
    touch_.lost_records = trace.lost();
    if (looks_ > 0) touch_.contact_share = static_cast<double>(touching_) / static_cast<double>(looks_);
    for (device::TraceSample& sample : touch_.samples) sample.time -= touched_;
    return std::move(touch_);
  }

 private:
  static constexpr auto longest_silence = std::chrono::seconds(2);

  /// Of the wall's axis from the surface, m: its position but for origin and direction.
  double distance() { return axis_number(device_, watch_.axis, "measured.distance"); }
  bool inside() { return distance() <= 0.0; }

  void wait_until_outside() {
    const auto begin = device_.link().now();
    while (inside() &&
           device_.link().now() - begin < std::chrono::duration<double>(watch_.contact_patience)) {
      report_(fmt::format("{}: take the handle out of the wall", watch_.name));
      device_.link().wait(milliseconds(200));
    }
  }

  void change(double now) {
    while (touch_.change_times.size() < changes_.size()) {
      const TimedChange& next = changes_[touch_.change_times.size()];
      if (now < touched_ + next.time) return;
      device_.apply(device::parse_assignments(next.assignments, watch_.axis));
      touch_.change_times.push_back(now - touched_);
      if (next.moves_wall_axis) disturbed_ = now;
    }
  }

  bool oscillates(double now) {
    if (watch_.abort_amplitude <= 0.0) return false;
    const auto first =
        std::find_if(touch_.samples.begin(), touch_.samples.end(),
                     [&](const device::TraceSample& sample) { return sample.time >= touched_; });
    if (oscillation({first, touch_.samples.end()}, watch_.abort_window) <= watch_.abort_amplitude)
      return false;
    touch_.aborted_at = now - touched_;
    return true;
  }

  /// The trace is of the other axis; of this one there is a reading a round.
  bool wall_oscillates(double now) {
    ++looks_;
    wall_.push_back({now, distance(), 0.0, 0.0});
    touching_ += wall_.back().position <= 0.0 ? 1 : 0;
    const auto settled = std::find_if(wall_.begin(), wall_.end(), [&](const device::TraceSample& look) {
      return look.time >= disturbed_ + wall_settling;
    });
    const double limit = wall_abort_amplitude_;
    if (limit <= 0.0 || (oscillation({settled, wall_.end()}, watch_.abort_window) <= limit &&
                         oscillation(wall_, watch_.abort_window) <= 5.0 * limit))
      return false;
    touch_.aborted_at = now - touched_;
    touch_.wall_oscillated = true;
    return true;
  }

  void record(device::TraceReader& trace, BothArmed& armed) {
    auto last_news = device_.link().now();
    for (int round = 0;; ++round) {
      device_.link().wait(milliseconds(20));
      const std::size_t before = touch_.samples.size();
      trace.read(touch_.samples);
      if (touch_.samples.size() > before) last_news = device_.link().now();
      // Without this the axes would stay armed for ever.
      if (device_.link().now() - last_news > longest_silence)
        throw device::DeviceError("the trace has stopped during the touch; does another program use it?");
      const double now = touch_.samples.empty() ? 0.0 : touch_.samples.back().time;
      late_.looked(now);
      if (touched_ < 0.0 && inside()) touched_ = disturbed_ = now;
      if (touched_ < 0.0 && now > watch_.contact_patience)
        throw NobodyTouched(
            fmt::format("nobody touched the wall within {} s of arming; press the handle against it",
                        watch_.contact_patience));
      if (touched_ >= 0.0) {
        if (oscillates(now) || wall_oscillates(now) || now >= touched_ + watch_.hold_time) return;
        change(now);
      }
      if (round % 10 == 0) report(now, armed);
    }
  }

  void report(double now, BothArmed& armed) {
    armed.require_armed();
    if (touched_ < 0.0) return report_(fmt::format("{}: waiting for the touch", watch_.name));
    report_(fmt::format("{}: {:.1f} of {:.1f} s", watch_.name, std::min(now - touched_, watch_.hold_time),
                        watch_.hold_time));
  }

  device::Device& device_;
  const TouchWatch& watch_;
  const std::vector<TimedChange>& changes_;
  const ReportText& report_;
  TwoAxisTouch touch_;
  LateAbort late_;
  std::size_t looks_ = 0, touching_ = 0;
  double touched_ = -1.0;
  double disturbed_ = -1.0;  ///< the touch or the last change that moved the wall's axis
  double wall_abort_amplitude_;
  std::vector<device::TraceSample> wall_;  ///< of the wall's axis, since the touch
};
}  // namespace

TwoAxisTouch watch_two_axes(device::Device& device, const TouchWatch& watch,
                            const std::vector<TimedChange>& changes, const ReportText& report,
                            double wall_abort_amplitude) {
  require_sound(watch);
  if (!(wall_abort_amplitude >= 0.0)) throw std::invalid_argument("wall_abort_amplitude must be 0 or above");
  return TwoAxisWatch(device, watch, changes, report, wall_abort_amplitude).run();
}

}  // namespace kmax::experiment
