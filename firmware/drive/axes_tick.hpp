#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "firmware/capture/capture.hpp"
#include "firmware/capture/trace.hpp"
#include "firmware/drive/axes_law.hpp"
#include "firmware/drive/axis.hpp"
#include "firmware/drive/device_law.hpp"
#include "firmware/exchange/double_buffer.hpp"
#include "firmware/exchange/seqlock.hpp"
#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware {

/// The tick of all axes: what the sampling interrupt runs, and all that the main loop exchanges with it.
///
///   counts -> Law -> Axis: wall or commanded force, limits, trips, motor -> duty
///                    -> report, trace, capture
///
/// The axes' ticks never interrupt each other, and axis 0's comes first: it takes over new settings for all
/// and counts the ticks. Whether they come one right after the other or a part of a tick apart makes no
/// difference.
///
/// What crosses between the contexts: settings by a double buffer, enables and commanded forces by atomics,
/// main loop to tick; reports by a seqlock, the trace, a capture's samples, tick to main loop.
///
/// The main loop is what hears the host and the faults: when it has not said for 0.1 s that it runs, every
/// enabled axis trips.
template <std::size_t axes, typename Law = DeviceLaw<axes>>
requires AxesLaw<Law, axes>
class AxesTick {
 public:
  /// What the ticks work by; made in the main loop, handed over whole.
  struct Settings {
    std::array<AxisSetting, axes> axis{};
    [[no_unique_address]] typename Law::Settings law{};
  };
  using Inputs = std::array<Axis::Input, axes>;
  static constexpr bool needs_all_positions = Law::needs_all_positions;
  /// What one axis' tick needs: its own sample, or, for a law that needs all positions, all counters as they
  /// are in this slot. Of the others, only count, validity and reference are looked at.
  using SlotInput = std::conditional_t<needs_all_positions, Inputs, Axis::Input>;

  /// Every so many ticks each axis reports, besides at once when something has changed.
  static constexpr std::uint32_t round_ticks = 4;

  /// `capture_memory`: for captures, up to capture_words; it outlives this object.
  explicit AxesTick(const Settings& initial, std::span<std::uint32_t> capture_memory = {}, Law law = {})
      : settings_(initial), capture_(capture_memory), law_(law) {
    for (std::size_t axis = 0; axis < axes; ++axis) leave_share(axis, 1.0f);
  }
  AxesTick(const AxesTick&) = delete;
  AxesTick& operator=(const AxesTick&) = delete;

  // Main loop.

