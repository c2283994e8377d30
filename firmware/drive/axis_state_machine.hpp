#pragma once

#include <array>
#include <cstdint>

#include "firmware/drive/armed_axes.hpp"
#include "firmware/drive/fault.hpp"
#include "firmware/parameters/refusal.hpp"

namespace kmax::firmware {

/// The states of a drive (CiA 402 / IEC 61800-7-201, power drive system finite state automaton).
enum class DriveState : std::uint8_t {
  not_ready_to_switch_on,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction_active,
  fault,
};

/// Bits of the controlword, 0x6040.
namespace controlword {
inline constexpr std::uint16_t switch_on = 1u << 0;
inline constexpr std::uint16_t enable_voltage = 1u << 1;
inline constexpr std::uint16_t quick_stop = 1u << 2;  // active low
inline constexpr std::uint16_t enable_operation = 1u << 3;
inline constexpr std::uint16_t fault_reset = 1u << 7;
inline constexpr std::uint16_t halt = 1u << 8;
}  // namespace controlword

/// Enable operation, in the standard's command table: it arms an axis that is switched on, and leaves an
/// armed one armed.
constexpr bool asks_for_operation(std::uint16_t word) {
  constexpr std::uint16_t wanted = controlword::switch_on | controlword::enable_voltage |
                                   controlword::quick_stop | controlword::enable_operation;
  return (word & (wanted | controlword::fault_reset)) == wanted;
}

/// The force is to go to zero while the axis stays armed; mode torque only. No matter to the automaton.
constexpr bool halted(std::uint16_t word) {
  return (word & controlword::halt) != 0;
}

/// Base patterns of the statusword, 0x6041, and its other bits; see statusword.hpp.
namespace statusword {
inline constexpr std::uint16_t voltage_enabled = 1u << 4;
inline constexpr std::uint16_t warning = 1u << 7;
inline constexpr std::uint16_t remote = 1u << 9;
inline constexpr std::uint16_t target_reached = 1u << 10;
inline constexpr std::uint16_t internal_limit_active = 1u << 11;
inline constexpr std::uint16_t follows_command_value = 1u << 12;  // in mode torque

constexpr std::uint16_t base_of(DriveState state) {
  switch (state) {
    case DriveState::not_ready_to_switch_on:
      break;
    case DriveState::switch_on_disabled:
      return 0x40;
    case DriveState::ready_to_switch_on:
      return 0x21;
    case DriveState::switched_on:
      return 0x23;
    case DriveState::operation_enabled:
      return 0x27;
    case DriveState::quick_stop_active:
      return 0x07;
    case DriveState::fault_reaction_active:
      return 0x0F;
    case DriveState::fault:
      return 0x08;
  }
  return 0x00;
}

/// The state a statusword tells, by the standard's masks.
constexpr DriveState state_of(std::uint16_t word) {
  if ((word & 0x4Fu) == 0x40u) return DriveState::switch_on_disabled;
  if ((word & 0x6Fu) == 0x21u) return DriveState::ready_to_switch_on;
  if ((word & 0x6Fu) == 0x23u) return DriveState::switched_on;
  if ((word & 0x6Fu) == 0x27u) return DriveState::operation_enabled;
  if ((word & 0x6Fu) == 0x07u) return DriveState::quick_stop_active;
  if ((word & 0x4Fu) == 0x0Fu) return DriveState::fault_reaction_active;
  if ((word & 0x4Fu) == 0x08u) return DriveState::fault;
  return DriveState::not_ready_to_switch_on;
}
}  // namespace statusword

/// The option codes that the automaton depends on.
struct DriveOptions {
  /// profile.quick_stop_option: 6, or 0 where a quick stop leads straight to "switch on disabled".
  bool stay_in_quick_stop = true;
};

/// The CiA 402 automaton of one axis, pure: commands and events in, state out.
///
/// Decisions where the standard leaves a choice, each on the side of the hand on the device:
/// - Operation is enabled only by a rising edge of controlword bit 3. After a refusal (handle inside the
///   wall, say) a repeated 0x0F does nothing; the host must show a word without bit 3 first. So a held
///   controlword never makes force appear later, when the handle happens to leave the wall. Edges are those
///   of one link's words: another link's 0x06 disarms, and does not make an edge of the next 0x0F that the
///   commander goes on sending.
/// - Fault reset is a rising edge of bit 7, and is refused while the cause remains.
/// - Quick stop removes the force. As DriveOptions says, it stays in "quick stop active" until the voltage is
///   disabled, or leads on to "switch on disabled" (transitions 11 and 12 in one). Operation cannot be
///   re-enabled from "quick stop active" (the optional transition 16 is not offered).
/// - 0x0F in "ready to switch on" switches on and enables in one command (the standard's footnote).
class AxisStateMachine {
 public:
  DriveState state() const { return state_; }
  Fault fault() const { return fault_; }
  Refusal refusal() const { return refusal_; }
  bool armed() const { return state_ == DriveState::operation_enabled; }

  /// True if this word would ask for operation to be enabled; its conditions must then be looked up for
  /// command(). Has no effect.
  bool asks_to_enable(std::uint16_t word, Link by) const {
    const bool from = state_ == DriveState::switched_on || state_ == DriveState::ready_to_switch_on;
    return from && decode(word) == Command::enable_operation &&
           rising(word, by, controlword::enable_operation);
  }

