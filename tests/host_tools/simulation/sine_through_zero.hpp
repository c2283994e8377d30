#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "control/dc_current_controller.hpp"
#include "control/field_oriented_controller.hpp"
#include "host_tools/simulation/brushed_dc_motor.hpp"
#include "host_tools/simulation/inverter.hpp"
#include "host_tools/simulation/synchronous_motor.hpp"

// A sine current through zero, controlled on the simulated inverter with its dead time: how much of it is not
// the sine. A DC motor stands still and follows a sine reference; a synchronous motor turns with a steady q
// current.
namespace kmax::simulation::test {

enum class DeadTimeShare { off, of_reference, of_measured };

struct SineThroughZero {
  double amplitude = 0.5;          // A
  double frequency = 50.0;         // Hz
  double bandwidth = 500.0;        // Hz, of the current loop
  double supply = 24.0;            // V
  double dead_time = 500e-9;       // s, of the inverter
  double assumed_dead_time = 0.0;  // s, what the compensation is told; 0: the inverter's
  double band = 0.0;               // A; 0: dead_time_band(), at least 5 mA
  double converter_step = 0.0;     // A; 0: currents are measured exactly
  DeadTimeShare share = DeadTimeShare::off;
};

struct Distortion {
  double fundamental = 0.0;  // A
  double harmonics = 0.0;    // of 2nd to 40th, as a share of the fundamental
  double largest = 0.0;      // A, the largest current of all
};

inline constexpr double sine_tick = 50e-6;

inline double converted(const SineThroughZero& run, double current) {
  return run.converter_step > 0.0 ? std::round(current / run.converter_step) * run.converter_step : current;
}

/// Of whole periods.
inline Distortion distortion_of(const std::vector<double>& currents, double frequency) {
  Distortion result;
  double square = 0.0;
  for (int harmonic = 1; harmonic <= 40; ++harmonic) {
    std::complex<double> sum = 0.0;
    for (std::size_t k = 0; k < currents.size(); ++k) {
      const double phase = 2.0 * std::numbers::pi * frequency * harmonic * sine_tick * static_cast<double>(k);
      sum += currents[k] * std::polar(1.0, -phase);
    }
    const double amplitude = 2.0 * std::abs(sum) / static_cast<double>(currents.size());
    if (harmonic == 1) {
      result.fundamental = amplitude;
    } else {
      square += amplitude * amplitude;
    }
  }
  result.harmonics = std::sqrt(square) / result.fundamental;
  for (const double current : currents) result.largest = std::fmax(result.largest, std::fabs(current));
  return result;
}

template <typename Motor>
SineThroughZero completed(SineThroughZero run, const Motor& motor) {
  if (run.assumed_dead_time == 0.0) run.assumed_dead_time = run.dead_time;
  if (run.band == 0.0)
    run.band = std::fmax(0.005, control::dead_time_band(run.supply, run.dead_time, motor.loop_inductance()));
  return run;
}

inline control::DeadTimeCompensation<float> measured_share(const SineThroughZero& run) {
  return run.share == DeadTimeShare::of_measured
             ? control::DeadTimeCompensation<float>::prepare(static_cast<float>(run.assumed_dead_time),
                                                             static_cast<float>(run.band), 20000.0F)
             : control::DeadTimeCompensation<float>{};
}

template <typename Config>
void set_dead_time(const SineThroughZero& run, Config& config) {
  config.bandwidth = static_cast<float>(2.0 * std::numbers::pi * run.bandwidth);
  config.modulation_limit = 0.88F;
  if (run.share != DeadTimeShare::of_reference) return;
  config.dead_time = static_cast<float>(run.assumed_dead_time);
  config.dead_time_current = static_cast<float>(run.band);
}

inline std::vector<double> currents_of(const SineThroughZero& asked,
                                       const BrushedDcMotorConfig& motor_config) {
  const Inverter inverter;
  BrushedDcMotor motor(motor_config);
  const SineThroughZero run = completed(asked, motor);
  control::DcCurrentControllerConfig<float> config;
  config.resistance = static_cast<float>(motor_config.resistance + 2.0 * inverter.config().on_resistance);
  config.inductance = static_cast<float>(motor_config.inductance);
  set_dead_time(run, config);
  const auto c = control::DcCurrentController<float>::prepare(config, static_cast<float>(sine_tick));
  const auto shares = measured_share(run);
  control::DcCurrentController<float> controller;
  InverterCommand active{.dead_time = run.dead_time};
  for (auto& leg : active.legs) leg = {true, 0.5};
  const int period = static_cast<int>(std::lround(1.0 / run.frequency / sine_tick));
  std::vector<double> currents;
  for (int k = 0; k < 14 * period; ++k) {
    const double reference = run.amplitude * std::sin(2.0 * std::numbers::pi * k / period);
    if (k >= 4 * period) currents.push_back(motor.current());
    const auto measured = static_cast<float>(converted(run, motor.current()));
    const auto out =
        controller.update(c, static_cast<float>(reference), measured, 0.0F, static_cast<float>(run.supply));
    const double extra = static_cast<double>(shares.of(measured));
    inverter.advance(motor, active, run.supply, {}, sine_tick / 2);
    active.legs[terminal_b].duty = static_cast<double>(out.duty_b) + extra;
    active.legs[terminal_c].duty = static_cast<double>(out.duty_c) - extra;
    inverter.advance(motor, active, run.supply, {}, sine_tick / 2);
  }
  return currents;
}

inline std::vector<double> currents_of(const SineThroughZero& asked,
                                       const SynchronousMotorConfig& motor_config) {
  const Inverter inverter;
  SynchronousMotor motor(motor_config);
  const SineThroughZero run = completed(asked, motor);
  control::FieldOrientedControllerConfig<float> config;
  config.resistance = static_cast<float>(motor_config.resistance + inverter.config().on_resistance);
  config.inductance_d = static_cast<float>(motor_config.inductance_d);
  config.inductance_q = static_cast<float>(motor_config.inductance_q);
  config.torque_constant = static_cast<float>(motor_config.torque_constant);
  config.pole_pairs = static_cast<std::int32_t>(motor_config.pole_pairs);
  set_dead_time(run, config);
  const auto c = control::FieldOrientedController<float>::prepare(config, static_cast<float>(sine_tick));
  const auto shares = measured_share(run);
  control::FieldOrientedController<float> controller;
  InverterCommand active{.dead_time = run.dead_time};
  for (auto& leg : active.legs) leg = {true, 0.5};
  const int period = static_cast<int>(std::lround(1.0 / run.frequency / sine_tick));
  ShaftMotion shaft{0.0, 2.0 * std::numbers::pi * run.frequency / motor_config.pole_pairs};
  std::vector<double> currents;
  for (int k = 0; k < 14 * period; ++k) {
    const TerminalValues i = motor.currents();
    if (k >= 4 * period) currents.push_back(i[terminal_a]);
    const auto b = static_cast<float>(converted(run, i[terminal_b]));
    const auto to_c = static_cast<float>(converted(run, i[terminal_c]));
    const double turns = motor.electrical_angle(shaft.angle) / (2.0 * std::numbers::pi);
    const auto out = controller.update(
        c, {.angle = static_cast<control::TurnFraction>((turns - std::floor(turns)) * 4294967295.0),
            .current_b = b,
            .current_c = to_c,
            .electrical_speed = static_cast<float>(motor.electrical_speed(shaft.speed)),
            .reference_d = 0.0F,
            .reference_q = static_cast<float>(run.amplitude),
            .supply = static_cast<float>(run.supply)});
    inverter.advance(motor, active, run.supply, shaft, sine_tick / 2);
    shaft.angle += shaft.speed * sine_tick / 2;
    active.legs[terminal_a].duty = static_cast<double>(out.duty_a + shares.of(-(b + to_c)));
    active.legs[terminal_b].duty = static_cast<double>(out.duty_b + shares.of(b));
    active.legs[terminal_c].duty = static_cast<double>(out.duty_c + shares.of(to_c));
    inverter.advance(motor, active, run.supply, shaft, sine_tick / 2);
    shaft.angle += shaft.speed * sine_tick / 2;
  }
  return currents;
}

template <typename MotorConfig>
Distortion distortion_of(const SineThroughZero& run, const MotorConfig& motor) {
  return distortion_of(currents_of(run, motor), run.frequency);
}

}  // namespace kmax::simulation::test