  /// For all axes at once, from axis 0's next tick on.
  void offer(const Settings& settings) { settings_.offer(settings); }
  bool settings_taken() const { return settings_.taken(); }
  void enable(std::size_t axis, bool enabled) { enabled_[axis].store(enabled, std::memory_order_relaxed); }
  bool enabled(std::size_t axis) const { return enabled_[axis].load(std::memory_order_relaxed); }
  /// N at the handle, along +x, finite: what mode torque makes.
  void command_force(std::size_t axis, float force) {
    commanded_force_[axis].store(force, std::memory_order_relaxed);
  }
  /// What is left of an enabled axis' force, see Axis::Demand::share.
  void leave_share(std::size_t axis, float share) {
    force_share_[axis].store(share, std::memory_order_relaxed);
  }
  /// The main loop runs.
  void keep_alive() {
    rounds_alive_.store(rounds_alive_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  AxisReport report(std::size_t axis) const { return reports_[axis].read(); }
  void report(std::size_t axis, AxisReport& report) const { reports_[axis].read(report); }
  /// A record of `axis` at every `interval`-th haptic sample; 0: none.
  void trace_axis(std::size_t axis, std::uint32_t interval) {
    trace_axis_.store(static_cast<std::uint8_t>(axis), std::memory_order_relaxed);
    trace_interval_.store(interval, std::memory_order_relaxed);
  }
  const Trace& trace() const { return trace_; }
  Capture& capture() { return capture_; }

  // Interrupt.

  /// One axis' tick. The result is valid until the axis' next one.
  const Axis::Output& ISR_tick(std::size_t axis, const SlotInput& input) {
    if constexpr (needs_all_positions) {
      return ISR_tick_at(axis, input[axis], ISR_positions(input));
    } else {
      return ISR_tick_at(axis, input, {});
    }
  }
  /// In place of ISR_tick(), for an axis that the board does not have: settings and rounds go on.
  void ISR_pass(std::size_t axis) {
    const Settings& settings = ISR_begin(axis);
    axes_[axis].ISR_pass(settings.axis[axis], ticks_);
    if (ISR_round_begins())
      reports_[axis].ISR_publish([this, axis](AxisReport& report) { axes_[axis].ISR_fill(report); });
  }
  /// Ticks from now that would change nothing but the time on the first `present` axes, whose counts are
  /// valid and which have no power stage; those beyond stand still. For a simulation that has nothing to gain
  /// from ticks between two haptic samples: no board calls it, and none pays for it.
  std::uint32_t ISR_held_ticks(std::size_t present) const;
  /// In place of so many ticks, at most ISR_held_ticks().
  void ISR_pass_held(std::uint32_t ticks) {
    ticks_ += ticks;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      axes_[axis].ISR_pass_held(ticks);
      reports_[axis].ISR_publish([this, axis](AxisReport& report) { axes_[axis].ISR_fill(report); });
    }
  }
  /// What the slot of `axis` needs of samples that were all taken at the same time.
  static const SlotInput& ISR_slot_input(const Inputs& inputs, std::size_t axis) {
    if constexpr (needs_all_positions) {
      return inputs;
    } else {
      return inputs[axis];
    }
  }
  /// Between two ticks: the last one began a round, in which all axes report. Behind the last axis' tick the
  /// main loop should be woken: what it reads then is of this tick.
  bool ISR_round_begins() const { return ticks_ % round_ticks == 1; }
  /// Of the last tick; also where nothing interrupts.
  AxisReport ISR_report(std::size_t axis) const { return axes_[axis].ISR_report(); }
  const control::HapticLoop<float>::Output& ISR_haptic(std::size_t axis) const {
    return axes_[axis].ISR_haptic();
  }
  float ISR_background_force(std::size_t axis) const {
    return axes_[axis].ISR_background_force(settings_.ISR_current().axis[axis]);
  }

 private:
  const Axis::Output& ISR_tick_at(std::size_t axis, const Axis::Input& input, const AxesPositions<axes>& at);
  AxesPositions<axes> ISR_positions(const Inputs& inputs) const;
  [[gnu::always_inline]] inline const Settings& ISR_begin(std::size_t axis) {
    if (axis != 0) return settings_.ISR_current();
    const Settings& settings = settings_.ISR_take();
    ++ticks_;
    ISR_supervise_main_loop();
    return settings;
  }
  void ISR_supervise_main_loop();
  void ISR_trace(const control::HapticLoop<float>::Output& traced);
  // Rare, and kept out of the tick's one function, whose registers it would take.
  [[gnu::noinline]] void ISR_capture(std::size_t axis, const Axis::Input& input, const Axis::Output& output);

  DoubleBuffer<Settings> settings_;
  std::array<Seqlock<AxisReport>, axes> reports_;
  Trace trace_;
  Capture capture_;
  std::array<std::atomic<bool>, axes> enabled_{};
  std::array<std::atomic<float>, axes> commanded_force_{};
  std::array<std::atomic<float>, axes> force_share_{};
  std::atomic<std::uint32_t> rounds_alive_{0};
  std::atomic<std::uint8_t> trace_axis_{0};
  std::atomic<std::uint32_t> trace_interval_{0};

  // Interrupt context only.
  std::array<Axis, axes> axes_;
  Law law_;
  std::uint32_t ticks_ = 0;
  bool main_loop_stands_ = false;
  std::uint32_t rounds_seen_ = 0, ticks_without_round_ = 0;
  std::uint32_t trace_countdown_ = 0;
};

template <std::size_t axes, typename Law>
requires AxesLaw<Law, axes>
const Axis::Output& AxesTick<axes, Law>::ISR_tick_at(std::size_t axis, const Axis::Input& input,
                                                     const AxesPositions<axes>& at) {
  const Settings& settings = ISR_begin(axis);
  Axis& ticked = axes_[axis];
  const bool enable = enabled_[axis].load(std::memory_order_relaxed);
  if (main_loop_stands_ && enable) ticked.ISR_trip(Fault::main_loop);
  const Axis::Demand demand{law_.ISR_force(settings.law, axis, at),
                            commanded_force_[axis].load(std::memory_order_relaxed),
                            force_share_[axis].load(std::memory_order_relaxed)};
  const Axis::Output& output = ticked.ISR_tick(settings.axis[axis], input, enable, demand, ticks_);
  law_.ISR_rendered(settings.law, axis, ticked.ISR_haptic(), output.enabled);
  if (ticked.ISR_changed() || ISR_round_begins())
    reports_[axis].ISR_publish([&ticked](AxisReport& report) { ticked.ISR_fill(report); });
  if (axis == trace_axis_.load(std::memory_order_relaxed)) ISR_trace(ticked.ISR_haptic());
  if (capture_.ISR_wants(axis)) [[unlikely]]
    ISR_capture(axis, input, output);
  return output;
}

template <std::size_t axes, typename Law>
requires AxesLaw<Law, axes> std::uint32_t AxesTick<axes, Law>::ISR_held_ticks(std::size_t present)
const {
  if (!settings_.taken() || main_loop_stands_) return 0;
  std::uint32_t least = UINT32_MAX;
  for (std::size_t axis = 0; axis < axes; ++axis) {
    if (capture_.ISR_wants(axis)) return 0;
    if (axis >= present) continue;
    if (force_share_[axis].load(std::memory_order_relaxed) != 1.0f) return 0;
    const bool enable = enabled_[axis].load(std::memory_order_relaxed);
    const std::uint32_t held = axes_[axis].ISR_held_ticks(settings_.ISR_current().axis[axis], enable);
    least = held < least ? held : least;
  }
  return present == 0 ? 0 : least;
}

template <std::size_t axes, typename Law>
requires AxesLaw<Law, axes> AxesPositions<axes> AxesTick<axes, Law>::ISR_positions(const Inputs& inputs)
const {
  AxesPositions<axes> at;
  if constexpr (needs_all_positions) {
    for (std::size_t axis = 0; axis < axes; ++axis) {
      at.valid[axis] = axes_[axis].ISR_follows(inputs[axis]);
      at.position[axis] = axes_[axis].ISR_position(inputs[axis].count, settings_.ISR_current().axis[axis]);
    }
  }
  return at;
}

template <std::size_t axes, typename Law>
requires AxesLaw<Law, axes>
void AxesTick<axes, Law>::ISR_supervise_main_loop() {
  constexpr std::uint32_t most_ticks_without_round = tick_rate_hz / 10;
  const std::uint32_t rounds = rounds_alive_.load(std::memory_order_relaxed);
  ticks_without_round_ = rounds == rounds_seen_ ? ticks_without_round_ + 1 : 0;
  rounds_seen_ = rounds;
  main_loop_stands_ = ticks_without_round_ > most_ticks_without_round;
}

template <std::size_t axes, typename Law>
requires AxesLaw<Law, axes>
void AxesTick<axes, Law>::ISR_trace(const control::HapticLoop<float>::Output& traced) {
  const std::uint32_t interval = trace_interval_.load(std::memory_order_relaxed);
  if (interval == 0) {
    trace_countdown_ = 0;
    return;
  }
  if (!traced.new_sample) return;
  // A countdown as long as the interval is left over from a longer one.
  if (trace_countdown_ == 0 || trace_countdown_ >= interval) {
    trace_countdown_ = interval;
    trace_.ISR_push(
        {ticks_, static_cast<std::int32_t>(traced.position), traced.force, traced.magnetic_coefficient});
  }
  --trace_countdown_;
}

template <std::size_t axes, typename Law>
requires AxesLaw<Law, axes>
void AxesTick<axes, Law>::ISR_capture(std::size_t axis, const Axis::Input& input,
                                      const Axis::Output& output) {
  const control::HapticLoop<float>::Output& haptic = axes_[axis].ISR_haptic();
  const MotorControl::Output& motor = output.motor;
  const Fault fault = axes_[axis].ISR_fault();
  CaptureEvent event;
  event.flags = (haptic.inside ? capture_flag::inside : 0U) |
                (haptic.limited ? capture_flag::force_limited : 0U) |
                (haptic.slew_limited ? capture_flag::slew_limited : 0U) |
                (haptic.ramping ? capture_flag::ramping : 0U) | (output.enabled ? capture_flag::armed : 0U) |
                (motor.saturated ? capture_flag::saturated : 0U) |
                (input.count_valid ? capture_flag::count_valid : 0U) |
                (motor.excitation_started ? capture_flag::excitation_started : 0U) |
                static_cast<std::uint32_t>(fault) << capture_flag::fault_shift;
  event.force = output.force;
  event.velocity = haptic.velocity;
  capture_.ISR_record(ticks_, event, [&](CaptureSource& source) {
    using enum CaptureChannel;
    const std::int64_t place =
        Axis::position_of(axes_[axis].ISR_counted(), settings_.ISR_current().axis[axis]);
    source.set<none>(std::int32_t{0});
    source.set<position>(static_cast<std::int32_t>(haptic.position));
    source.set<velocity>(haptic.velocity);
    source.set<force>(output.force);
    source.set<CaptureChannel::count>(static_cast<std::int32_t>(place));
    source.set<current>(motor.current);
    source.set<current_reference>(motor.current_reference);
    source.set<current_d>(motor.current_d);
    source.set<current_b>(input.motor.current_b);
    source.set<current_c>(input.motor.current_c);
    source.set<voltage>(motor.voltage);
    source.set<voltage_d>(motor.voltage_d);
    source.set<electrical_angle>(motor.electrical_angle);
    source.set<supply>(input.motor.supply_voltage);
    source.set<duty_a>(motor.duty_a);
    source.set<duty_b>(motor.duty_b);
    source.set<duty_c>(motor.duty_c);
    source.set<magnetic_coefficient>(haptic.magnetic_coefficient);
    source.set<distance>(haptic.outside_distance);
    source.set<flags>(event.flags);
  });
}

}  // namespace kmax::firmware
