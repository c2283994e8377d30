#pragma once

#include <algorithm>
#include <cstdint>

// When to leave bus-off: what a CAN node does that the others have silenced, as a state machine without
// registers. RM0090 chapter on bxCAN, section Error management (Bus-Off recovery); ISO 11898-1, fault
// confinement.
//
// Bus-off means that the transmit error counter went past 255: this node's frames, or everybody's, are
// destroyed. Coming back at once and failing again loads a bus that may be fine without us. So: wait, then
// let the hardware count its 128 times 11 recessive bits, then talk again. The wait doubles each time, 100 ms
// to 2 s, and is short again after the node has stayed on the bus for a second.
//
//   off -> joining -> on_bus -> waiting -> entering -> recovering -> on_bus
//
// Contexts: main loop. Times are std::uint32_t microseconds that wrap; differences count.

namespace kmax::drivers::stm32f4 {

enum class CanBusState : std::uint8_t {
  off,      ///< not configured
  joining,  ///< waiting for 11 recessive bits; frames may be queued
  on_bus,
  waiting,     ///< bus-off, back-off time
  entering,    ///< initialization mode requested
  recovering,  ///< the hardware counts recessive bits; on a bus that is stuck it stays here
};

enum class CanBusOffAction : std::uint8_t {
  none,
  drop_frames,
  request_initialization,
  leave_initialization,
  resume
};

struct CanBusOffCounters {
  std::uint32_t bus_offs = 0;
};

class CanBusOff {
 public:
  void start() {
    wait_us_ = shortest_wait_us;
    state_ = CanBusState::joining;
  }
  void stop() { state_ = CanBusState::off; }

  CanBusState state() const { return state_; }
  bool may_send() const { return state_ == CanBusState::joining || state_ == CanBusState::on_bus; }
  const CanBusOffCounters& counters() const { return counters_; }

  /// `bus_off`: BOFF; `in_initialization`: INAK. One action at most, which the caller carries out.
  CanBusOffAction poll(std::uint32_t now_us, bool bus_off, bool in_initialization) {
    switch (state_) {
      case CanBusState::off:
        return CanBusOffAction::none;
      case CanBusState::joining:
        if (bus_off) return fall(now_us);
        if (!in_initialization) enter(CanBusState::on_bus, now_us);
        return CanBusOffAction::none;
      case CanBusState::on_bus:
        if (bus_off) return fall(now_us);
        if (now_us - since_us_ >= stable_us) {
          wait_us_ = shortest_wait_us;
          since_us_ = now_us - stable_us;  // so that the difference never wraps
        }
        return CanBusOffAction::none;
      case CanBusState::waiting:
        if (now_us - since_us_ < this_wait_us_) return CanBusOffAction::none;
        enter(CanBusState::entering, now_us);
        return CanBusOffAction::request_initialization;
      case CanBusState::entering:
        if (!in_initialization) return CanBusOffAction::none;
        enter(CanBusState::recovering, now_us);
        return CanBusOffAction::leave_initialization;
      case CanBusState::recovering:
        if (bus_off || in_initialization) return CanBusOffAction::none;
        enter(CanBusState::on_bus, now_us);
        return CanBusOffAction::resume;
    }
    return CanBusOffAction::none;
  }

 private:
  CanBusOffAction fall(std::uint32_t now_us) {
    ++counters_.bus_offs;
    this_wait_us_ = wait_us_;
    wait_us_ = std::min(2 * wait_us_, longest_wait_us);
    enter(CanBusState::waiting, now_us);
    return CanBusOffAction::drop_frames;
  }

  void enter(CanBusState state, std::uint32_t now_us) {
    state_ = state;
    since_us_ = now_us;
  }

  static constexpr std::uint32_t shortest_wait_us = 100'000, longest_wait_us = 2'000'000;
  /// On the bus for this long: the next wait is the shortest again.
  static constexpr std::uint32_t stable_us = 1'000'000;
  CanBusState state_ = CanBusState::off;
  std::uint32_t since_us_{};
  std::uint32_t wait_us_{}, this_wait_us_{};  ///< of the next bus-off, and of this one
  CanBusOffCounters counters_{};
};

}  // namespace kmax::drivers::stm32f4
