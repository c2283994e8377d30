#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware/fault.hpp"
#include "firmware/refusal.hpp"
#include "host_tools/selftest/axis_facts.hpp"
#include "host_tools/selftest/check_result.hpp"
#include "host_tools/selftest/motion_evidence.hpp"
#include "host_tools/selftest/phase_response.hpp"
#include "host_tools/selftest/recording.hpp"

namespace kmax::selftest {

/// Exchanges with the device and what its counters made of them.
struct LinkTrial {
  int exchanges = 0, lost = 0;
  double mean_round_trip = 0.0, longest_round_trip = 0.0;  ///< s
  struct Counter {
    std::string name;
    double rise = 0.0;  ///< during the exchanges
  };
  std::vector<Counter> risen;  ///< error counters that rose
  bool over_can = false;       ///< or over a serial line
};

/// An attempt to arm the axis with zero volts.
struct ArmingTrial {
  bool armed = false;
  firmware::Refusal refusal = firmware::Refusal::none;
  /// That kept it from being armed; or excitation_travel, of an axis that was armed while its handle moved.
  firmware::Fault fault = firmware::Fault::none;

  std::string words() const;
};

/// All that was measured; the checks are functions of this alone.
struct Evidence {
  AxisFacts facts;
  LinkTrial link;
  std::optional<FaultAtStart> fault_at_start;
  std::vector<double> supply;  ///< V, readings at rest
  double temperature = 0.0;    ///< degC, of the power stage; NaN: its sensor is broken
  ArmingTrial arming;
  std::optional<Recording> rest;        ///< bridge off
  std::vector<Recording> swings;        ///< along 0 and 90 degrees; a DC motor has one
  std::optional<Recording> under_load;  ///< a pulse with the supply recorded
  std::optional<PhaseResponse> response;
  std::optional<MotionEvidence> motion;
  firmware::Fault pulse_fault = firmware::Fault::none;  ///< the first that ended a pulse
  double pulse_fault_value = 0.0;
  double largest_pulse_voltage = 0.0;  ///< V
  double largest_displacement = 0.0;   ///< m
  bool pulse_withheld = false;         ///< since the handle was not where it had been left

  /// A board without power stage (an ideal force source) measures neither supply nor currents, and arms.
  bool measures_currents() const;
  /// Farther than the test may move it, or while no pulse was given. A pulse that excitation.travel has ended
  /// nearer than that counts as the test's own: the trip goes by the way from where the pulse found the
  /// handle, also towards the start.
  bool handle_was_moved() const;
  static constexpr double travel = 0.8e-3;           ///< m, trip level of the whole test
  static constexpr double most_displacement = 1e-3;  ///< m
};

// One check per file. A check says `not_judged` with the reason when what it needs could not be measured.
CheckResult check_link(const Evidence& evidence);
CheckResult check_supply(const Evidence& evidence);
CheckResult check_emergency_stop(const Evidence& evidence);
CheckResult check_gate_driver(const Evidence& evidence);
CheckResult check_temperature(const Evidence& evidence);
CheckResult check_handle(const Evidence& evidence);
CheckResult check_current_sense(const Evidence& evidence);
CheckResult check_phases(const Evidence& evidence);
CheckResult check_encoder(const Evidence& evidence);

/// Motion by the encoder over motion by the back-EMF, and what of it is allowed.
struct EncoderScale {
  double ratio = 0.0, deviation = 0.0;
  static constexpr double least = 0.8, most = 1.25;
  bool wrong() const { return ratio + 2.0 * deviation < least || ratio - 2.0 * deviation > most; }
  /// Neither wrong nor surely right.
  bool doubtful() const {
    return !wrong() && (ratio - 2.0 * deviation < least || ratio + 2.0 * deviation > most);
  }
};
EncoderScale encoder_scale(const MotionEvidence& motion);

/// In the order in which faults act on what follows.
std::vector<CheckResult> run_checks(const Evidence& evidence);

/// Why there are no pulses, to be said by the checks that need them; empty if there are.
std::string reason_without_pulses(const Evidence& evidence);

/// One sentence: the faulty part and what it explains, or that none was found.
std::string conclusion(const Report& report);

}  // namespace kmax::selftest
