#pragma once
// A permanent-magnet synchronous motor with a star winding whose star point floats, in the rotor's frame (d
// along the magnet's flux, q a quarter turn ahead; amplitudes are kept, so that a phase current has the
// amplitude of the dq vector):
//
//   L_d di_d/dt = v_d - R i_d + w L_q i_q
//   L_q di_q/dt = v_q - R i_q - w (L_d i_d + flux)           R includes the leg's resistance
//   torque      = 3/2 p (flux i_q + (L_d - L_q) i_d i_q) + cogging
//   w = p speed, electrical angle = p angle + electrical offset
//
// The torque constant is N m per A of q current (amplitude), so flux = 2 k / (3 p). Phase A's axis is the
// electrical angle 0, B's 120, C's 240 degrees: currents i_B = i_q cos(angle + 90 - 120 degrees), and a
// positive q current turns the shaft forwards.
//
// Three terminals conducting: constant terminal voltages rotate in the dq frame with -w, so currents and
// voltages together obey a linear equation with constant coefficients. It is solved by its Taylor series, in
// steps of at most 1.25 of the equation's rate (the electrical angle of a step included) with the order that
// leaves a rest below 1e-13: nothing is approximated but rounding. The mean torque of a step, by Simpson's
// rule, is wrong by 1e-5 N m at worst, where the step is 1.25 of the rate, and 2e-8 N m in ordinary ones.
//
// Two terminals conducting, x and y (the third is open or blocked): one current, i_x = -i_y = i, with
//   d/dt (L(angle) i + sqrt(3) flux cos delta) = u_x - u_y - 2 R i
//   L = 2 (L_d cos^2 delta + L_q sin^2 delta),  delta from the d axis to the pair's axis.
// Classical Runge-Kutta in steps of at most 0.03 of its rate: error about 1e-9 of the current. It is a
// fault's mode and may cost more.
//
// Fewer: no current. Not modelled: saturation, harmonics of the flux, iron losses.
//
// Cost of advance(), three terminals, 25 us, L/R = 0.5 ms: 0.15 us. It grows with duration x R/L, for
// which L/R is bounded to 1 us or more. No heap.

#include <array>

#include "host_tools/simulation/brushed_dc_motor.hpp"
#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

struct SynchronousMotorConfig {
  double resistance = 0.6;         // ohm, one phase
  double inductance_d = 0.3e-3;    // H, one phase
  double inductance_q = 0.3e-3;    // H, one phase
  double torque_constant = 0.05;   // N m per A of q current
  double pole_pairs = 7.0;         // whole
  double electrical_offset = 0.0;  // rad, the electrical angle at shaft angle 0
  double cogging_torque = 0.0;     // N m, amplitude: -amplitude x sin(periods x angle)
  double cogging_periods = 42.0;   // per turn of the shaft, whole
};

inline constexpr std::array synchronous_motor_fields{
    ModelField<SynchronousMotorConfig>{"resistance", &SynchronousMotorConfig::resistance, 1e-4, 1000.0, "ohm",
                                       "resistance of a phase"},
    ModelField<SynchronousMotorConfig>{"inductance_d", &SynchronousMotorConfig::inductance_d, 1e-7, 1.0, "H",
                                       "inductance along the magnets"},
    ModelField<SynchronousMotorConfig>{"inductance_q", &SynchronousMotorConfig::inductance_q, 1e-7, 1.0, "H",
                                       "inductance across the magnets"},
    ModelField<SynchronousMotorConfig>{"torque_constant", &SynchronousMotorConfig::torque_constant, 1e-5,
                                       100.0, "N m/A", "torque constant, per ampere of q current"},
    ModelField<SynchronousMotorConfig>{"pole_pairs", &SynchronousMotorConfig::pole_pairs, 1.0, 64.0, "",
                                       "pole pairs", "whole"},
    ModelField<SynchronousMotorConfig>{"electrical_offset", &SynchronousMotorConfig::electrical_offset, -7.0,
                                       7.0, "rad", "electrical angle at the handle position 0"},
    ModelField<SynchronousMotorConfig>{"cogging_torque", &SynchronousMotorConfig::cogging_torque, 0.0, 100.0,
                                       "N m", "amplitude of the cogging"},
    ModelField<SynchronousMotorConfig>{"cogging_periods", &SynchronousMotorConfig::cogging_periods, 1.0,
                                       10000.0, "", "periods of the cogging in a turn", "whole"},
};

