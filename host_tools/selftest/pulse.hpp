#pragma once
// The pulses of voltage that the self-test gives, and what they showed.

#include <cstdint>
#include <vector>

#include "firmware/drive/fault.hpp"
#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::selftest {

/// What the parameters claim about an axis; SI units.
struct AxisFacts {
  bool synchronous = false;  ///< else a DC motor on the legs B and C
  double resistance = 1.0, inductance = 1e-3, torque_constant = 0.05;
  int pole_pairs = 7;
  double electrical_offset = 0.0;  ///< rad
  bool calibrated = false;
  bool commutation_known = false;
  double current_limit = 5.0;
  double mass = 0.05, transmission = 0.05;
  double counts_per_turn = 8192, count_length = 1e-6;
  double tick = firmware::tick_interval;  ///< s
  double supply_min = 8.0, supply_max = 26.0;
  double temperature_limit = 100.0;

  /// V/(A s): what a free handle induces after an impulse of current.
  double free_back_emf() const {
    return torque_constant * torque_constant / (mass * transmission * transmission);
  }
  /// m/(A s2): acceleration of a free handle per ampere.
  double free_acceleration() const { return torque_constant / (mass * transmission); }
};

AxisFacts read_facts(device::Device& device, std::size_t axis);

/// A square wave of voltage that begins with a whole half at +voltage.
struct Pulse {
  double voltage = 0.0;           ///< V, amplitude; its sign is that of the first half
  std::uint32_t half_period = 0;  ///< ticks
  std::uint32_t duration = 0;     ///< ticks
  std::uint32_t ramp = 0;         ///< ticks in which the amplitude comes up
  double angle = 0.0;             ///< rad, electrical, in the stator's frame; a DC motor has none
};

/// How far a free handle without friction would go, m, if the current had this amplitude (A) at once.
///
/// Without ramp: the velocity rises to a T and falls back to zero (a acceleration, T half period): it moves
/// by a T^2 in every whole period and is at rest afterwards. With a ramp over several halves the velocity
/// swings evenly about zero, within +-a T/2, and the handle within a T^2/4. Real currents rise more slowly
/// and real handles have friction: both move less.
double bound_on_displacement(const AxisFacts& facts, const Pulse& pulse, double current);

/// A single period that moves a free handle by at most `displacement` (m) at `current` (A): its halves as
/// long as that allows, from 0.25 ms to 1 ms. If that is still too far, the voltage is smaller. The voltage
/// is what the claimed resistance asks for, at most 40 % of the supply.
Pulse plan_pulse(const AxisFacts& facts, double current, double displacement, double supply);

/// A long even swing of at most `displacement`: 20 halves of 0.5 to 4 ms, half of them the ramp. It ends in
/// the middle of a half, where the velocity is zero.
///
/// A synchronous motor has 12: in the stator's frame the force depends on where the rotor is, and a swing
/// pushes it, on average, to where there is none: by (2 pi n x)^2 / (8 l) at most in n periods of amplitude
/// x, l metres of handle per electrical radian. (Kapitza's pendulum; the swing also takes away the friction
/// that would hold it.)
Pulse plan_swing(const AxisFacts& facts, double current, double displacement, double supply);

/// What one pulse, or a while at rest, showed; one sample per tick.
struct PulseResponse {
  Pulse pulse{};
  std::size_t before = 0;                                       ///< samples before the pulse begins
  std::vector<double> voltage, current_b, current_c, position;  ///< V, A, A, m
  std::vector<double> supply;                                   ///< V
  firmware::Fault fault = firmware::Fault::none;                ///< that ended it
  double fault_value = 0.0;

  std::size_t size() const { return current_b.size(); }
  bool tripped() const { return fault != firmware::Fault::none; }
  /// Samples from which conclusions may be drawn: until the bridge is off again. Behind a trip that is the
  /// last sample at which a voltage was given.
  std::size_t end() const;
  /// Current along the pulse's direction, offsets of the time before the pulse removed: DC (b - c)/2.
  std::vector<double> current_along(bool synchronous) const;
};

struct MeanAndDeviation {
  double mean = 0.0, deviation = 0.0;
};
MeanAndDeviation mean_and_deviation(const std::vector<double>& values, std::size_t first, std::size_t last);

/// Amplitude and time constant of whatever one pulse's strongest sensor saw, without belief in the
/// parameters: for the scale and the shape of the currents that judge_phases() expects.
struct WindingEstimate {
  double amplitude = 0.0;      ///< A, of the strongest sensor at the ends of the halves
  double noise = 0.0;          ///< A, standard deviation before the pulse
  double time_constant = 0.0;  ///< s; the one that leaves the smallest residual
};

WindingEstimate estimate_winding(const PulseResponse& response, double tick);

}  // namespace kmax::selftest
