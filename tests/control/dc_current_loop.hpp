#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "control/dc_current_controller.hpp"
#include "tests/control/motor_winding.hpp"

namespace kmax::control::test {

/// What the controller is told, as a multiple of what the motor is.
struct Belief {
  double resistance = 1.0;
  double inductance = 1.0;
  double torque_constant = 1.0;
};

/// A DC motor under its controller.
template <typename Scalar>
struct DcLoop {
  DcCurrentControllerConfig<Scalar> config;
  DcMotor motor;
  double supply = 24.0;
  DcCurrentController<Scalar> controller;
  typename DcCurrentController<Scalar>::Coefficients c;
  typename DcCurrentController<Scalar>::Output out;

  DcLoop(const DcMotor& plant, double bandwidth_hertz, const Belief& belief = {}) : motor(plant) {
    config.resistance = static_cast<Scalar>(plant.resistance * belief.resistance);
    config.inductance = static_cast<Scalar>(plant.inductance * belief.inductance);
    config.torque_constant = static_cast<Scalar>(plant.torque_constant * belief.torque_constant);
    config.bandwidth = static_cast<Scalar>(2.0 * std::numbers::pi * bandwidth_hertz);
    prepare();
  }
  void prepare() { c = DcCurrentController<Scalar>::prepare(config, static_cast<Scalar>(tick)); }

  double run(double reference) {
    out = controller.update(c, static_cast<Scalar>(reference), static_cast<Scalar>(motor.current),
                            static_cast<Scalar>(motor.speed), static_cast<Scalar>(supply));
    motor.run(static_cast<double>(out.duty_b - out.duty_c) * supply);
    return motor.current;
  }
};

/// How far a step from rest goes beyond its end, as a share of it.
template <typename Loop>
double overshoot_of(Loop loop, double step, int ticks = 2000) {
  double highest = 0.0;
  for (int k = 0; k < ticks; ++k) highest = std::max(highest, loop.run(step) / step);
  return highest - 1.0;
}

/// Gain of the closed loop from reference to sampled current, by correlation over whole periods.
template <typename Loop>
double gain_of(Loop loop, double hertz) {
  constexpr double amplitude = 0.1;
  const int settle = static_cast<int>(std::max(400.0, 3.0 / (hertz * tick)));
  const int periods = std::max(2, static_cast<int>(0.02 * hertz));
  const int length = static_cast<int>(std::lround(periods / hertz / tick));
  const double turn = 2.0 * std::numbers::pi * periods / length;  // whole periods to the last tick
  std::complex<double> in = 0.0;
  std::complex<double> out = 0.0;
  double current = 0.0;
  for (int k = 0; k < settle + length; ++k) {
    const double reference = amplitude * std::cos(turn * k);
    if (k >= settle) {
      in += reference * std::polar(1.0, -turn * k);
      out += current * std::polar(1.0, -turn * k);
    }
    current = loop.run(reference);
  }
  return std::abs(out / in);
}

/// The -3 dB frequency: a sweep upwards finds the first one below, halving the interval the rest.
template <typename Loop>
double bandwidth_of(const Loop& loop, double from = 50.0, double to = 9000.0) {
  const double edge = std::sqrt(0.5);
  double below = from;
  while (below < to && gain_of(loop, below * 1.1) > edge) below *= 1.1;
  double above = below * 1.1;
  for (int step = 0; step < 6; ++step) {
    const double middle = std::sqrt(below * above);
    (gain_of(loop, middle) > edge ? below : above) = middle;
  }
  return std::sqrt(below * above);
}

}  // namespace kmax::control::test