// Throws std::invalid_argument: a value outside its range, a number of pole pairs or cogging periods that is
// not whole, L/R below 1 us.
void validate(const SynchronousMotorConfig& config);

struct DirectQuadrature {
  double d = 0.0;
  double q = 0.0;
};

class SynchronousMotor {
 public:
  // Throws std::invalid_argument.
  explicit SynchronousMotor(const SynchronousMotorConfig& config = {});

  // Unplugs the wire of a terminal, or puts it back; its current is zero at once, the other two then carry
  // the same current.
  void set_open(std::size_t terminal, bool open);
  bool wired(std::size_t terminal) const { return !open_[terminal]; }

  // `duration` (s) > 0.
  void advance(const TerminalDrive& drive, const ShaftMotion& shaft, double duration);

  // Ends the currents of these terminals, as diodes do; two that are left carry the same current then, one
  // that is left none.
  void stop_currents(const std::array<bool, terminal_count>& stopped);

  TerminalValues currents() const { return terminals_of(alpha_, beta_); }
  TerminalValues mean_currents() const { return terminals_of(mean_alpha_, mean_beta_); }  // last advance
  DirectQuadrature currents_at(double angle) const;    // A, seen from the rotor at this shaft angle
  double torque_at(double angle) const;                // N m, without cogging
  double mean_torque() const { return mean_torque_; }  // of the last advance, without cogging
  double cogging_torque(double angle) const;           // N m

  double electrical_angle(double angle) const {
    return config_.pole_pairs * angle + config_.electrical_offset;
  }
  double electrical_speed(double speed) const { return config_.pole_pairs * speed; }
  double flux() const { return flux_; }  // V s

  // V that the turning shaft induces in each phase.
  TerminalValues induced(const ShaftMotion& shaft) const;
  // No two terminals have a larger induced voltage between them at this speed.
  double largest_induced(double speed) const {
    const double line = 1.7320508075688772 * flux_ * electrical_speed(speed);
    return line < 0 ? -line : line;
  }
  // H, seen by the current of one terminal that returns through the other two.
  double loop_inductance() const { return 0.75 * (config_.inductance_d + config_.inductance_q); }

  // Energy in the inductances at this shaft angle, J.
  double energy(double angle) const;
  const SynchronousMotorConfig& config() const { return config_; }

 private:
  static TerminalValues terminals_of(double alpha, double beta) {
    constexpr double half_root_three = 0.8660254037844386;
    return {alpha, -0.5 * alpha + half_root_three * beta, -0.5 * alpha - half_root_three * beta};
  }
  double torque(double d, double q) const {
    return torque_per_flux_ * (flux_ * q + (config_.inductance_d - config_.inductance_q) * d * q);
  }
  void advance_three(const TerminalDrive& drive, const ShaftMotion& shaft, double duration);
  void advance_two(std::size_t x, std::size_t y, const TerminalDrive& drive, const ShaftMotion& shaft,
                   double duration);

  SynchronousMotorConfig config_;
  double flux_ = 0.0;
  double torque_per_flux_ = 0.0;  // 3/2 p
  std::array<bool, terminal_count> open_{};
  double alpha_ = 0.0;  // A, the current vector in the stator's frame
  double beta_ = 0.0;
  double mean_alpha_ = 0.0;
  double mean_beta_ = 0.0;
  double mean_torque_ = 0.0;
};

}  // namespace kmax::simulation
