#pragma once
// A brushed DC motor between the terminals B and C:
//
//   L di/dt = u_B - u_C - (R + 2 R_leg) i - k speed,    torque = k i
//
// Positive current flows into B, out of C. With constant voltages and speed the solution is an exponential
// towards (u_B - u_C - k speed)/R; the current at the end and its mean are exact for an interval of any
// length, L/R long or short. Commutation ripple and brush drop are not modelled.
//
// Cost: 10 ns with the same duration and resistance as the call before (two exponentials otherwise). No heap.

#include <array>
#include <cstddef>

#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

// How a power stage and a motor meet: three terminals A, B, C in this order, each with a voltage against the
// supply's negative rail and a current that is positive into the motor. A brushed DC motor has only B and C.

inline constexpr std::size_t terminal_count = 3;
inline constexpr std::size_t terminal_a = 0, terminal_b = 1, terminal_c = 2;

using TerminalValues = std::array<double, terminal_count>;

// What the power stage does to the motor for a while.
struct TerminalDrive {
  TerminalValues voltage{};                       // V, constant; read where `conducting` only
  std::array<bool, terminal_count> conducting{};  // false: no current can flow there
  double leg_resistance = 0.0;                    // ohm in series with every terminal
};

// The shaft during that while: it turns with constant speed.
struct ShaftMotion {
  double angle = 0.0;  // rad, mechanical, at the beginning
  double speed = 0.0;  // rad/s
};

struct BrushedDcMotorConfig {
  double resistance = 1.0;        // ohm, terminal to terminal
  double inductance = 0.5e-3;     // H, terminal to terminal
  double torque_constant = 0.03;  // N m/A, and V s/rad
};

inline constexpr std::array brushed_dc_motor_fields{
    ModelField<BrushedDcMotorConfig>{"resistance", &BrushedDcMotorConfig::resistance, 1e-4, 1000.0, "ohm",
                                     "resistance between the terminals"},
    ModelField<BrushedDcMotorConfig>{"inductance", &BrushedDcMotorConfig::inductance, 1e-7, 1.0, "H",
                                     "inductance between the terminals"},
    ModelField<BrushedDcMotorConfig>{"torque_constant", &BrushedDcMotorConfig::torque_constant, 1e-5, 100.0,
                                     "N m/A", "torque constant"},
};

class BrushedDcMotor {
 public:
  // Throws std::invalid_argument.
  explicit BrushedDcMotor(const BrushedDcMotorConfig& config = {});

  // Unplugs the wire of a terminal, or puts it back. The current is zero at once: what was in the inductance
  // is lost in the arc.
  void set_open(std::size_t terminal, bool open);
  bool wired(std::size_t terminal) const { return terminal != terminal_a && !open_[terminal]; }

  // `duration` (s) > 0. Unless both terminals conduct, the current becomes and stays zero.
  void advance(const TerminalDrive& drive, const ShaftMotion& shaft, double duration);

  // Ends the currents of these terminals, as diodes do.
  void stop_currents(const std::array<bool, terminal_count>& stopped);

  double current() const { return current_; }  // A, into B
  TerminalValues currents() const { return {0.0, current_, -current_}; }
  TerminalValues mean_currents() const {
    return {0.0, mean_current_, -mean_current_};
  }                                                                     // of the last advance
  double torque() const { return config_.torque_constant * current_; }  // N m
  double mean_torque() const { return config_.torque_constant * mean_current_; }

  // V that the turning shaft induces at each terminal while no current flows, against their mean.
  TerminalValues induced(const ShaftMotion& shaft) const {
    const double half = 0.5 * config_.torque_constant * shaft.speed;
    return {0.0, half, -half};
  }
  double largest_induced(double speed) const {
    return config_.torque_constant * (speed < 0 ? -speed : speed);
  }
  double electrical_speed(double) const { return 0.0; }          // rad/s: nothing turns in its circuit
  double loop_inductance() const { return config_.inductance; }  // H, seen by the current of one terminal
  double cogging_torque(double) const { return 0.0; }

  // Energy in the inductance, J.
  double energy() const { return 0.5 * config_.inductance * current_ * current_; }
  const BrushedDcMotorConfig& config() const { return config_; }

 private:
  BrushedDcMotorConfig config_;
  std::array<bool, terminal_count> open_{};
  double current_ = 0.0;
  double mean_current_ = 0.0;

  double duration_ = 0.0;  // what the two factors below belong to
  double resistance_ = 0.0;
  double approach_ = 0.0;       // 1 - e^(-R h/L): share of the way to the final current at the end
  double mean_approach_ = 0.0;  // the mean of that share
};

}  // namespace kmax::simulation
