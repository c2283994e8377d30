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
      : law_(law), capture_(capture_memory), settings_(initial) {}
  AxesTick(const AxesTick&) = delete;
  AxesTick& operator=(const AxesTick&) = delete;

  // Main loop.

  /// For all axes at once, from axis 0's next tick on.
  void offer(const Settings& settings) { settings_.offer(settings); }
  bool settings_taken() const { return settings_.taken(); }
  void enable(std::size_t axis, bool enabled) { command(commands_[axis].enable, enabled); }
  bool enabled(std::size_t axis) const { return commands_[axis].enable; }
  /// N at the handle, along +x, finite: what mode torque makes.
  void command_force(std::size_t axis, float force) { command(commands_[axis].from_host, force); }
  /// What is left of an enabled axis' force, see Axis::Command::share.
  void leave_share(std::size_t axis, float share) { command(commands_[axis].share, share); }
  /// The main loop runs.
  void keep_alive() { ticks_alive_.store(most_ticks_without_round, std::memory_order_relaxed); }
  AxisReport report(std::size_t axis) const { return reports_[axis].read(); }
  void report(std::size_t axis, AxisReport& report) const { reports_[axis].read(report); }
  /// A record of `axis` at every `interval`-th haptic sample; 0: none.
  void trace_axis(std::size_t axis, std::uint32_t interval) {
    const std::uint8_t traced = interval == 0 ? no_axis : static_cast<std::uint8_t>(axis);
    if (traced == trace_axis_.load(std::memory_order_relaxed) &&
        interval == trace_interval_.load(std::memory_order_relaxed))
      return;
    // The axis last: no record of the new one by the old interval.
    trace_axis_.store(no_axis, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    trace_interval_.store(interval, std::memory_order_relaxed);
    trace_starts_.store(trace_starts_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    trace_axis_.store(traced, std::memory_order_relaxed);
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
  void ISR_tick(std::size_t axis) {
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
  [[gnu::always_inline]] inline const Axis::Output& ISR_tick_at(std::size_t axis, const Axis::Input& input,
                                                                const AxesPositions<axes>& at);
  AxesPositions<axes> ISR_positions(const Inputs& inputs) const;
  [[gnu::always_inline]] inline const Settings& ISR_begin(std::size_t axis) {
    if (axis != 0) return settings_.ISR_current();
    const Settings& settings = settings_.ISR_take();
    ++ticks_;
    ISR_supervise_main_loop();
    return settings;
  }
  /// One tick less until the main loop counts as standing. It cannot come in between.
  void ISR_supervise_main_loop() {
    if (const std::uint32_t left = ticks_alive_.load(std::memory_order_relaxed); left != 0) [[likely]]
      ticks_alive_.store(left - 1, std::memory_order_relaxed);
  }
  bool ISR_main_loop_stands() const { return ticks_alive_.load(std::memory_order_relaxed) == 0; }
  /// A part of a command, written by the main loop. The tick, which it cannot interrupt, reads it plainly.
  template <typename Part>
  static void command(Part& part, Part value) {
    std::atomic_ref<Part>(part).store(value, std::memory_order_relaxed);
  }
  // Rare, and kept out of the tick's one function, whose registers it would take.
  [[gnu::noinline]] void ISR_trace(const control::HapticLoop<float>::Output& traced);
  [[gnu::noinline]] void ISR_capture(std::size_t axis, const Axis::Input& input, const Axis::Output& output);

  // What each tick needs comes first: the core's loads reach 4 KiB from the object's address.

  // Interrupt context only.
  std::array<Axis, axes> axes_;
  Law law_;
  std::uint32_t ticks_ = 0;
  std::uint32_t trace_countdown_ = 0, trace_start_ = 0;

  std::array<Axis::Command, axes> commands_{};  ///< `from_axes` is the interrupt's, the rest the main loop's
  static constexpr std::uint32_t most_ticks_without_round = tick_rate_hz / 10 + 2;
  std::atomic<std::uint32_t> ticks_alive_{most_ticks_without_round};
  static constexpr std::uint8_t no_axis = 0xFF;
  std::atomic<std::uint8_t> trace_axis_{no_axis};
  std::atomic<std::uint32_t> trace_interval_{0}, trace_starts_{0};
  Capture capture_;
  DoubleBuffer<Settings> settings_;
  std::array<Seqlock<AxisReport>, axes> reports_;
  Trace trace_;
};

template <std::size_t axes, typename Law>
requires AxesLaw<Law, axes>
inline const Axis::Output& AxesTick<axes, Law>::ISR_tick_at(std::size_t axis, const Axis::Input& input,
                                                            const AxesPositions<axes>& at) {
  const Settings& settings = ISR_begin(axis);
  Axis& ticked = axes_[axis];
  Axis::Command& command = commands_[axis];
  if (ISR_main_loop_stands() && command.enable) [[unlikely]]
    ticked.ISR_trip(Fault::main_loop, input);
  command.from_axes = law_.ISR_force(settings.law, axis, at);
  const Axis::Output& output = ticked.ISR_tick(settings.axis[axis], input, command, ticks_);
  law_.ISR_rendered(settings.law, axis, ticked.ISR_haptic(), output.enabled);
  if (ticked.ISR_changed() || ISR_round_begins())
    reports_[axis].ISR_publish([&ticked](AxisReport& report) { ticked.ISR_fill(report); });
  if (axis == trace_axis_.load(std::memory_order_relaxed)) [[unlikely]]
    ISR_trace(ticked.ISR_haptic());
  if (capture_.ISR_wants(axis)) [[unlikely]]
    ISR_capture(axis, input, output);
  return output;
}

template <std::size_t axes, typename Law>
requires AxesLaw<Law, axes> std::uint32_t AxesTick<axes, Law>::ISR_held_ticks(std::size_t present)
const {
  if (!settings_.taken() || ISR_main_loop_stands()) return 0;
  std::uint32_t least = UINT32_MAX;
  for (std::size_t axis = 0; axis < axes; ++axis) {
    if (capture_.ISR_wants(axis)) return 0;
    if (axis >= present) continue;
    const Axis::Command& command = commands_[axis];
    if (command.share != 1.0f) return 0;
    const std::uint32_t held = axes_[axis].ISR_held_ticks(settings_.ISR_current().axis[axis], command.enable);
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
void AxesTick<axes, Law>::ISR_trace(const control::HapticLoop<float>::Output& traced) {
  const std::uint32_t interval = trace_interval_.load(std::memory_order_relaxed);
  if (const std::uint32_t start = trace_starts_.load(std::memory_order_relaxed); start != trace_start_) {
    trace_start_ = start;
    trace_countdown_ = 0;
  }
  if (!traced.new_sample || interval == 0) return;
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
