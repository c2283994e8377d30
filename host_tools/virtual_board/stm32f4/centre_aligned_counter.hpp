#pragma once

#include <cstdint>

#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

/// The counter of TIM1 and TIM8 in centre-aligned mode: 0, 1, ... top - 1, top, top - 1, ... 1, 0. RM0090,
/// Advanced-control timers, Center-aligned mode (up/down counting).
///
/// Nothing is stepped: the count is computed from the time since the last turn. The owner passes each turn,
/// at top (overflow) and at 0 (underflow), with turn() when its time has come, and says which top and tick
/// hold from there.
class CentreAlignedCounter {
 public:
  bool running() const { return running_; }
  bool down() const { return down_; }
  BoardTime tick() const { return tick_; }

  /// Only while stopped.
  void set_count(std::uint32_t count) { count_ = count; }
  void set_direction(bool down) { down_ = down; }

  /// From the present count in the present direction. Up needs count < top, down needs count > 0.
  void start(BoardTime now, BoardTime tick, std::uint32_t top) {
    running_ = true;
    top_ = top;
    count_from(now, tick);
  }

  void stop(BoardTime now) {
    count_ = count(now);
    running_ = false;
  }

  /// Back to 0 and upwards, running or not; needs top > 0.
  void restart(BoardTime now, BoardTime tick, std::uint32_t top) {
    count_ = 0;
    down_ = false;
    if (running_) start(now, tick, top);
  }

  /// The clock has changed; the fraction of a tick that had passed is lost.
  void change_tick(BoardTime now, BoardTime tick) {
    if (!running_ || tick == tick_) return;
    count_ = count(now);
    count_from(now, tick);
  }

  /// Valid up to the next turn.
  std::uint32_t count(BoardTime now) const {
    if (!running_) return count_;
    const auto ticks = static_cast<std::uint32_t>((now - origin_) / tick_);
    return down_ ? count_ - ticks : count_ + ticks;
  }

  /// `never` while stopped.
  BoardTime next_turn() const { return running_ ? next_turn_ : never; }

  /// When the running counter passes `count`, between 0 and top, on its way to the next turn.
  BoardTime time_of(std::uint32_t count) const { return next_turn_ - tick_ * (down_ ? count : top_ - count); }

  /// Passes the turn at next_turn().
  void turn(BoardTime tick, std::uint32_t top) {
    down_ = !down_;
    top_ = top;
    count_ = down_ ? top : 0;
    count_from(next_turn_, tick);
  }

  /// Passes as many pairs of turns as are due, nothing having changed in between.
  void skip_whole_periods(BoardTime now) {
    if (!running_ || next_turn_ > now) return;
    const BoardTime period = 2 * top_ * tick_;
    const BoardTime skipped = (now - next_turn_) / period * period;
    origin_ += skipped;
    next_turn_ += skipped;
  }

 private:
  void count_from(BoardTime now, BoardTime tick) {
    origin_ = now;
    tick_ = tick;
    next_turn_ = now + tick * (down_ ? count_ : top_ - count_);
  }

  bool running_ = false;
  bool down_ = false;
  std::uint32_t count_ = 0;  // at origin_
  std::uint32_t top_ = 0;
  BoardTime origin_ = 0;
  BoardTime tick_ = 1;
  BoardTime next_turn_ = never;
};

}  // namespace kmax::virtual_board
