#pragma once

#include <cmath>
#include <numbers>

#include "control/field_oriented_controller.hpp"
#include "tests/control/dc_current_loop.hpp"
#include "tests/control/motor_winding.hpp"

namespace kmax::control::test {

inline TurnFraction fraction_of(double radians) {
  const double turns = radians / (2.0 * std::numbers::pi);
  return static_cast<TurnFraction>(std::llround((turns - std::floor(turns)) * 4294967296.0));
}

/// A synchronous motor under its controller.
template <typename Scalar>
struct FieldOrientedLoop {
  static constexpr std::int32_t pole_pairs = 7;
  using Controller = FieldOrientedController<Scalar>;

  FieldOrientedControllerConfig<Scalar> config;
  SynchronousMotor motor;
  double supply = 24.0;
  Controller controller;
  typename Controller::Coefficients c;
  typename Controller::Output out;

  FieldOrientedLoop(const SynchronousMotor& plant, double bandwidth_hertz, const Belief& belief = {})
      : motor(plant) {
    config.resistance = static_cast<Scalar>(plant.resistance * belief.resistance);
    config.inductance_d = static_cast<Scalar>(plant.inductance_d * belief.inductance);
    config.inductance_q = static_cast<Scalar>(plant.inductance_q * belief.inductance);
    config.torque_constant = static_cast<Scalar>(1.5 * pole_pairs * plant.flux * belief.torque_constant);
    config.pole_pairs = pole_pairs;
    config.bandwidth = static_cast<Scalar>(2.0 * std::numbers::pi * bandwidth_hertz);
    prepare();
  }
  void prepare() { c = Controller::prepare(config, static_cast<Scalar>(tick)); }

  typename Controller::Input input(double reference_d, double reference_q) const {
    const auto currents = motor.currents();
    return {.angle = fraction_of(motor.angle),
            .current_b = static_cast<Scalar>(currents.b),
            .current_c = static_cast<Scalar>(currents.c),
            .electrical_speed = static_cast<Scalar>(motor.electrical_speed),
            .reference_d = static_cast<Scalar>(reference_d),
            .reference_q = static_cast<Scalar>(reference_q),
            .supply = static_cast<Scalar>(supply)};
  }
  void run(double reference_d, double reference_q) {
    out = controller.update(c, input(reference_d, reference_q));
    motor.run(
        {static_cast<double>(out.duty_a), static_cast<double>(out.duty_b), static_cast<double>(out.duty_c)},
        supply);
  }
};

/// One axis of it, to be swept like a DC motor's loop: the currents that the motor settles at with no
/// reference are its zero.
struct AxisLoop {
  FieldOrientedLoop<double> loop;
  bool on_q = true;

  double run(double reference) {
    loop.run(on_q ? 0.0 : reference, on_q ? reference : 0.0);
    return on_q ? loop.motor.current_q : loop.motor.current_d;
  }
};

}  // namespace kmax::control::test
