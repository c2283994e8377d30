#include "host_tools/virtual_board/odrive_v3/brake_driver.hpp"

#include <algorithm>
#include <cmath>

namespace kmax::virtual_board {

// On: C dV/dt = -I - V/R. Off: towards full.
double BrakeDriver::at(BoardTime now) const {
  const double t = seconds(now - since_);
  if (!on_) return config_.full + (voltage_ - config_.full) * std::exp(-t / config_.fills_within);
  const double end = -config_.drain * config_.gate_resistance;
  return end + (voltage_ - end) * std::exp(-t / (config_.gate_resistance * config_.capacitance));
}

void BrakeDriver::settle(BoardTime now) {
  if (on_) longest_on_ = std::max(longest_on_, seconds(now - on_since_));
  voltage_ = at(now);
  lowest_ = std::min(lowest_, voltage_);
  since_ = now;
}

/// The gate takes its share of the charge.
void BrakeDriver::switch_on(BoardTime now) {
  on_ = true;
  on_since_ = now;
  voltage_ *= config_.capacitance / (config_.capacitance + config_.gate_capacitance);
}

/// When the next threshold is passed.
void BrakeDriver::look_ahead() {
  next_ = never;
  double wait = 0.0;
  if (on_) {
    const double end = -config_.drain * config_.gate_resistance;
    const double least = config_.rising - config_.hysteresis;
    wait = config_.gate_resistance * config_.capacitance * std::log((voltage_ - end) / (least - end));
  } else if (starved_) {
    wait = config_.fills_within * std::log((config_.full - voltage_) / (config_.full - config_.rising));
  } else {
    return;
  }
  next_ = since_ + static_cast<BoardTime>(std::max(wait, 0.0) * static_cast<double>(units_per_second)) + 1;
}

void BrakeDriver::drive(bool on, bool supplied, BoardTime now) {
  advance(now);
  settle(now);
  wanted_ = on && supplied;
  const bool turns = (wanted_ && !starved_) != on_;
  if (turns) {
    on_ = false;
    if (wanted_) switch_on(now);
  }
  look_ahead();
}

bool BrakeDriver::advance(BoardTime now) {
  const bool before = on_;
  while (next_ <= now) {
    const BoardTime event = next_;
    settle(event);
    if (on_) {
      starved_ = true;
      ++drop_outs_;
      on_ = false;
    } else {
      starved_ = false;
      if (wanted_) switch_on(event);
    }
    look_ahead();
  }
  return before != on_;
}

}  // namespace kmax::virtual_board