  /// Self-test done: leaves "not ready to switch on" (transition 1).
  void initialised() {
    if (state_ == DriveState::not_ready_to_switch_on) state_ = DriveState::switch_on_disabled;
  }

  /// A controlword came and was refused, or superseded before it could act.
  void pass_over(std::uint16_t word, Link by) { previous_word_[static_cast<std::size_t>(by)] = word; }

  /// A controlword was written, by that link. `obstacle`: why operation cannot be enabled now (none: it can).
  /// `cause_remains`: the present fault's cause is still there. `options`: as they are now; one that changes
  /// in "quick stop active" does not move the state.
  void command(std::uint16_t word, Link by, Refusal obstacle, bool cause_remains,
               const DriveOptions& options = {}) {
    const bool reset_edge = rising(word, by, controlword::fault_reset);
    const bool enable_edge = rising(word, by, controlword::enable_operation);
    pass_over(word, by);
    if (state_ == DriveState::fault) {
      if (!reset_edge) return;
      refusal_ = cause_remains ? Refusal::fault_present : Refusal::none;
      if (cause_remains) return;
      fault_ = Fault::none;
      state_ = DriveState::switch_on_disabled;
      return;
    }
    const Command command = decode(word);
    if (command == Command::disable_voltage) return leave_to(DriveState::switch_on_disabled);  // 7, 9, 10, 12
    switch (state_) {
      case DriveState::switch_on_disabled:
        if (command == Command::shutdown) state_ = DriveState::ready_to_switch_on;  // 2
        break;
      case DriveState::ready_to_switch_on:
        if (command == Command::quick_stop) state_ = DriveState::switch_on_disabled;  // 7
        if (command == Command::switch_on) state_ = DriveState::switched_on;          // 3
        if (command == Command::enable_operation && enable_edge) {                    // 3, then 4
          state_ = DriveState::switched_on;
          enable(obstacle);
        }
        break;
      case DriveState::switched_on:
        if (command == Command::quick_stop) state_ = DriveState::switch_on_disabled;  // 10
        if (command == Command::shutdown) state_ = DriveState::ready_to_switch_on;    // 6
        if (command == Command::enable_operation && enable_edge) enable(obstacle);    // 4
        break;
      case DriveState::operation_enabled:
        if (command == Command::switch_on) state_ = DriveState::switched_on;        // 5
        if (command == Command::shutdown) state_ = DriveState::ready_to_switch_on;  // 8
        if (command == Command::quick_stop) state_ = after_quick_stop(options);     // 11
        break;
      case DriveState::not_ready_to_switch_on:
      case DriveState::quick_stop_active:
      case DriveState::fault_reaction_active:
      case DriveState::fault:
        break;
    }
  }

  /// The device itself disables the voltage, as when the network stops it. No controlword: bits that the host
  /// holds stay held.
  void disable() {
    if (state_ != DriveState::fault) leave_to(DriveState::switch_on_disabled);
  }

  /// Something failed (transition 13). The first fault is kept until it is reset.
  void trip(Fault fault) {
    if (fault == Fault::none || state_ == DriveState::fault || state_ == DriveState::fault_reaction_active)
      return;
    fault_ = fault;
    state_ = DriveState::fault_reaction_active;
  }

  /// The force has been removed (transition 14).
  void reaction_done() {
    if (state_ == DriveState::fault_reaction_active) state_ = DriveState::fault;
  }

 private:
  enum class Command : std::uint8_t {
    none,
    shutdown,
    switch_on,
    disable_voltage,
    quick_stop,
    enable_operation
  };

  // The standard's command table; a bit that does not matter is not looked at. Bit 7 set is a fault reset
  // and no other command.
  static constexpr Command decode(std::uint16_t word) {
    using namespace controlword;
    if ((word & fault_reset) != 0) return Command::none;
    if ((word & enable_voltage) == 0) return Command::disable_voltage;
    if ((word & quick_stop) == 0) return Command::quick_stop;
    if ((word & switch_on) == 0) return Command::shutdown;
    return (word & enable_operation) != 0 ? Command::enable_operation : Command::switch_on;
  }

  bool rising(std::uint16_t word, Link by, std::uint16_t bit) const {
    return (word & bit) != 0 && (previous_word_[static_cast<std::size_t>(by)] & bit) == 0;
  }

  void enable(Refusal obstacle) {
    refusal_ = obstacle;
    if (obstacle == Refusal::none) state_ = DriveState::operation_enabled;
  }

  static constexpr DriveState after_quick_stop(const DriveOptions& options) {
    return options.stay_in_quick_stop ? DriveState::quick_stop_active : DriveState::switch_on_disabled;
  }

  void leave_to(DriveState target) {
    if (state_ == DriveState::not_ready_to_switch_on || state_ == DriveState::fault_reaction_active) return;
    state_ = target;
  }

  DriveState state_ = DriveState::not_ready_to_switch_on;
  Fault fault_ = Fault::none;
  Refusal refusal_ = Refusal::none;
  std::array<std::uint16_t, link_count> previous_word_{};
};

}  // namespace kmax::firmware
