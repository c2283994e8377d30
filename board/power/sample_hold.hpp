#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "firmware/object_dictionary/entry.hpp"

namespace kmax::board {

/// Which current samples a tick does not take as they are: it holds the sample before in place of an invalid
/// one, `longest` times in a row at most. The one beyond is taken whatever it is, so that an over-current
/// trips in spite of interference; then holding begins again.
///
/// All in one byte that a tick loads once; so it has the flag of the offset calibration, too.
///
/// Contexts: ISR_invalidate() interrupts above the tick, ISR_take() the tick, set_calibrating() main loop.
class SampleHold {
 public:
  static constexpr std::uint8_t longest = 3;

  struct Action {
    bool hold = false, calibrate = false;
  };

  /// The axis' next sample is invalid.
  void ISR_invalidate(std::size_t axis) {
    flags_.fetch_or(static_cast<std::uint8_t>(invalid << axis), std::memory_order_relaxed);
  }
  void set_calibrating(bool on) {
    if (on) {
      flags_.fetch_or(calibrating, std::memory_order_relaxed);
    } else {
      flags_.fetch_and(static_cast<std::uint8_t>(~calibrating), std::memory_order_relaxed);
    }
  }

  /// False: every axis' sample is taken as it is, and ISR_take() need not be called.
  bool ISR_has_action() const { return flags_.load(std::memory_order_relaxed) != 0; }
  Action ISR_take(std::size_t axis) {
    const auto own = static_cast<std::uint8_t>((invalid | was_held) << axis);
    const std::uint8_t flags = flags_.fetch_and(static_cast<std::uint8_t>(~own), std::memory_order_relaxed);
    Action action{.calibrate = (flags & calibrating) != 0};
    if ((flags & invalid << axis) == 0) return action;
    if ((flags & was_held << axis) == 0) held_[axis] = 0;
    if (held_[axis] == longest) return action;
    ++held_[axis];
    flags_.fetch_or(static_cast<std::uint8_t>(was_held << axis), std::memory_order_relaxed);
    action.hold = true;
    return action;
  }

 private:
  static constexpr std::uint8_t calibrating = 1, invalid = 1U << 1, was_held = 1U << 4;
  static_assert(firmware::axis_count <= 3);
  std::atomic<std::uint8_t> flags_{0};
  std::array<std::uint8_t, firmware::axis_count> held_{};  ///< in a row
};

/// How much interference on the lines is forgiven: a leaky bucket of `most`, `leak` less a millisecond. Up to
/// 5,000 disturbances a second pass for ever; a line that is disturbed in every period would leave the
/// current loop without samples, and nobody would know: that is over after 1.3 ms.
///
/// Contexts: ISR_ functions the line interrupts, which do not interrupt each other; all others the main loop.
class InterferenceBudget {
 public:
  static constexpr std::uint8_t most = 20, leak = 5;

  bool ISR_spent() const { return level_.load(std::memory_order_relaxed) >= most; }
  /// Only while it is not spent.
  void ISR_forgive() {
    level_.fetch_add(1, std::memory_order_relaxed);
    forgiven_.store(forgiven_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  /// At any time: all that has leaked since the last call leaks then, for each whole millisecond since the
  /// bucket was last seen empty.
  void poll(std::uint32_t now_us) {
    const std::uint8_t level = level_.load(std::memory_order_relaxed);
    const std::uint32_t passed_ms = (now_us - leaked_at_us_) / 1'000;
    leaked_at_us_ = level == 0 ? now_us : leaked_at_us_ + 1'000 * passed_ms;
    const std::uint32_t leaked = leak * passed_ms;
    level_.fetch_sub(leaked < level ? static_cast<std::uint8_t>(leaked) : level, std::memory_order_relaxed);
  }
  /// Since the start; wraps at 2^32.
  std::uint32_t forgiven() const { return forgiven_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint8_t> level_{0};
  std::atomic<std::uint32_t> forgiven_{0};
  std::uint32_t leaked_at_us_ = 0;
};

}  // namespace kmax::board
