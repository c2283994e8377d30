#include "host_tools/calibration/trip_diagnosis.hpp"

#include <fmt/format.h>

namespace kmax::calibration {

using firmware::Fault;
using firmware::Refusal;

Diagnosis diagnosis_of(const Trip& trip) {
  const std::string words = "the axis tripped: " + trip.words;
  switch (trip.fault) {
    case Fault::under_voltage:
      return {"supply_too_low", words, "use a supply that holds its voltage under load, or lower --current"};
    case Fault::excitation_travel:
      return {"travel_too_small", words, "allow more with --travel, or move the handle away from its stops"};
    case Fault::encoder:
      return {"encoder_dead", words, "check the encoder's cable and supply, and encoder.kind"};
    case Fault::emergency_stop:
      return {"emergency_stop", words, "release the emergency stop once it is clear why it was pressed"};
    case Fault::power_stage:
    case Fault::gate_driver:
      return {std::string(firmware::text_of(trip.fault).name), words,
              "check the supply and the gate driver, which needs it"};
    case Fault::spin_out:
      return {"motor_runs_away", words, "calibrate the encoder first: --steps encoder"};
    default:
      return {std::string(firmware::text_of(trip.fault).name), words, "see 'kmax state'"};
  }
}

void require_no_trip(const Recording& recording) {
  if (recording.trip) throw StepFailed(diagnosis_of(*recording.trip));
}

Diagnosis diagnosis_of(Refusal refusal, double supply, double supply_min, double supply_max) {
  std::string words = fmt::format("the axis was not armed: {}", firmware::to_string(refusal));
  switch (refusal) {
    case Refusal::supply_out_of_range:
      words =
          fmt::format("the supply is {:.3g} V; supply.voltage_min is {:.3g} V, supply.voltage_max {:.3g} V",
                      supply, supply_min, supply_max);
      if (supply < supply_min)
        return {"supply_too_low", words,
                "use the supply that this device is made for, or lower supply.voltage_min"};
      return {"supply_too_high", words,
              "use the supply that this device is made for, or raise supply.voltage_max"};
    case Refusal::encoder_invalid:
      return {"encoder_dead", words, "check the encoder's cable and supply, and encoder.kind"};
    case Refusal::current_sense_invalid:
      return {"current_sensor", words, "check the shunts and the gate driver's amplifiers"};
    case Refusal::emergency_stop:
      return {"emergency_stop", words, "release the emergency stop once it is clear why it was pressed"};
    case Refusal::power_stage_not_ready:
      return {"power_stage", words + fmt::format(", and the supply is {:.3g} V", supply),
              "check the supply, and the gate driver, which needs it to answer"};
    case Refusal::gate_driver_fault:
      return {"gate_driver", words, "look for a short between phases or to ground, and check the supply"};
    default:
      return {"not_armed", words, "see 'kmax state'"};
  }
}

}  // namespace kmax::calibration
