#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "firmware/exchange/double_buffer.hpp"
#include "firmware/object_dictionary/capture_channel.hpp"
#include "firmware/object_dictionary/register_windows.hpp"

namespace kmax::firmware {

struct CaptureConfig {
  std::size_t axis = 0;
  std::array<CaptureChannel, capture_channels_max> channels{};  ///< `none` is left out
  std::uint32_t interval = 1;                                   ///< ticks per sample; 0 is 1
  std::uint32_t samples = 0;                                    ///< 0, or more than fit: as many as fit
  std::uint32_t pre_trigger = 0;  ///< samples before the trigger; at most samples - 1
  CaptureTrigger trigger = CaptureTrigger::now;
  float level = 0.0f;  ///< N or m/s, for triggers `force` and `velocity`
};

/// What the triggers look at, in every tick.
struct CaptureEvent {
  std::uint32_t flags = 0;  ///< capture_flag
  float force = 0.0f;       ///< N
  float velocity = 0.0f;    ///< m/s
};

/// All channels of one tick. Filled only in ticks that are recorded.
class CaptureSource {
 public:
  /// float for a real channel, std::int32_t for whole and counts, std::uint32_t for turns and flags: as the
  /// tick has it, nothing is converted.
  template <CaptureChannel channel, typename Value>
  constexpr void set(Value value) {
    constexpr CaptureEncoding encoding = text_of(channel).encoding;
    if constexpr (encoding == CaptureEncoding::real) {
      static_assert(std::is_same_v<Value, float>);
    } else if constexpr (encoding == CaptureEncoding::whole || encoding == CaptureEncoding::counts) {
      static_assert(std::is_same_v<Value, std::int32_t>);
    } else {
      static_assert(std::is_same_v<Value, std::uint32_t>);
    }
    words_[static_cast<std::size_t>(channel)] = std::bit_cast<std::uint32_t>(value);
  }
  constexpr std::uint32_t word(std::size_t channel) const { return words_[channel]; }

 private:
  std::array<std::uint32_t, capture_channel_count> words_;
};

struct CaptureReadings {
  CaptureState state = CaptureState::idle;
  std::uint32_t taken = 0;           ///< samples; while waiting those kept for before the trigger
  std::uint32_t trigger_sample = 0;  ///< which sample is the trigger's; once triggered
  std::uint32_t first_tick = 0;      ///< tick of the oldest sample; once triggered
  std::uint32_t channels = 0;        ///< words per sample; once triggered
};

/// The triggered capture: up to four channels of one axis in every tick, or every interval-th, from some time
/// before an event until the memory is full.
///
/// The samples stand on a grid of `interval` ticks that begins with the first tick after arm(); without
/// samples before the trigger it begins with the trigger. Triggers are looked for in every tick; the
/// trigger's sample is the first one at or after it. `contact` and `fault` are changes: a handle that is
/// inside already, or a fault that is there already, does not trigger. `force` and `velocity` are levels. A
/// trigger that comes before `pre_trigger` samples have been taken is not missed: fewer stand before it
/// (trigger_sample), more after; the capture always ends with all `samples`, unless it is stopped.
///
/// Contexts: arm(), stop() and reading in the main loop, ISR_... in the tick that may preempt it. The plan
/// crosses through a DoubleBuffer, and takes effect in the axis' next tick: arming again is safe at any time.
/// Of what the tick writes, each value has this one writer, and the words are read only while the state is
/// complete and no plan is on its way: the tick then writes none. Until then every word reads as 0 and
/// readable() is false.
///
/// Cost in executed Cortex-M4F instructions, counted on an emulated core: 4 for an axis that is not captured,
/// 11 when nothing is under way on the axis that was captured last; 21 between two samples, 106 for a sample
/// of four channels with all of `fill`'s values at hand, 126 while waiting with samples before the trigger,
/// 34 without; 167 in the tick that begins.
class Capture {
 public:
  /// `storage` must live as long as this object. Only capture_words of it can be read and are used.
  explicit Capture(std::span<std::uint32_t> storage)
      : storage_(storage.first(storage.size() < capture_words ? storage.size() : capture_words)),
        plan_(Plan{}) {}
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  /// Main loop: begins a capture, whatever was going on. False, and nothing changes: no channel is chosen, or
  /// the storage is too small for one sample.
  bool arm(const CaptureConfig& config);

  /// Main loop: ends the capture at the next tick. One that has triggered is complete with what it has; one
  /// that waits is dropped; one that is complete stays so.
  void stop();

  /// Main loop.
  CaptureReadings readings() const;
  bool readable() const {
    return plan_.taken() && state_.load(std::memory_order_acquire) == CaptureState::complete;
  }

  static constexpr bool contains(std::uint32_t address) {
    return address >= capture_window && address < capture_window + 2 * capture_words;
  }

