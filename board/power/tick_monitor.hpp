#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "firmware/object_dictionary/entry.hpp"

namespace kmax::board {

/// Whether the ticks of all axes still come: for a slow clock's interrupt, and for the main loop.
class TickMonitor {
 public:
  using Axes = std::array<bool, firmware::axis_count>;

  void ISR_note(std::size_t axis) {
    ticked_[axis].store(for_the_clock | for_the_main_loop, std::memory_order_relaxed);
  }
  /// A slow clock's interrupt: an axis that the board has did not tick between three calls.
  bool ISR_have_stopped(const Axes& has) {
    bool silent = false;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
      silent = (has[axis] && !take(axis, for_the_clock)) || silent;
    // Twice in a row: after an erase, in which the core stood still, this may come before the last axis'
    // tick.
    silent_calls_ = silent ? silent_calls_ + 1 : 0;
    return silent_calls_ >= 2;
  }
  /// Main loop: all of them have ticked since the last call that said so.
  bool all_have_ticked(const Axes& has) {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (has[axis] && (ticked_[axis].load(std::memory_order_relaxed) & for_the_main_loop) == 0) return false;
    }
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) take(axis, for_the_main_loop);
    return true;
  }

 private:
  /// A tick sets both bits; who has seen one takes it back.
  static constexpr std::uint8_t for_the_clock = 1, for_the_main_loop = 2;
  bool take(std::size_t axis, std::uint8_t bit) {
    return (ticked_[axis].fetch_and(static_cast<std::uint8_t>(~bit), std::memory_order_relaxed) & bit) != 0;
  }

  std::array<std::atomic<std::uint8_t>, firmware::axis_count> ticked_{};
  std::uint32_t silent_calls_ = 0;
};

}  // namespace kmax::board
