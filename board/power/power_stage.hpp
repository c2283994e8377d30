#pragma once

#include <array>
#include <atomic>
#include <concepts>
#include <cstdint>

#include "drivers/line_look.hpp"
#include "firmware/drive/fault.hpp"
#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::board {

enum class OffsetProgress : std::uint8_t { running, accepted, refused };

enum class GateDriverAnswer : std::uint8_t {
  accepted,
  silent,    ///< a line that nobody drives
  faulty,    ///< a reply that is none, or settings that are not kept
  bus_busy,  ///< not asked
};

/// What the power stage's sequence needs of the board. All calls come from the main loop.
template <typename Hardware>
concept PowerStageHardware = requires(Hardware hardware, std::size_t axis, bool level) {
  /// EN_GATE, common to both gate drivers and to the supply of the brake's driver.
  {hardware.set_gate_enable(level)};
  { hardware.fault_line_low() } -> std::same_as<bool>;
  { hardware.emergency_stop_open() } -> std::same_as<bool>;
  /// False: an axis that is left alone, and whose other functions here are not called.
  { hardware.in_service(axis) } -> std::same_as<bool>;
  /// Writes and reads back one DRV8301.
  { hardware.configure_gate_driver(axis) } -> std::same_as<GateDriverAnswer>;
  { hardware.is_missing(axis) } -> std::same_as<bool>;
  /// Notes for the host what the axis' gate driver says of its faults, which a reset by EN_GATE wipes out.
  /// True: it says that the fault line is low for one of its own.
  { hardware.note_gate_driver_faults(axis) } -> std::same_as<bool>;
  /// The axis' gate driver is not there: in_service() is false for it from now on.
  {hardware.set_missing(axis)};
  /// Begins to average the current sensors' codes with the bridges off.
  {hardware.restart_offset_calibration()};
  { hardware.offset_progress() } -> std::same_as<OffsetProgress>;
  /// Once a millisecond from then on. False: an offset has left its window.
  { hardware.track_offsets() } -> std::same_as<bool>;
};

/// From power-up to bridges that may be armed, and back again after a fault. Bridges are off all the while;
/// what switches them on is the tick, and only while condition is none.
///
///   resetting   EN_GATE low for 1 ms (20 us make a full reset)
///   waking      20 ms until the gate drivers' serial interface answers
///   configuring the chips written and read back; one that fails sends all to `resetting` after 200 ms
///   measuring   offsets of the current sensors
///   ready       the offsets are tracked; one that leaves its window takes all to `resetting` after 200 ms
///
/// A board need not have all axes. A gate driver that has never answered since the start, three times while
/// another accepted what was written and none pulled the fault line, is not there, and the board goes on
/// without its axis. One that has answered and is silent later has failed, and so has a board none of whose
/// gate drivers answers. A DRV8301 whose motor is turned fast does not start (a voltage at its SH pins); it
/// is tried again until the motor stands.
///
/// One look at a line proves nothing (line_look.hpp): what is active here must stay so.
///
/// An edge of nFAULT takes ready to `resetting` as soon as no axis is armed: the driver's latched fault goes
/// away with the reset, and comes back if its cause is still there. So the host's fault reset is all that a
/// user has to do.
///
/// The emergency stop does not touch EN_GATE: without it the brake's driver has no supply either, and a motor
/// that is stopped is one that brakes. It counts as pressed until its line is closed and no axis is armed.
///
/// Contexts: ISR_ functions from the two line interrupts and the tick; poll() from the main loop.
template <PowerStageHardware Hardware>
class PowerStage {
 public:
  static constexpr std::uint32_t reset_us = 1'000, wake_us = 20'000, retry_us = 200'000, track_us = 1'000;
  static constexpr std::uint8_t rounds_until_missing = 3;

  explicit PowerStage(Hardware& hardware) : hardware_(hardware) {}

  enum class Line : std::uint8_t { fault, emergency_stop };
  /// Something was seen at the line: is it more than interference? 3 us at most.
  [[gnu::noinline]] bool ISR_is_meant(Line line) const {
    return drivers::ISR_is_meant([&hardware = hardware_, of_fault = line == Line::fault] {
      return of_fault ? hardware.fault_line_low() : hardware.emergency_stop_open();
    });
  }
  void ISR_take(Line line) {
    signs_.fetch_or(line == Line::fault ? fault_edge : stop_edge, std::memory_order_relaxed);
  }

  /// Why no axis may be driven now; none: it may.
  firmware::Fault condition() const {
    const std::uint32_t signs = signs_.load(std::memory_order_relaxed);
    if (signs == 0) [[likely]]
      return firmware::Fault::none;
    if ((signs & stop_edge) != 0) return firmware::Fault::emergency_stop;
    if ((signs & fault_edge) != 0) return firmware::Fault::gate_driver;
    return static_cast<firmware::Fault>(signs);
  }

  /// Main loop, at least every few milliseconds.
  void poll(std::uint32_t now_us, bool any_armed) {
    if (hardware_.emergency_stop_open() && ISR_is_meant(Line::emergency_stop)) {
      ISR_take(Line::emergency_stop);
    } else if (!any_armed) {
      signs_.fetch_and(~stop_edge, std::memory_order_relaxed);
      // It may have been pressed after it was looked at; that edge has just been wiped out.
      if (hardware_.emergency_stop_open()) ISR_take(Line::emergency_stop);
    }
    if (!started_) {
      started_ = true;
      begin_reset(now_us, firmware::Fault::power_stage);
    }
    const bool fault = (signs_.load(std::memory_order_relaxed) & fault_edge) != 0 ||
                       (hardware_.fault_line_low() && ISR_is_meant(Line::fault));
    if (state_ == State::ready && fault) {
      // Once: a look at the faults takes those back whose cause is over.
      const bool is_new = lasting() != firmware::Fault::gate_driver;
      set_lasting(firmware::Fault::gate_driver);
      if (is_new) note_gate_driver_faults();
      if (!any_armed) begin_reset(now_us, firmware::Fault::gate_driver);
      return;
    }
    advance(now_us);
  }

