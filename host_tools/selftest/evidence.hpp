#pragma once
// What the self-test measures of an axis; the checks are functions of it alone.

#include <optional>
#include <string>
#include <vector>

#include "firmware/drive/fault.hpp"
#include "firmware/parameters/refusal.hpp"
#include "host_tools/bench/circuit.hpp"
#include "host_tools/selftest/pulse.hpp"

namespace kmax::selftest {

using bench::Circuit;

/// What the pulses along the phases say about the circuit.
struct PhaseFinding {
  bench::Circuit circuit = bench::Circuit::unclear;
  double admittance = 0.0;         ///< of the winding, as a multiple of the one it was judged by
  double judged_resistance = 0.0;  ///< ohm
  double residual = 1.0;           ///< of the pattern that fits best: 0 exact, 1 not at all
  /// Of the sensors to each pulse, as a multiple of the current along the pulse that the claimed winding
  /// would carry.
  std::vector<bench::SensorAnswer> answers{};
};

/// Finds the circuit by how the currents of B and C answer to voltages (host_tools/bench/circuit.hpp).
///
/// Synchronous motor: three pulses along 0, 120 and 240 degrees, the axes of the phases A, B, C. Each
/// sensor's answer is compared with the current that the claimed winding (first-order, resistance and
/// inductance) would carry under the voltage that was really given; that makes six numbers. DC motor: one
/// pulse. A short between two phases that outweighs the winding has the pattern of the third phase open, and
/// several times the claimed admittance.
///
/// The circuit with the smallest residual counts if it leaves less than 0.2 of the square unexplained and the
/// next leaves twice as much. An answer below 5 % of the claimed current, or within three standard deviations
/// of the noise, counts as none.
PhaseFinding judge_phases(const std::vector<PulseResponse>& pulses, const AxisFacts& facts);

/// How far the handle answers to current, m per A s^2 (the second integral of the current), seen in two
/// ways that share nothing but the current: by the encoder, and by the voltage that the moving motor induces.
struct MotionEvidence {
  double by_encoder = 0.0, encoder_deviation = 0.0;
  double by_back_emf = 0.0;
  double free_handle = 0.0;  ///< of the claimed mass and torque constant without friction
  /// V/(A s): voltage induced per impulse of current.
  double back_emf = 0.0, back_emf_deviation = 0.0, free_back_emf = 0.0;
  double largest_impulse = 0.0;   ///< A s
  double largest_back_emf = 0.0;  ///< V, in the strongest swing
  double largest_voltage = 0.0;   ///< V, of the pulses
  /// m: largest excursion within one swing, as the encoder saw it and as the back-EMF has it.
  double encoder_excursion = 0.0, back_emf_excursion = 0.0;
  bool calibrated = false;
  double counts = 0.0;  ///< the encoder's excursion in counts
  /// rad, electrical angle of the rotor by which swing moved the handle which way; synchronous motors. None
  /// if it did not move.
  std::optional<double> rotor_angle;

  /// Seen beyond doubt: five standard deviations and two counts.
  bool encoder_moved() const;
  /// Five standard deviations, a fiftieth of the voltage and, if the motor is calibrated, a sixth of what a
  /// free handle would induce.
  bool back_emf_moved() const;
  /// Twice that could not have stayed unseen. Not known without calibration.
  bool back_emf_would_show() const;
  static constexpr double moving_share = 1.0 / 6.0;
};

/// In a swing the circuit obeys  L di/dt = v - R i - e S - d sign(i) - constant,  S the integral of i: a free
/// handle's speed is proportional to S, so e, in V/(A s), is the back-EMF per impulse; k_t^2 / (m r^2) for a
/// DC motor. d is what the bridge's dead time takes. A handle that is blocked has e = 0. For a synchronous
/// motor whose rotor stands at an angle d from the direction it is sin^2 d times 2/3 of that (amplitude
/// convention); two directions a right angle apart add up to 2/3. Only the motor's own current and voltage
/// enter, so this tells a dead encoder from a handle that does not move. Fitted as i = (F v - e F S - d F
/// sign(i))/R + constant, F the winding's lag, whose time constant is the one that leaves the smallest
/// residual.
///
/// The encoder's answer is the coefficient of F S when its velocity, behind the same lag, is fitted to the
/// same four. Whatever friction or a hand do to the motion, they do to both alike. A synchronous motor's two
/// coefficients are G sin(direction - rotor angle).
///
/// by_back_emf is the handle's answer that makes e: e x r / k_t (x 3/2). Without calibration k_t is not
/// known; then sqrt(e / m), which is the same for a handle without friction.
///
/// `swings`: one (DC), or two, along 0 and 90 degrees; or several such sets, which are averaged.
std::optional<MotionEvidence> motion_evidence(const std::vector<PulseResponse>& swings,
                                              const AxisFacts& facts);

/// A fault that the axis had before the test, which a test cannot leave as it is.
struct FaultAtStart {
  firmware::Fault fault = firmware::Fault::none;  ///< none: one that this program does not know
  std::string words;                              ///< with the number that tripped it
  bool cleared = false;                           ///< else its cause remains
};

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
  std::optional<PulseResponse> rest;        ///< bridge off
  std::vector<PulseResponse> swings;        ///< along 0 and 90 degrees; a DC motor has one
  std::optional<PulseResponse> under_load;  ///< a swing with the supply recorded
  std::optional<PhaseFinding> phases;
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

/// Why there are no pulses, to be said by the checks that need them; empty if there are.
std::string reason_without_pulses(const Evidence& evidence);

}  // namespace kmax::selftest
