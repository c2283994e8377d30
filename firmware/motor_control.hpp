#pragma once

#include <array>
#include <cstdint>

#include "control/dc_current_controller.hpp"
#include "control/field_oriented_controller.hpp"
#include "control/motor_transmission.hpp"
#include "control/phase_watch.hpp"
#include "control/sine_cosine.hpp"
#include "firmware/fault.hpp"

namespace kmax::firmware {

enum class MotorKind : std::uint8_t { dc = 0, pmsm = 1 };

struct MotorControlConfig {
  MotorKind kind = MotorKind::dc;
  float transmission = 0.05f;     ///< m/rad
  float torque_constant = 0.05f;  ///< N m/A
  float resistance = 1.0f;   ///< ohm; between the terminals of a DC motor, of one phase of a synchronous one
  float inductance = 1e-3f;  ///< H, likewise
  std::int32_t pole_pairs = 7;
  float electrical_offset = 0.0f;  ///< rad, electrical angle at position zero
  std::uint32_t counts_per_turn = 8192;
  float current_limit = 5.0f;  ///< A
  float bandwidth = 3000.0f;   ///< rad/s
  float modulation_limit =
      0.88f;  ///< of the supply: leaves the low sides on for 6 % of the period, to be sampled
  float tick_rate = 20000.0f;  ///< Hz
};

/// A phase current beyond current.limit times this trips the axis.
inline constexpr float over_current_factor = 1.5f;

/// The motor's side of one axis in the tick: force to current reference, current to duty, and the watch over
/// the phases.
///
/// A brushed DC motor stands between legs B and C (both have current sensors), leg A stays off; positive
/// current flows out of B. A synchronous motor is driven with d current zero. Positive current makes force
/// along +x: how the motor is wired is the calibration's business (encoder.direction,
/// motor.electrical_offset).
///
/// Without measured currents (a board with an ideal force source, as on x86) only the reference is made.
class MotorControl {
 public:
  struct Coefficients {
    control::MotorTransmission<float>::Coefficients transmission{};
    control::DcCurrentController<float>::Coefficients dc{};
    control::FieldOrientedController<float>::Coefficients pmsm{};
    control::PhaseWatch<float>::Coefficients watch{};
    std::uint32_t angle_per_count = 0;  ///< electrical, 2^32 per turn
    std::uint32_t angle_offset = 0;
    float electrical_speed_per_velocity = 0.0f;  ///< rad/m
    float slow_speed = 0.0f;  ///< rad/s of the motor: with 8 V the back-EMF is then below half of it
    MotorKind kind = MotorKind::dc;
  };

  /// What the board measured in this tick.
  struct Measured {
    bool present = false;                      ///< false: no currents are measured, and none are controlled
    float supply_voltage = 0.0f;               ///< V
    float current_b = 0.0f, current_c = 0.0f;  ///< A, positive into the motor
  };

  struct Output {
    float current_reference = 0.0f;  ///< A, torque-making
    float current = 0.0f;            ///< A, measured
    float duty_a = 0.5f, duty_b = 0.5f, duty_c = 0.5f;
    bool saturated = false;  ///< by the supply or by current.limit: less force than asked for
    Fault fault = Fault::none;
    float fault_value = 0.0f;
  };

  /// Outside the interrupt.
  static Coefficients prepare(const MotorControlConfig& config);

  /// `force`: N at the handle. `position`: counts, low 32 bits, direction and offset applied. `velocity`: m/s
  /// of the handle. Not driving: no reference, controllers wound back, the measured current still told.
  void update(const Coefficients& c, const Measured& measured, float force, std::uint32_t position,
              float velocity, bool driving, Output& out);

 private:
  void drive_dc(const Coefficients& c, const Measured& measured, float speed, Output& out);
  void drive_pmsm(const Coefficients& c, const Measured& measured, std::uint32_t angle, float velocity,
                  Output& out);
  void judge(control::PhaseCondition condition, const Measured& measured, Output& out);

