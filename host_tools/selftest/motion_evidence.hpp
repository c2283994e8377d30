#pragma once

#include <optional>
#include <vector>

#include "host_tools/selftest/recording.hpp"

namespace kmax::selftest {

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
std::optional<MotionEvidence> motion_evidence(const std::vector<Recording>& swings, const AxisFacts& facts);

}  // namespace kmax::selftest
