#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace kmax::firmware {

/// Every way in which an axis loses its force by itself.
enum class Fault : std::uint8_t {
  none,
  not_finite,
  over_speed,
  encoder,
  link_silent,
  main_loop,
  emergency_stop,
  gate_driver,
  under_voltage,
  over_voltage,
  over_current,
  phase_open,
  current_sense,
  over_temperature,
  power_stage,
  tick_missed,
  current_sum,
  spin_out,
  motor_too_hot,
  excitation_travel,
  bus_off,
  heartbeat_lost,
  unstable_wall,
};

struct FaultText {
  Fault fault;
  std::uint16_t error_code;  ///< CiA 402 / CiA 301 error code, object 0x603F
  std::string_view name;
  std::string_view unit;   ///< of drive.fault_value and drive.fault_bound
  std::string_view what;   ///< what happened
  std::string_view check;  ///< what the user should look at
};

/// Error codes: CiA 402 table of error codes where one fits; 0xFF00 and up are the manufacturer's.
inline constexpr std::array fault_texts = std::to_array<FaultText>({
    {Fault::none, 0x0000, "none", "", "no fault", ""},
    {Fault::not_finite, 0xFF01, "not_finite", "", "the force or the velocity was not a finite number",
     "look for absurd parameters with 'kmax list --changed'; if there are none, report it as a defect"},
    {Fault::over_speed, 0x8480, "over_speed", "m/s", "the handle was faster than velocity.limit",
     "check encoder.counts_per_turn and device.transmission, the encoder's cable, and velocity.limit"},
    {Fault::encoder, 0x7305, "encoder", "", "the encoder gave no valid count",
     "check the encoder's cable and supply, and encoder.kind; then switch the device off and on: its "
     "position is lost"},
    {Fault::link_silent, 0x8130, "link_silent", "s", "the host was silent for longer than link.timeout",
     "check the cable and the host program"},
    {Fault::main_loop, 0x6100, "main_loop", "", "the firmware's main loop stood still for more than 0.1 s",
     "report it as a defect, with what was done before"},
    {Fault::emergency_stop, 0xFF02, "emergency_stop", "", "the emergency stop line was opened",
     "release the emergency stop, look why it was pressed, then clear the fault"},
    {Fault::gate_driver, 0x5440, "gate_driver", "", "the gate driver pulled its fault line",
     "look for a short between phases or to ground, and check the supply"},
    {Fault::under_voltage, 0x3220, "under_voltage", "V", "the supply fell below supply.voltage_min",
     "check the supply, its cable and its current limit"},
    {Fault::over_voltage, 0x3210, "over_voltage", "V", "the supply rose above supply.voltage_max",
     "a braking motor pumps the supply up: check the brake resistor, and that the supply is the right one"},
    {Fault::over_current, 0x2310, "over_current", "A", "a phase current was far above current.limit",
     "check for a short, motor.resistance and motor.inductance, and current.bandwidth"},
    {Fault::phase_open, 0x3331, "phase_open", "A",
     "a phase current vanished while the motor was being driven",
     "check the motor's cable, plugs and solder joints"},
    {Fault::current_sense, 0x5210, "current_sense", "", "a current sensor read against its rail",
     "check the gate driver's amplifier settings and the shunts"},
    {Fault::over_temperature, 0x4310, "over_temperature", "degC",
     "the power stage was hotter than temperature.limit", "let it cool down; lower current.limit"},
    {Fault::power_stage, 0x5400, "power_stage", "", "the power stage was not ready",
     "check the supply; the gate driver needs it to answer, and a motor that is not turned fast"},
    {Fault::tick_missed, 0xFF03, "tick_missed", "", "a control tick was late or lost",
     "report it as a defect, with what was done before"},
    {Fault::current_sum, 0x2330, "current_sum", "A",
     "the phase currents did not add up to zero: current leaks to ground or a sensor is wrong",
     "check the motor's insulation, its cable and the shunts; 'kmax selftest' tells which"},
    {Fault::spin_out, 0xFF04, "spin_out", "J",
     "the handle gained energy that neither the motor nor a hand can have given it: the motor runs away",
     "the encoder slipped, or encoder.direction or motor.electrical_offset is wrong: run 'kmax calibrate'; "
     "or a hand pushed harder than device.hand_force"},
    {Fault::motor_too_hot, 0x4210, "motor_too_hot", "degC",
     "the winding was hotter than temperature.motor_limit",
     "let it cool down; lower current.limit, or correct the motor's thermal values under temperature.*"},
    {Fault::excitation_travel, 0xFF05, "excitation_travel", "m",
     "the handle moved farther than excitation.travel while it was being excited",
     "hold the handle's surroundings free, move it away from its stops, or allow it more travel"},
    {Fault::bus_off, 0x8140, "bus_off", "",
     "the CAN controller went off the bus while CAN commanded the axis",
     "check the CAN cable, its two terminations of 120 ohm, and that all nodes have the same bit rate"},
    {Fault::heartbeat_lost, 0xFF06, "heartbeat_lost", "",
     "the heartbeat of a node that is watched (heartbeat_consumer.*) stayed away",
     "check the program or node that sends it, and the time it is given"},
    {Fault::unstable_wall, 0xFF07, "unstable_wall", "N",
     "the wall oscillated under the hand, and instability.action is trip: force amplitude",
     "lower wall.stiffness, or add a field or damping; 'kmax check' tells what is stable"},
});

constexpr const FaultText& text_of(Fault fault) {
  return fault_texts[static_cast<std::size_t>(fault)];
}

/// Without the texts, which stay on the host.
inline constexpr auto error_codes = [] {
  std::array<std::uint16_t, fault_texts.size()> codes{};
  for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = fault_texts[i].error_code;
  return codes;
}();

constexpr std::uint16_t error_code_of(Fault fault) {
  return error_codes[static_cast<std::size_t>(fault)];
}

constexpr const FaultText* fault_by_error_code(std::uint16_t error_code) {
  for (const FaultText& text : fault_texts) {
    if (text.error_code == error_code) return &text;
  }
  return nullptr;
}

static_assert(
    [] {
      for (std::size_t i = 0; i < fault_texts.size(); ++i) {
        if (static_cast<std::size_t>(fault_texts[i].fault) != i) return false;
      }
      return true;
    }(),
    "fault_texts must follow the enumeration");

}  // namespace kmax::firmware