  control::DcCurrentController<float> dc_;
  control::FieldOrientedController<float> pmsm_;
  control::PhaseWatch<float> watch_;
};

// Here and not in a file of its own, so that the tick becomes one function without calls.

inline void MotorControl::update(const Coefficients& c, const Measured& measured, float force,
                                 std::uint32_t position, float velocity, bool driving, Output& out) {
  out.fault = Fault::none;
  if (!driving) {
    out = {};
    dc_.reset();
    pmsm_.reset();
    watch_.reset();
    if (measured.present && c.kind == MotorKind::dc)
      out.current = 0.5f * (measured.current_b - measured.current_c);
    return;
  }
  const auto wanted = control::MotorTransmission<float>::update(c.transmission, force);
  out.current_reference = wanted.current;
  out.saturated = wanted.limited;
  if (wanted.not_finite) out.fault = Fault::not_finite;
  if (!measured.present) return;
  if (c.kind == MotorKind::dc) {
    out.current = 0.5f * (measured.current_b - measured.current_c);
    drive_dc(c, measured, control::MotorTransmission<float>::motor_speed(c.transmission, velocity), out);
  } else {
    drive_pmsm(c, measured, position * c.angle_per_count + c.angle_offset, velocity, out);
  }
}

inline void MotorControl::drive_dc(const Coefficients& c, const Measured& measured, float speed,
                                   Output& out) {
  const auto made = dc_.update(c.dc, out.current_reference, out.current, speed, measured.supply_voltage);
  out.duty_b = made.duty_b;
  out.duty_c = made.duty_c;
  out.saturated = out.saturated || made.saturated;
  if (made.not_finite) out.fault = Fault::not_finite;
  const bool slow = speed < c.slow_speed && speed > -c.slow_speed;
  judge(watch_.update(c.watch, {0.0f, measured.current_b, measured.current_c},
                      {0.0f, out.current_reference, -out.current_reference}, slow),
        measured, out);
}

inline void MotorControl::drive_pmsm(const Coefficients& c, const Measured& measured, std::uint32_t angle,
                                     float velocity, Output& out) {
  control::FieldOrientedController<float>::Input in;
  in.angle = angle;
  in.current_b = measured.current_b;
  in.current_c = measured.current_c;
  in.electrical_speed = velocity * c.electrical_speed_per_velocity;
  in.reference_q = out.current_reference;
  in.supply = measured.supply_voltage;
  const auto made = pmsm_.update(c.pmsm, in);
  out.current = made.current_q;
  out.duty_a = made.duty_a;
  out.duty_b = made.duty_b;
  out.duty_c = made.duty_c;
  out.saturated = out.saturated || made.saturated;
  if (made.not_finite) out.fault = Fault::not_finite;
  // The reference in each phase, by inverse Park and Clarke with d = 0.
  const auto [sine, cosine] = control::sine_cosine<float>(angle);
  const float a = -(out.current_reference * sine);
  constexpr float half_root_three = 0.866025404f;
  const float beta = out.current_reference * cosine * half_root_three;
  const float b = beta - 0.5f * a;
  const float speed = control::MotorTransmission<float>::motor_speed(c.transmission, velocity);
  const bool slow = speed < c.slow_speed && speed > -c.slow_speed;
  judge(watch_.update(c.watch,
                      {-(measured.current_b + measured.current_c), measured.current_b, measured.current_c},
                      {a, b, -(a + b)}, slow),
        measured, out);
}

inline void MotorControl::judge(control::PhaseCondition condition, const Measured& measured, Output& out) {
  if (condition == control::PhaseCondition::good) return;
  const float b = measured.current_b < 0.0f ? -measured.current_b : measured.current_b;
  const float c = measured.current_c < 0.0f ? -measured.current_c : measured.current_c;
  out.fault = condition == control::PhaseCondition::open ? Fault::phase_open : Fault::over_current;
  out.fault_value = b > c ? b : c;
}

}  // namespace kmax::firmware
