#include "host_tools/libkmax/force_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/libkmax/force_channel.hpp"

namespace kmax::library {

using base::DeviceError;
using device::Drive;
using device::Parameter;
using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {
/// Until a time of the link's clock.
void sleep_until(SharedLink& link, microseconds time) {
  // A serial line's idle time is what other programs have of it.
  const microseconds left = time - link.now();
  if (link.virtual_time() || left > milliseconds(3)) {
    link.wait(left);
    return;
  }
  if (left > microseconds(0)) std::this_thread::sleep_for(left);
}

/// drive.mode torque, from construction to destruction.
class TorqueMode {
 public:
  TorqueMode(Session& session, std::size_t axis)
      : session_(session), mode_(Parameter::of<"drive.mode">(axis)), before_(session.device.read(mode_)) {
    set(device::parse_value(mode_, "torque"));
  }
  ~TorqueMode() {
    const Uninterrupted uninterrupted;
    try {
      set(before_);
    } catch (const std::exception&) {
      // The link is gone; the mode is not saved, and an axis in torque mode makes no force by itself.
    }
  }
  TorqueMode(const TorqueMode&) = delete;
  TorqueMode& operator=(const TorqueMode&) = delete;

 private:
  void set(std::uint32_t mode) {
    const device::Assignment one{mode_, mode};
    const Sequence::Hold hold(session_.settings, session_.link());
    if (session_.device.read(mode_) != mode) session_.device.apply({&one, 1});
  }

  Session& session_;
  Parameter mode_;
  std::uint32_t before_;
};

/// Disarms an axis whose loop's function does not come back, and keeps it alive while it does.
class Watchdog {
 public:
  Watchdog(Session& session, std::size_t axis, double timeout, double limit)
      : session_(session),
        axis_(axis),
        limit_(static_cast<std::int64_t>(limit * 1e9)),
        keeper_(
            session.device, axis, timeout, [this] { return loop_lives(); }, [this] { watch(); }) {}

  /// The function's time begins and ends.
  void begin() { busy_since_ = now(); }
  void end() {
    busy_since_ = 0;
    ++cycles_;
  }
  bool tripped() const { return tripped_; }
  std::string trouble() const { return keeper_.trouble(); }

 private:
  static std::int64_t now() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

  /// A loop that stands still must not be kept alive.
  bool loop_lives() { return cycles_.exchange(0) != 0; }

  void watch() {
    const std::int64_t since = busy_since_;
    if (!tripped_ && (since == 0 || now() - since < limit_)) return;
    tripped_ = true;
    if (disarmed_) return;
    Drive(session_.device, axis_).disarm();  // called again if the link fails it
    disarmed_ = true;
  }

  Session& session_;
  std::size_t axis_;
  std::int64_t limit_;
  std::atomic<std::int64_t> busy_since_ = 0;
  std::atomic<std::uint64_t> cycles_ = 1;
  std::atomic<bool> tripped_ = false;
  bool disarmed_ = false;  ///< since it tripped; of the keeper's thread
  Keeper keeper_;          // last: its thread uses the others
};

/// Made when the axis is armed, and disarms it.
class ArmedForLoop {
 public:
  ArmedForLoop(Session& session, std::size_t axis) : session_(session), axis_(axis) {
    session_.arm(axis_, false);
    session_.link().set_lending(false);  // the loop lends its own idle time
  }
  ~ArmedForLoop() {
    session_.link().set_lending(true);
    try {
      session_.disarm(axis_);
    } catch (const std::exception& error) {
      session_.options.notice(session_.disarm_failure(axis_, error.what()));
    }
  }
  ArmedForLoop(const ArmedForLoop&) = delete;
  ArmedForLoop& operator=(const ArmedForLoop&) = delete;

 private:
  Session& session_;
  std::size_t axis_;
};

class Loop {
 public:
  Loop(Session& session, const ForceLoopOptions& options, ForceChannel& channel, Watchdog* watchdog,
       double rate)
      : session_(session), link_(session.link()), options_(options), channel_(channel), watchdog_(watchdog) {
    record_.rate = rate;
    period_ = microseconds(std::llround(1e6 / rate));
  }

  ForceRecord run(const Device::ForceFunction& function) {
    const microseconds start = link_.now();
    microseconds polled = start;
    const std::int64_t cycles = cycles_of(options_.seconds);
    for (std::int64_t cycle = 0; cycle < cycles; ++cycle) {
      const microseconds due = start + cycle * period_;
      sleep_until(link_, due);
      const microseconds began = link_.now();
      if (began - polled > milliseconds(20)) {
        link_.poll();
        polled = began;
      }
      const microseconds patience = std::max<microseconds>(period_, milliseconds(5));
      const auto measured = channel_.sample(patience);
      if (measured) {
        unanswered_ = microseconds(0);
        if (!step(*measured, std::chrono::duration<double>(began - due).count(), function)) break;
      } else {
        ++record_.missed;
        unanswered_ += patience;
        stand_by();
      }
      // Those whose time is over.
      const std::int64_t behind = std::min((link_.now() - due) / period_ - 1, cycles - 1 - cycle);
      if (behind > 0) {
        record_.missed += static_cast<std::uint64_t>(behind);
        cycle += behind;
      }
    }
    std::ranges::rotate(record_.steps, record_.steps.begin() + static_cast<std::ptrdiff_t>(oldest_));
    return std::move(record_);
  }

 private:
  std::int64_t cycles_of(const std::optional<double>& seconds) const {
    if (!seconds) return std::numeric_limits<std::int64_t>::max();
    return static_cast<std::int64_t>(
        std::ceil(std::min(*seconds, 1e9) * 1e6 / static_cast<double>(period_.count())));
  }

  bool step(const record::AxisSample& measured, double lateness, const Device::ForceFunction& function) {
    if (!first_tick_) first_tick_ = measured.tick;
    const Sample sample{.time = static_cast<double>(measured.tick - *first_tick_) / firmware::tick_rate_hz,
                        .position = measured.position,
                        .velocity = static_cast<double>(measured.velocity),
                        .force = static_cast<double>(measured.force),
                        .current = static_cast<double>(measured.current),
                        .flags = measured.flags};
    // Before anything else: a function must not answer to a handle that nothing acts on.
    if (!sample.armed()) fail_disarmed();
    if (watchdog_ != nullptr) watchdog_->begin();
    const std::optional<double> force = function(sample);
    if (watchdog_ != nullptr) watchdog_->end();
    if (watchdog_ != nullptr && watchdog_->tripped())
      throw WatchdogError(fmt::format(
          "the loop's function took longer than {} s, so that the axis was disarmed; make it faster, or "
          "allow it more time (watchdog)",
          options_.watchdog));
    if (!force) return false;
    if (!std::isfinite(*force))
      throw base::ValueError(
          fmt::format("the loop's function gave {}; a force is a finite number of N", *force));
    const Parameter target = Parameter::of<"profile.target_force">(options_.axis);
    const double most = target.definition().maximum;
    if (std::abs(*force) > most)
      throw base::ValueError(
          fmt::format("the loop's function gave {} N; a force is from {} to {} N", *force, -most, most));
    channel_.send(static_cast<float>(*force));
    keep({.time = sample.time,
          .position = sample.position,
          .velocity = sample.velocity,
          .measured_force = sample.force,
          .force = *force,
          .lateness = std::max(lateness, 0.0),
          .round_trip = channel_.round_trip(),
          .flags = sample.flags});
    return true;
  }

  /// A loop without an end must not take all of the memory.
  void keep(const ForceStep& step) {
    if (record_.steps.size() < options_.keep) {
      record_.steps.push_back(step);
    } else if (options_.keep > 0) {
      record_.steps[oldest_] = step;
      oldest_ = (oldest_ + 1) % options_.keep;
    }
  }

  [[noreturn]] void fail_disarmed() {
    const device::DriveStatus status = Drive(session_.device, options_.axis).status();
    throw DeviceError(force_is_off(options_.axis, status));
  }

  /// The device does not answer. What was asked for last is not the answer to where the handle is now. Time
  /// in which this program stood still does not count.
  void stand_by() {
    if (unanswered_ > microseconds(static_cast<std::int64_t>(options_.watchdog * 1e6))) channel_.send(0.0F);
    if (unanswered_ < milliseconds(1000)) return;
    const device::DriveStatus status = Drive(session_.device, options_.axis).status();
    throw device::LinkError(
        fmt::format("{}: no complete answer to SYNC for 1 s while axis {} is in '{}': is the bus too busy, "
                    "or was the node taken out of the state operational?",
                    device::text_of(session_.address), options_.axis, device::to_string(status.state())));
  }

  Session& session_;
  SharedLink& link_;
  const ForceLoopOptions& options_;
  ForceChannel& channel_;
  Watchdog* watchdog_;
  microseconds period_{}, unanswered_{};
  std::optional<std::uint64_t> first_tick_;
  ForceRecord record_;
  std::size_t oldest_ = 0;  ///< of record_.steps
};

double checked_rate(const ForceLoopOptions& options, const ForceChannel& channel) {
  const double highest = channel.highest_rate();
  const double rate = options.rate.value_or(highest);
  if (!(rate >= 1 && rate <= highest))
    throw base::ValueError(fmt::format(
        "a force loop at {} Hz is not possible over this link; allowed are 1 to {:.0f} Hz", rate, highest));
  return rate;
}
}  // namespace

ForceRecord run_force_loop(Session& session, const ForceLoopOptions& options,
                           const Device::ForceFunction& function) {
  session.require_axis(options.axis);
  if (!(options.watchdog > 0) || !(options.watchdog <= 10))
    throw base::ValueError(fmt::format(
        "a watchdog of {} s is not possible; allowed is more than 0 and up to 10 s", options.watchdog));
  if (options.seconds && !(*options.seconds > 0))
    throw base::ValueError(fmt::format("{} is not a number of seconds above 0", *options.seconds));
  const Sequence::Hold hold(session.run, session.link());
  const double timeout = session.link_timeout();
  if (timeout == 0)
    throw DeviceError(
        "link.timeout is 0: the force of a loop whose program dies would stay on; set it, to 1 s for "
        "instance");
  if (Drive(session.device, options.axis).status().armed())
    throw DeviceError(fmt::format("axis {} is armed already; a force loop arms it itself", options.axis));
  const TorqueMode mode(session, options.axis);
  const auto channel = open_force_channel(session, options.axis);
  const double rate = checked_rate(options, *channel);
  const ArmedForLoop armed(session, options.axis);
  std::optional<Watchdog> watchdog;
  if (!session.link().virtual_time()) watchdog.emplace(session, options.axis, timeout, options.watchdog);
  return Loop(session, options, *channel, watchdog ? &*watchdog : nullptr, rate).run(function);
}

}  // namespace kmax::library
