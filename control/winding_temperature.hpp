#pragma once

#include <limits>

#include "control/current_loop_gains.hpp"
#include "control/finite.hpp"

namespace kmax::control {

/// Relative change of copper's resistance per kelvin, referred to 20 .. 25 degC (IEC 60028: 0.00393 at 20
/// degC).
template <typename Scalar>
inline constexpr Scalar copper_temperature_coefficient = static_cast<Scalar>(0.00393);

/// Defaults: a motor of some 50 mm diameter and 200 g that hangs on a device's frame.
template <typename Scalar>
struct WindingTemperatureConfig {
  Scalar resistance = Scalar(1);              ///< ohm at reference_temperature, > 0
  Scalar reference_temperature = Scalar(25);  ///< degC
  /// Heat is loss_factor x resistance x mean square current. 1: a DC motor, terminal to terminal. 1.5: a
  /// synchronous motor, one phase's resistance with the amplitude of the phase currents (the dq vector).
  Scalar loss_factor = Scalar(1);
  Scalar winding_capacity = Scalar(15);     ///< J/K, > 0
  Scalar winding_to_case = Scalar(3);       ///< K/W, > 0
  Scalar case_capacity = Scalar(150);       ///< J/K, > 0
  Scalar case_to_ambient = Scalar(8);       ///< K/W, > 0
  Scalar ambient_temperature = Scalar(25);  ///< degC
};

/// Temperature of a motor's winding from its current, where no sensor is: two heat capacities in a row.
///
///   C_w dT_w/dt = q R(T_w) i^2 - (T_w - T_c)/R_wc          R(T) = R_ref (1 + 0.00393 (T - T_ref))
///   C_c dT_c/dt = (T_w - T_c)/R_wc - (T_c - T_a)/R_ca
///
/// While the mean square current i^2 is constant these are linear with constant coefficients, x' = A x + b;
/// both eigenvalues are real and different, as heat flows between the two both ways. update() takes the exact
/// step x += f(A) (A x + b), f(l) = (e^(l dt) - 1)/l, by Sylvester's formula for two eigenvalues: right for
/// any dt, a millisecond or an hour. What is added is added with a carried remainder (Kahan), so that steps
/// far below a float's last place at 100 degC are not lost.
///
/// Above a current where copper's rising resistance heats faster than the case cools (i^2 q R_ref 0.00393
/// (R_wc + R_ca) > 1) there is no steady state: the model runs away as the motor would, up to 1000 degC,
/// where it stops.
///
/// Not in it: iron losses, friction, heat from a power stage that shares the case. reset() must say how warm
/// the motor is; after a power cycle that is a guess.
///
/// A duration or current that is not finite or negative changes nothing and gives a NaN (thermal_derating()
/// then gives 0), and so does a mean square beyond 1e15 A2; coefficients that cannot be (a capacity of 0)
/// always do. Main loop: about 400 Cortex-M4F instructions, 21 divisions and a square root among them; no
/// libm.
template <typename Scalar>
class WindingTemperature {
 public:
  static constexpr Scalar highest = Scalar(1000);  ///< degC

  struct Coefficients {
    Scalar resistance{};             ///< ohm at the reference temperature
    Scalar reference_temperature{};  ///< degC
    Scalar ambient_temperature{};    ///< degC
    Scalar loss_factor{};
    Scalar per_winding_capacity{};  ///< K/J
    Scalar per_case_capacity{};     ///< K/J
    Scalar winding_to_case{};       ///< W/K, a conductance
    Scalar case_to_ambient{};       ///< W/K, a conductance
  };

  static constexpr Coefficients prepare(const WindingTemperatureConfig<Scalar>& config) {
    Coefficients c;
    c.resistance = config.resistance;
    c.reference_temperature = config.reference_temperature;
    c.ambient_temperature = config.ambient_temperature;
    c.loss_factor = config.loss_factor;
    c.per_winding_capacity = Scalar(1) / config.winding_capacity;
    c.per_case_capacity = Scalar(1) / config.case_capacity;
    c.winding_to_case = Scalar(1) / config.winding_to_case;
    c.case_to_ambient = Scalar(1) / config.case_to_ambient;
    return c;
  }

  /// Winding and case are this warm, degC.
  void reset(Scalar temperature) { reset(temperature, temperature); }
  void reset(Scalar winding, Scalar motor_case) {
    winding_ = {winding, Scalar(0)};
    case_ = {motor_case, Scalar(0)};
  }

