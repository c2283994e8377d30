#pragma once

#include <cstdint>

#include "firmware/drive/axis.hpp"
#include "firmware/drive/axis_state_machine.hpp"

namespace kmax::firmware {

/// What a statusword is made from.
struct DriveStatus {
  DriveState state = DriveState::not_ready_to_switch_on;
  DriveMode mode = DriveMode::haptic;
  bool supplied = false;             ///< the power stage's supply is within its bounds, or it needs none
  bool power_stage_on = false;       ///< the bridge is driven
  bool warning = false;              ///< no fault, but to be looked at: derating, a failed stability check,
                                     ///< a wall that oscillates or has been softened
  bool limited = false;              ///< less force than asked for
  bool halted = false;               ///< controlword bit 8
  bool force_is_zero = false;        ///< none is asked of the device
  bool excitation_finished = false;  ///< the present one has ended
};

/// The whole statusword.
///
/// Target reached (bit 10) is shown where there is a target: in "quick stop active", whose stop is over at
/// once; in mode torque once a halt has brought the force to zero; in mode excitation once it has ended. The
/// drive follows the command value (bit 12) while mode torque is enabled and not halted. Bit 9: controlwords
/// are always obeyed. Bit 8 and bits 13 to 15 are not used.
constexpr std::uint16_t statusword_of(const DriveStatus& status) {
  using namespace statusword;
  const bool enabled = status.state == DriveState::operation_enabled;
  const bool makes_torque = enabled && status.mode == DriveMode::torque;
  const bool at_target = status.state == DriveState::quick_stop_active ||
                         (makes_torque && status.halted && status.force_is_zero) ||
                         (enabled && status.mode == DriveMode::excitation && status.excitation_finished);
  unsigned word = base_of(status.state) | remote;
  if (status.supplied && status.power_stage_on) word |= voltage_enabled;
  if (status.warning) word |= warning;
  if (at_target) word |= target_reached;
  if (status.limited) word |= internal_limit_active;
  if (makes_torque && !status.halted) word |= follows_command_value;
  return static_cast<std::uint16_t>(word);
}

}  // namespace kmax::firmware
