#pragma once

#include <array>
#include <cmath>

// Motors as the current controllers see them, in double: the voltage of one tick is active from the middle of
// that tick to the middle of the next (the current is sampled in the middle of the PWM period, the duty taken
// over at its end).
namespace kmax::control::test {

inline constexpr double tick = 5e-5;  // s, 20 kHz

/// A resistance and an inductance in series with a back-EMF: solved exactly.
struct DcMotor {
  double resistance = 1.0;
  double inductance = 1e-3;
  double torque_constant = 0.0;
  double speed = 0.0;  // rad/s, given from outside
  double current = 0.0;
  double active_voltage = 0.0;

  /// From one sample to the next: half a tick of the old voltage, half a tick of `voltage`.
  void run(double voltage) {
    half(active_voltage);
    half(voltage);
    active_voltage = voltage;
  }

 private:
  void half(double voltage) {
    const double left = voltage - torque_constant * speed;
    if (resistance == 0.0) {
      current += left * tick / 2 / inductance;
      return;
    }
    const double kept = inductance > 0.0 ? std::exp(-resistance / inductance * tick / 2) : 0.0;
    current = kept * current + (1.0 - kept) * left / resistance;
  }
};

/// A synchronous motor turning at a given speed, solved in the rotor's frame in steps of a fortieth of a
/// tick.
struct SynchronousMotor {
  double resistance = 0.5;
  double inductance_d = 1e-3;
  double inductance_q = 1e-3;
  double flux = 0.01;             // Wb
  double electrical_speed = 0.0;  // rad/s
  double angle = 0.0;             // electrical, rad
  double current_d = 0.0;
  double current_q = 0.0;
  std::array<double, 3> active_duties = {0.5, 0.5, 0.5};

  struct Phases {
    double b;
    double c;
  };
  Phases currents() const {
    const double alpha = current_d * std::cos(angle) - current_q * std::sin(angle);
    const double beta = current_d * std::sin(angle) + current_q * std::cos(angle);
    return {-alpha / 2 + std::sqrt(3.0) / 2 * beta, -alpha / 2 - std::sqrt(3.0) / 2 * beta};
  }

  void run(const std::array<double, 3>& duties, double supply) {
    half(active_duties, supply);
    half(duties, supply);
    active_duties = duties;
  }

 private:
  void half(const std::array<double, 3>& duties, double supply) {
    const double alpha = (2 * duties[0] - duties[1] - duties[2]) / 3 * supply;
    const double beta = (duties[1] - duties[2]) / std::sqrt(3.0) * supply;
    constexpr int steps = 20;
    const double time = tick / 2 / steps;
    for (int i = 0; i < steps; ++i) {
      const double middle = angle + electrical_speed * time / 2;
      const double d = alpha * std::cos(middle) + beta * std::sin(middle);
      const double q = beta * std::cos(middle) - alpha * std::sin(middle);
      const auto slope = [&](double id, double iq) {
        return std::array<double, 2>{
            (d - resistance * id + electrical_speed * inductance_q * iq) / inductance_d,
            (q - resistance * iq - electrical_speed * (inductance_d * id + flux)) / inductance_q};
      };
      const auto first = slope(current_d, current_q);
      const auto second = slope(current_d + first[0] * time / 2, current_q + first[1] * time / 2);
      current_d += second[0] * time;
      current_q += second[1] * time;
      angle += electrical_speed * time;
    }
  }
};

}  // namespace kmax::control::test