  /// The current had this mean square (A^2) for `duration` (s). Gives the winding's temperature, degC.
  Scalar update(const Coefficients& c, Scalar duration, Scalar mean_square_current) {
    constexpr Scalar not_a_number = std::numeric_limits<Scalar>::quiet_NaN();
    if (!(duration >= Scalar(0) && mean_square_current >= Scalar(0)) ||
        !is_finite(duration + mean_square_current)) {
      return not_a_number;
    }
    const Scalar heat = c.loss_factor * c.resistance * mean_square_current;  // W at the reference temperature
    const Scalar feedback = heat * copper_temperature_coefficient<Scalar>;   // W/K
    const Scalar flow = c.winding_to_case * (winding_.value - case_.value);
    const Scalar winding_rate =
        (heat + feedback * (winding_.value - c.reference_temperature) - flow) * c.per_winding_capacity;
    const Scalar case_rate =
        (flow - c.case_to_ambient * (case_.value - c.ambient_temperature)) * c.per_case_capacity;

    const Scalar a11 = (feedback - c.winding_to_case) * c.per_winding_capacity;
    const Scalar a12 = c.winding_to_case * c.per_winding_capacity;
    const Scalar a21 = c.winding_to_case * c.per_case_capacity;
    const Scalar a22 = -(c.winding_to_case + c.case_to_ambient) * c.per_case_capacity;
    const Scalar middle = Scalar(0.5) * (a11 + a22);
    const Scalar half_difference = Scalar(0.5) * (a11 - a22);
    const Scalar spread = square_root(half_difference * half_difference + a12 * a21);
    // The determinant without a cancellation; the smaller eigenvalue from it.
    const Scalar determinant =
        (c.winding_to_case * c.case_to_ambient - feedback * (c.winding_to_case + c.case_to_ambient)) *
        c.per_winding_capacity * c.per_case_capacity;
    const Scalar larger = middle > Scalar(0) ? middle + spread : middle - spread;
    const Scalar smaller = determinant / larger;

    // A - larger, each element without a cancellation: the two on the diagonal have the product a12 a21.
    // Taken from the slow eigenvalue instead, or as differences, a winding 10,000 times faster than its case
    // would end up 0.1 K off after an hour in one step.
    const Scalar away = middle > Scalar(0) ? -spread : spread;
    const Scalar sum = away + half_difference, difference = away - half_difference;
    const bool same_sign = (away < Scalar(0)) == (half_difference < Scalar(0));
    const Scalar a11_off = same_sign ? sum : a12 * a21 / difference;
    const Scalar a22_off = same_sign ? a12 * a21 / sum : difference;

    const Scalar f = integrated(larger, duration);
    const Scalar slope = (f - integrated(smaller, duration)) / (larger - smaller);
    const Scalar winding_step = f * winding_rate + slope * (a11_off * winding_rate + a12 * case_rate);
    const Scalar case_step = f * case_rate + slope * (a21 * winding_rate + a22_off * case_rate);
    if (!is_finite(larger) || !(spread > Scalar(0))) return not_a_number;
    if (!is_finite(winding_step) || !is_finite(case_step)) {
      // So far off that the numbers end: only a runaway gets there.
      reset(highest);
      return highest;
    }
    winding_.add(winding_step);
    case_.add(case_step);
    return winding_.value;
  }

  Scalar winding() const { return winding_.value; }  ///< degC
  Scalar motor_case() const { return case_.value; }  ///< degC

 private:
  struct Sum {
    Scalar value = Scalar(25);
    Scalar carried = Scalar(0);
    void add(Scalar step) {
      const Scalar wanted = step + carried;
      const Scalar sum = value + wanted;
      if (!(sum < highest)) {
        *this = {highest, Scalar(0)};
        return;
      }
      carried = wanted - (sum - value);
      value = sum;
    }
  };

  static float square_root(float value) { return __builtin_sqrtf(value); }
  static double square_root(double value) { return __builtin_sqrt(value); }

  /// (e^(rate x duration) - 1) / rate, s.
  static constexpr Scalar integrated(Scalar rate, Scalar duration) {
    const Scalar x = rate * duration;
    if (x == Scalar(0)) return duration;
    const Scalar fallen = one_minus_exponential(magnitude(x));
    return (x < Scalar(0) ? -fallen : fallen / (Scalar(1) - fallen)) / rate;
  }

  Sum winding_;
  Sum case_;
};

}  // namespace kmax::control
