#pragma once
// A simulated motor on its power stage, driven as the firmware drives it: currents, supply and count are
// sampled at the tick, duties follow, rounded to the timer's ticks, and act from half a tick later. Converter
// steps, noise, offsets that are averaged while the bridge is off, dead time and supply sag are on.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "board/odrive_v3/description.hpp"
#include "host_tools/simulation/motor_drive.hpp"

namespace kmax::calibration::test {

inline constexpr double tick = 50e-6;
inline constexpr double two_pi = 2.0 * std::numbers::pi;
inline constexpr double leg_resistance = 2e-3;

struct BenchMotor {
  std::string name;
  simulation::MotorConfig motor;
  simulation::DeviceModel device;
  double counts_per_turn = 4000.0;
  double transmission = 0.01;  // m/rad
  double gain = 40.0;          // of the shunts' amplifiers
  double noise = 15e-6;        // V at their input: 30 mA
  double current = 1.0;        // A that calibration uses
  double supply = 24.0;
  double supply_resistance = 0.05;
  double supply_capacitance = 1e-3;

  bool brushed() const { return std::holds_alternative<simulation::BrushedDcMotorConfig>(motor); }
  const simulation::BrushedDcMotorConfig& dc() const {
    return std::get<simulation::BrushedDcMotorConfig>(motor);
  }
  const simulation::SynchronousMotorConfig& pmsm() const {
    return std::get<simulation::SynchronousMotorConfig>(motor);
  }
  // Of the circuit that the controller drives.
  double resistance() const {
    return brushed() ? dc().resistance + 2.0 * leg_resistance : pmsm().resistance + leg_resistance;
  }
  double inductance() const { return brushed() ? dc().inductance : pmsm().inductance_d; }
  // Of the supply: what lets the amplifiers settle.
  float modulation_limit() const {
    return board::odrive_v3::description
        .modulation_limit[static_cast<std::size_t>(std::lround(std::log2(gain / 10.0)))];
  }
  double torque_constant() const { return brushed() ? dc().torque_constant : pmsm().torque_constant; }
};

inline std::vector<BenchMotor> bench_motors() {
  using simulation::BrushedDcMotorConfig;
  using simulation::SynchronousMotorConfig;
  std::vector<BenchMotor> motors;
  motors.push_back({.name = "coreless 2 ohm",
                    .motor = BrushedDcMotorConfig{2.0, 0.1e-3, 0.0255},
                    .device = {0.06, 0.05, 0.08, 0.0},
                    .current = 1.5});
  motors.push_back({.name = "coreless 7 ohm",
                    .motor = BrushedDcMotorConfig{7.2, 0.5e-3, 0.046},
                    .device = {0.09, 0.1, 0.12, 0.0},
                    .counts_per_turn = 2000.0,
                    .current = 1.0});
  motors.push_back({.name = "gimbal 5.6 ohm",
                    .motor = SynchronousMotorConfig{5.6, 1.2e-3, 1.2e-3, 0.12, 7.0, 1.1, 0.001, 84.0},
                    .device = {0.12, 0.1, 0.15, 0.0},
                    .counts_per_turn = 8192.0,
                    .current = 1.0});
  motors.push_back({.name = "gimbal 11 ohm, salient",
                    .motor = SynchronousMotorConfig{11.0, 2.6e-3, 3.9e-3, 0.18, 11.0, -0.7, 0.0015, 132.0},
                    .device = {0.15, 0.1, 0.2, 0.0},
                    .counts_per_turn = 16384.0,
                    .current = 0.8});
  motors.push_back({.name = "drone",
                    .motor = SynchronousMotorConfig{0.05, 25e-6, 25e-6, 0.0106, 7.0, 2.3, 0.0018, 84.0},
                    .device = {0.10, 0.1, 0.15, 0.0},
                    .counts_per_turn = 8192.0,
                    .gain = 20.0,
                    .current = 8.0});
  return motors;
}

struct BenchSample {
  double current_b = 0.0, current_c = 0.0, supply = 0.0;
  double count = 0.0;
};

class MotorBench {
 public:
  MotorBench(const BenchMotor& motor, std::uint64_t seed, double start = 0.0)
      : motor_(motor),
        drive_({motor.motor,
                {.on_resistance = leg_resistance, .diode_drop = 0.8},
                {.gain = motor.gain, .noise = motor.noise, .offset_b = 0.006, .offset_c = -0.004},
                {.counts_per_turn = motor.counts_per_turn, .transmission = motor.transmission},
                seed},
               simulation::CoupledHandle(motor.device, {start, 0.0})),
        supply_({.voltage = motor.supply,
                 .resistance = motor.supply_resistance,
                 .capacitance = motor.supply_capacitance}) {
    command_.dead_time = 125e-9;
    constexpr int samples = 2000;
    for (int n = 0; n < samples; ++n) {
      zero_b_ += code(simulation::CurrentSensor::Channel::b) / samples;
      zero_c_ += code(simulation::CurrentSensor::Channel::c) / samples;
    }
  }