  /// Main loop: one value; 0 where nothing has been captured, and while not readable().
  std::uint32_t value_at(std::uint32_t word) const;

  /// Main loop: one register of the window; 0 where nothing has been captured, and while not readable().
  std::uint16_t word_at(std::uint16_t address) const;

  /// Interrupt: this axis' tick must call ISR_record().
  bool ISR_wants(std::size_t axis) const {
    return axis == watched_axis_.load(std::memory_order_relaxed) && (ISR_active_ || !plan_.taken());
  }

  /// Interrupt: one tick of the axis. `fill(CaptureSource&)` sets all channels; called only in ticks that are
  /// recorded.
  template <typename Fill>
  requires std::invocable<Fill, CaptureSource&>
  void ISR_record(std::uint32_t tick, const CaptureEvent& event, Fill fill) {
    if (!plan_.taken()) ISR_begin(plan_.ISR_take());
    if (!ISR_active_) return;
    if (ISR_waiting_) {
      if (ISR_triggered(event)) {
        ISR_trigger(tick);
      } else if (ISR_plan_.pre_trigger == 0) {
        return;
      }
    }
    if (ISR_countdown_ != 0) {
      --ISR_countdown_;
      return;
    }
    ISR_countdown_ = ISR_plan_.interval - 1;
    CaptureSource source;
    fill(source);
    ISR_store(source);
  }

 private:
  static constexpr std::uint8_t no_axis = 0xFF;

  struct Plan {
    bool arm = false;  ///< false: stop the capture `number`
    std::uint32_t number{};
    std::array<std::uint8_t, capture_channels_max> channel{};
    std::uint32_t channels = 0;
    // Set in every plan that arms.
    std::uint32_t interval{}, samples{}, pre_trigger{};
    CaptureTrigger trigger = CaptureTrigger::now;
    float level{};
  };

  void ISR_begin(const Plan& plan);
  bool ISR_triggered(const CaptureEvent& event);
  void ISR_trigger(std::uint32_t tick);
  void ISR_store(const CaptureSource& source);
  void ISR_finish(CaptureState state) {
    ISR_active_ = false;
    state_.store(state, std::memory_order_release);
  }

  std::span<std::uint32_t> storage_;

  // Main loop only, or written by it.
  std::uint32_t number_{};
  bool arming_{};  ///< what the plan on its way asks for
  std::atomic<std::uint8_t> watched_axis_{no_axis};
  DoubleBuffer<Plan> plan_;

  // Written by the tick. Those without a lock of their own are read after state_, which is stored after them.
  std::atomic<CaptureState> state_{CaptureState::idle};
  // Nothing is in them before the first capture, and nobody asks.
  std::atomic<std::uint32_t> taken_, trigger_sample_, first_tick_, channels_;
  std::atomic<std::uint32_t> begin_, ring_words_;  ///< where the oldest word is, and where the ring ends

