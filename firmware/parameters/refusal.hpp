#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace kmax::firmware {

/// Why a request was refused. Kept by the device (refusal.reason, drive.refusal) so that a host can say it
/// in words; the numbers are part of the protocol and only ever appended to.
enum class Refusal : std::uint16_t {
  none = 0,
  unknown_register = 1,
  read_only = 2,
  value_cut_in_two = 3,
  out_of_range = 4,
  not_a_choice = 5,
  not_finite = 6,
  while_armed = 7,
  rate_does_not_divide = 8,
  adaptive_interval_empty = 9,
  supply_interval_empty = 10,
  transaction_open = 11,
  no_transaction = 12,
  handle_inside_wall = 13,
  fault_present = 14,
  encoder_invalid = 15,
  emergency_stop = 16,
  gate_driver_fault = 17,
  supply_out_of_range = 18,
  power_stage_not_ready = 19,
  current_sense_invalid = 20,
  store_busy = 21,
  store_missing = 22,
  too_hot = 23,
  commutation_unknown = 24,
  motor_too_hot = 25,
  capture_without_channels = 26,
  capture_missing = 27,
  compensation_beyond_friction = 28,
  heartbeat_missing = 29,
  restarting = 30,
  guard_refused = 31,
  only_tightens = 32,
  other_commander = 33,
  armed_by_broadcast = 34,
  locked = 35,
  wrong_code = 36,
  code_waits = 37,
  no_code = 38,
  axis_absent = 39,
  supply_above_ceiling = 40,
};

struct RefusalText {
  Refusal refusal;
  std::string_view words;
};

inline constexpr std::array refusal_texts = std::to_array<RefusalText>({
    {Refusal::none, "not refused"},
    {Refusal::unknown_register, "there is no such register"},
    {Refusal::read_only, "it can only be read"},
    {Refusal::value_cut_in_two, "a value of two registers must be written whole"},
    {Refusal::out_of_range, "the value is out of range"},
    {Refusal::not_a_choice, "the value is not one of the choices"},
    {Refusal::not_finite, "the value is not a finite number"},
    {Refusal::while_armed, "it cannot change while an axis is armed; disarm first"},
    {Refusal::rate_does_not_divide, "haptic.rate must divide the tick rate of 20000 Hz without a remainder"},
    {Refusal::adaptive_interval_empty, "wall.adaptive_force_min must not exceed wall.adaptive_force_max"},
    {Refusal::supply_interval_empty, "supply.voltage_min must be below supply.voltage_max"},
    {Refusal::transaction_open,
     "a transaction is open, of another link or program; try again when it has ended, at the latest 2 s "
     "after its last write"},
    {Refusal::no_transaction,
     "no transaction is open (one that was left open has been dropped; write 0 to transaction.control, or "
     "wait 30 s)"},
    {Refusal::handle_inside_wall, "the handle is inside the wall; move it out and arm again"},
    {Refusal::fault_present, "a fault is present; clear it first"},
    {Refusal::encoder_invalid, "the encoder gives no valid count"},
    {Refusal::emergency_stop, "the emergency stop is pressed or its line is open"},
    {Refusal::gate_driver_fault, "the gate driver reports a fault or does not answer"},
    {Refusal::supply_out_of_range, "the supply is outside supply.voltage_min .. supply.voltage_max"},
    {Refusal::power_stage_not_ready,
     "the power stage is still starting; try again in a moment, with the motor at rest"},
    {Refusal::current_sense_invalid,
     "a current sensor reads current while the bridge is off; check the power stage before arming"},
    {Refusal::store_busy, "the parameters are being saved; try again in a moment"},
    {Refusal::store_missing, "this device has no memory to keep parameters in"},
    {Refusal::too_hot, "the power stage is hotter than temperature.limit, or its sensor is broken"},
    {Refusal::commutation_unknown,
     "the synchronous motor's electrical angle is not known since the last start: move the handle past the "
     "encoder's index, or run 'kmax calibrate'"},
    {Refusal::motor_too_hot, "the winding is hotter than temperature.motor_limit; let it cool down"},
    {Refusal::capture_without_channels, "no channel to capture is chosen; set capture.channel_1"},
    {Refusal::capture_missing, "this device has no memory for captures"},
    {Refusal::compensation_beyond_friction,
     "compensation.limit must be 0 or below guard.friction, so that a handle at rest cannot be moved by it"},
    {Refusal::heartbeat_missing,
     "a node that is watched (heartbeat_consumer.*) is silent; start it, or stop watching it"},
    {Refusal::restarting, "the device is about to restart"},
    {Refusal::guard_refused,
     "the stability check fails: this wall is not guaranteed to be stable on this device (guard.mode is "
     "refuse); 'kmax check' explains it"},
    {Refusal::only_tightens,
     "while its axis is armed this bound can only be tightened, or loosened as far as a ceiling that was set "
     "before; disarm first"},
    {Refusal::other_commander,
     "another link has armed this axis, or one that it would push: over this link it can be disarmed or "
     "halted, and its protective bounds tightened; all else after it is disarmed"},
    {Refusal::armed_by_broadcast, "a broadcast arms no axis; write the controlword to each unit"},
    {Refusal::locked, "the device is locked; 'kmax unlock' opens it, with the code that its owner has set"},
    {Refusal::wrong_code, "the code is wrong"},
    {Refusal::code_waits,
     "after a wrong code no code is taken for a while, not even the right one; lock.wait says how long"},
    {Refusal::no_code, "no code is set, so there is nothing to lock with; 'kmax lock' sets one"},
    {Refusal::axis_absent,
     "the axis is absent: its gate driver has not answered since the start, or drive.declared_absent is yes; "
     "'kmax state' tells which"},
    {Refusal::supply_above_ceiling,
     "supply.voltage_max must not exceed supply.ceiling, which the board's capacitors and MOSFETs bear"},
});

constexpr std::string_view to_string(Refusal refusal) {
  for (const RefusalText& text : refusal_texts) {
    if (text.refusal == refusal) return text.words;
  }
  return "refused for a reason this program does not know";
}

}  // namespace kmax::firmware