  /// Main loop, only while no axis is armed: through the whole sequence again, as when the gain must change.
  void restart(std::uint32_t now_us) { begin_reset(now_us, firmware::Fault::power_stage); }

  bool ready() const { return state_ == State::ready; }

 private:
  enum class State : std::uint8_t { resetting, waking, measuring, waiting, ready };

  void begin_reset(std::uint32_t now_us, firmware::Fault reason) {
    hardware_.set_gate_enable(false);
    set_lasting(reason);
    enter(State::resetting, now_us);
  }

  firmware::Fault lasting() const {
    return static_cast<firmware::Fault>(signs_.load(std::memory_order_relaxed) & 0xFFU);
  }
  /// In one step: in between the tick must never see that all is well. An edge that comes meanwhile stays.
  void set_lasting(firmware::Fault fault) {
    std::uint32_t signs = signs_.load(std::memory_order_relaxed);
    while (!signs_.compare_exchange_weak(signs, (signs & ~0xFFU) | static_cast<std::uint32_t>(fault),
                                         std::memory_order_relaxed)) {
    }
  }

  void enter(State state, std::uint32_t now_us) {
    state_ = state;
    since_us_ = now_us;
  }

  /// True: one of them says that it has a fault.
  bool note_gate_driver_faults() {
    bool any = false;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      // Also one that is left alone: it pulls the common line all the same.
      if (!hardware_.is_missing(axis)) any = hardware_.note_gate_driver_faults(axis) || any;
    }
    return any;
  }

  /// All axes in service; those that are found missing are no longer.
  bool configure_gate_drivers() {
    bool any = false, all = true;
    std::array<bool, firmware::axis_count> silent{};
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (!hardware_.in_service(axis)) continue;
      const GateDriverAnswer answer = hardware_.configure_gate_driver(axis);
      silent[axis] = answer == GateDriverAnswer::silent && !has_answered_[axis];
      has_answered_[axis] = has_answered_[axis] || answer == GateDriverAnswer::accepted;
      any = any || answer == GateDriverAnswer::accepted;
      all = all && (answer == GateDriverAnswer::accepted || silent[axis]);
    }
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (!silent[axis]) continue;
      // One that is there but does not start pulls its fault line.
      if (any && !hardware_.fault_line_low() && ++silent_rounds_[axis] >= rounds_until_missing) {
        hardware_.set_missing(axis);
      } else {
        all = false;
      }
    }
    return all;
  }

  void advance(std::uint32_t now_us) {
    const std::uint32_t elapsed = now_us - since_us_;
    switch (state_) {
      case State::resetting:
        if (elapsed < reset_us) return;
        hardware_.set_gate_enable(true);
        return enter(State::waking, now_us);
      case State::waking:
        if (elapsed < wake_us) return;
        // The drivers pull nFAULT while they start; an edge from then says nothing.
        signs_.fetch_and(~fault_edge, std::memory_order_relaxed);
        return leave_waking(now_us);
      case State::measuring:
        switch (hardware_.offset_progress()) {
          case OffsetProgress::running:
            return;
          case OffsetProgress::accepted:
            set_lasting(firmware::Fault::none);
            return enter(State::ready, now_us);
          case OffsetProgress::refused:
            return refuse_offsets(now_us);
        }
        return;
      case State::waiting:
        if (elapsed >= retry_us) begin_reset(now_us, lasting());
        return;
      case State::ready:
        if (elapsed < track_us) return;
        since_us_ = now_us;
        if (!hardware_.track_offsets()) refuse_offsets(now_us);
        return;
    }
  }
  /// A driver that answers and pulls the fault line is named, whatever keeps the other one silent.
  void leave_waking(std::uint32_t now_us) {
    const bool configured = configure_gate_drivers(), low = hardware_.fault_line_low();
    if (configured && !low) {
      hardware_.restart_offset_calibration();
      return enter(State::measuring, now_us);
    }
    const bool named = low && note_gate_driver_faults();
    set_lasting(configured || named ? firmware::Fault::gate_driver : firmware::Fault::power_stage);
    enter(State::waiting, now_us);
  }
  void refuse_offsets(std::uint32_t now_us) {
    set_lasting(firmware::Fault::current_sense);
    enter(State::waiting, now_us);
  }

  Hardware& hardware_;
  State state_ = State::resetting;
  std::uint32_t since_us_ = 0;
  bool started_ = false;
  std::array<bool, firmware::axis_count> has_answered_{};
  std::array<std::uint8_t, firmware::axis_count> silent_rounds_{};
  // One word, so that a tick in which all is well looks once. An edge is set by its interrupt and taken back
  // by the main loop; the low byte is a condition that lasts, the main loop's.
  static constexpr std::uint32_t fault_edge = 1U << 8, stop_edge = 1U << 9;
  std::atomic<std::uint32_t> signs_{static_cast<std::uint32_t>(firmware::Fault::power_stage)};
};

}  // namespace kmax::board