  // Interrupt context only.
  Plan ISR_plan_{};
  bool ISR_active_ = false;
  // Set where a capture begins.
  bool ISR_waiting_{}, ISR_before_{};
  std::uint32_t ISR_countdown_{};
  std::uint32_t ISR_at_{};         ///< word to write next
  std::uint32_t ISR_remaining_{};  ///< samples until the end; once triggered
};

inline bool Capture::arm(const CaptureConfig& config) {
  Plan plan;
  for (const CaptureChannel channel : config.channels) {
    if (channel != CaptureChannel::none) plan.channel[plan.channels++] = static_cast<std::uint8_t>(channel);
  }
  if (plan.channels == 0) return false;
  const auto fit = static_cast<std::uint32_t>(storage_.size()) / plan.channels;
  if (fit == 0) return false;
  plan.arm = true;
  plan.number = ++number_;
  plan.interval = config.interval == 0 ? 1 : config.interval;
  plan.samples = config.samples == 0 || config.samples > fit ? fit : config.samples;
  plan.pre_trigger = config.pre_trigger < plan.samples ? config.pre_trigger : plan.samples - 1;
  plan.trigger = config.trigger;
  plan.level = config.level;
  // No tick of the other axis may take this plan, and none of this one the old.
  watched_axis_.store(no_axis, std::memory_order_relaxed);
  std::atomic_signal_fence(std::memory_order_seq_cst);
  plan_.offer(plan);
  arming_ = true;
  std::atomic_signal_fence(std::memory_order_seq_cst);
  watched_axis_.store(static_cast<std::uint8_t>(config.axis), std::memory_order_relaxed);
  return true;
}

inline void Capture::stop() {
  if (readable()) return;
  Plan plan;
  plan.number = number_;
  plan_.offer(plan);
  arming_ = false;
}

inline CaptureReadings Capture::readings() const {
  CaptureReadings now;
  // A plan on its way: what the host has just asked for, not what was before.
  if (!plan_.taken() && arming_) {
    now.state = CaptureState::waiting;
    return now;
  }
  now.state = state_.load(std::memory_order_acquire);
  if (now.state == CaptureState::idle) return now;
  // A stop on its way: not to be read yet.
  if (!plan_.taken() && now.state == CaptureState::complete) now.state = CaptureState::running;
  now.taken = taken_.load(std::memory_order_relaxed);
  if (now.state == CaptureState::waiting) return now;
  now.trigger_sample = trigger_sample_.load(std::memory_order_relaxed);
  now.first_tick = first_tick_.load(std::memory_order_relaxed);
  now.channels = channels_.load(std::memory_order_relaxed);
  return now;
}

inline std::uint32_t Capture::value_at(std::uint32_t word) const {
  if (!readable()) return 0;
  if (word >= taken_.load(std::memory_order_relaxed) * channels_.load(std::memory_order_relaxed)) return 0;
  const std::uint32_t end = ring_words_.load(std::memory_order_relaxed);
  std::uint32_t at = begin_.load(std::memory_order_relaxed) + word;
  if (at >= end) at -= end;
  return storage_[at];
}

inline std::uint16_t Capture::word_at(std::uint16_t address) const {
  if (!contains(address)) return 0;
  const std::uint32_t value = value_at(static_cast<std::uint32_t>(address - capture_window) / 2);
  return static_cast<std::uint16_t>(address % 2 == capture_window % 2 ? value >> 16 : value);
}

inline void Capture::ISR_begin(const Plan& plan) {
  if (!plan.arm) {
    // Stopped before it began: the words are still those of the capture before, which nobody asks for.
    if (plan.number != ISR_plan_.number) {
      ISR_plan_.number = plan.number;
      ISR_finish(CaptureState::idle);
    } else if (ISR_active_) {
      ISR_finish(ISR_waiting_ ? CaptureState::idle : CaptureState::complete);
    }
    return;
  }
  ISR_plan_ = plan;
  ISR_active_ = ISR_waiting_ = true;
  // What is there already is no change.
  ISR_before_ = true;
  ISR_countdown_ = 0;
  ISR_at_ = 0;
  channels_.store(plan.channels, std::memory_order_relaxed);
  ring_words_.store(plan.samples * plan.channels, std::memory_order_relaxed);
  taken_.store(0, std::memory_order_relaxed);
  state_.store(CaptureState::waiting, std::memory_order_release);
}

inline bool Capture::ISR_triggered(const CaptureEvent& event) {
  const float level = ISR_plan_.level;
  switch (ISR_plan_.trigger) {
    case CaptureTrigger::now:
      return true;
    case CaptureTrigger::force:
      return event.force > level || -event.force > level;
    case CaptureTrigger::velocity:
      return event.velocity > level || -event.velocity > level;
    case CaptureTrigger::excitation:
      return (event.flags & capture_flag::excitation_started) != 0;
    case CaptureTrigger::contact:
    case CaptureTrigger::fault:
      break;
  }
  const std::uint32_t mask =
      ISR_plan_.trigger == CaptureTrigger::contact ? capture_flag::inside : capture_flag::fault;
  const bool before = ISR_before_;
  ISR_before_ = (event.flags & mask) != 0;
  return ISR_before_ && !before;
}

inline void Capture::ISR_trigger(std::uint32_t tick) {
  const std::uint32_t kept = taken_.load(std::memory_order_relaxed);
  const std::uint32_t channels = ISR_plan_.channels, end = ISR_plan_.samples * channels;
  const std::uint32_t back = kept * channels;
  begin_.store(ISR_at_ >= back ? ISR_at_ - back : ISR_at_ + end - back, std::memory_order_relaxed);
  trigger_sample_.store(kept, std::memory_order_relaxed);
  first_tick_.store(tick + ISR_countdown_ - kept * ISR_plan_.interval, std::memory_order_relaxed);
  ISR_remaining_ = ISR_plan_.samples - kept;
  ISR_waiting_ = false;
  state_.store(CaptureState::running, std::memory_order_release);
}

inline void Capture::ISR_store(const CaptureSource& source) {
  const std::uint32_t channels = ISR_plan_.channels;
  std::uint32_t* const place = &storage_[ISR_at_];
  for (std::uint32_t c = 0; c < channels; ++c) place[c] = source.word(ISR_plan_.channel[c]);
  ISR_at_ += channels;
  if (ISR_at_ == ring_words_.load(std::memory_order_relaxed)) ISR_at_ = 0;
  const std::uint32_t taken = taken_.load(std::memory_order_relaxed);
  if (ISR_waiting_) {
    if (taken < ISR_plan_.pre_trigger) taken_.store(taken + 1, std::memory_order_relaxed);
    return;
  }
  taken_.store(taken + 1, std::memory_order_relaxed);
  if (--ISR_remaining_ == 0) ISR_finish(CaptureState::complete);
}

}  // namespace kmax::firmware