  const BenchMotor& motor() const { return motor_; }
  simulation::MotorDrive& drive() { return drive_; }
  double shaft_angle_of(double count) const { return count * two_pi / motor_.counts_per_turn; }

  BenchSample sample() {
    const double per_code = 3.3 / 4096.0 / (motor_.gain * 0.5e-3);
    return {(code(simulation::CurrentSensor::Channel::b) - zero_b_) * per_code,
            (code(simulation::CurrentSensor::Channel::c) - zero_c_) * per_code,
            std::floor(supply_.pin_voltage() / 3.3 * 4096.0) * 3.3 / 4096.0 * 11.0,
            static_cast<double>(drive_.encoder().edges())};
  }

  // Ends the tick; the duties act from its middle.
  void tick_with(double a, double b, double c) {
    simulation::InverterCommand next = command_;
    next.legs = {{{!motor_.brushed(), rounded(a)}, {true, rounded(b)}, {true, rounded(c)}}};
    advance();
    command_ = next;
    advance();
  }

  // Open-loop voltages, as the controllers' voltage() makes them.
  void tick_with_voltage(double volts, double supply) {
    const double share = 0.5 * volts / supply;
    tick_with(0.5, 0.5 + share, 0.5 - share);
  }
  void tick_with_vector(double d, double q, double angle, double supply) {
    const double alpha = (d * std::cos(angle) - q * std::sin(angle)) / supply;
    const double beta = (d * std::sin(angle) + q * std::cos(angle)) / supply;
    const double b = 0.5 * std::sqrt(3.0) * beta - 0.5 * alpha, c = -alpha - b;
    const double centre = 0.5 - 0.5 * (std::max({alpha, b, c}) + std::min({alpha, b, c}));
    tick_with(centre + alpha, centre + b, centre + c);
  }

 private:
  static double rounded(double duty) {
    constexpr double steps = board::odrive_v3::description.half_period_ticks;
    return std::floor(duty * steps + 0.5) / steps;
  }
  double code(simulation::CurrentSensor::Channel channel) {
    return std::floor(drive_.current_pin(channel) / 3.3 * 4096.0);
  }
  void advance() {
    drive_.advance(0.5 * tick, command_, supply_);
    supply_.advance(0.5 * tick);
  }

  BenchMotor motor_;
  simulation::MotorDrive drive_;
  simulation::Supply supply_;
  simulation::InverterCommand command_;
  double zero_b_ = 0.0, zero_c_ = 0.0;
};

struct VectorCurrent {
  double d = 0.0, q = 0.0;
};

inline VectorCurrent current_at(const BenchSample& sample, double angle) {
  const double alpha = -(sample.current_b + sample.current_c);
  const double beta = (sample.current_b - sample.current_c) / std::sqrt(3.0);
  return {alpha * std::cos(angle) + beta * std::sin(angle), beta * std::cos(angle) - alpha * std::sin(angle)};
}

}  // namespace kmax::calibration::test
