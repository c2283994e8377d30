#pragma once

#include <cstdint>

#include "control/dc_current_controller.hpp"
#include "control/field_oriented_controller.hpp"
#include "control/finite.hpp"
#include "control/motor_transmission.hpp"
#include "control/phase_watch.hpp"
#include "control/sine_cosine.hpp"
#include "firmware/drive/excitation.hpp"
#include "firmware/drive/fault.hpp"

namespace kmax::firmware {

enum class MotorKind : std::uint8_t { dc = 0, pmsm = 1 };

struct MotorControlConfig {
  MotorKind kind = MotorKind::dc;
  float transmission = 0.05f;     ///< m/rad
  float torque_constant = 0.05f;  ///< N m/A
  /// ohm at reference_temperature; between the terminals of a DC motor, of one phase of a synchronous one
  float resistance = 1.0f;
  float winding_temperature = 25.0f;    ///< degC, now: the controllers work with the resistance it makes
  float reference_temperature = 25.0f;  ///< degC
  float inductance = 1e-3f;             ///< H, likewise; of the d axis of a synchronous motor
  float inductance_q = 0.0f;            ///< H; 0: as inductance
  std::int32_t pole_pairs = 7;
  float electrical_offset = 0.0f;  ///< rad, electrical angle at position zero
  std::uint32_t counts_per_turn = 8192;
  float current_limit = 5.0f;      ///< A
  float current_share = 1.0f;      ///< 0 .. 1 of current_limit that may be asked for: thermal derating
  float bandwidth = 3000.0f;       ///< rad/s
  float modulation_limit = 0.0f;   ///< of the supply; a fact of the board: until it says so, no voltage
  float dead_time = 0.0f;          ///< s of the bridge that is made up for; 0: not
  float dead_time_current = 0.1f;  ///< A, within it that goes smoothly through zero
  float tick_rate = 20000.0f;      ///< Hz, also of the PWM
};

/// A phase current beyond current.limit times this trips the axis.
inline constexpr float over_current_factor = 1.5f;

/// Time constant of the low-pass behind MotorControl::Output::current_square.
inline constexpr float current_square_time = 0.01f;  // s

/// The motor's side of one axis in the tick: force to current reference, current to duty, and the watch over
/// the phases.
///
/// A brushed DC motor stands between legs B and C (both have current sensors), leg A stays off; positive
/// current flows out of B. A synchronous motor is driven with d current zero. Positive current makes force
/// along +x: how the motor is wired is the calibration's business (encoder.direction,
/// motor.electrical_offset).
///
/// Without measured currents (a board with an ideal force source, as on x86) only the reference is made.
///
/// Excitation (excitation.hpp) takes the force's place for identification. Its kinds voltage and current, and
/// `off`, which is a current of zero, hold for a synchronous motor in the excitation's own frame: nothing
/// needs to be known about rotor or encoder. References stay within the current limit, `along` first.
/// The phases are watched as ever for over-current and for what leaks. An open phase is reported where the
/// current is steered by references that it can follow: with a voltage nobody knows yet what current should
/// flow, and a square wave may be faster than the loop; there it is for the identification to find.
class MotorControl {
 public:
  struct Coefficients {
    control::MotorTransmission<float>::Coefficients transmission{};
    control::DcCurrentController<float>::Coefficients dc{};
    control::FieldOrientedController<float>::Coefficients pmsm{};
    control::PhaseWatch<float>::Coefficients watch{};
    std::uint32_t angle_per_count = 0;  ///< electrical, 2^32 per turn
    std::uint32_t angle_offset = 0;
    std::uint32_t shaft_angle_per_count = 0;     ///< 2^32 per turn of the shaft
    float electrical_speed_per_velocity = 0.0f;  ///< rad/m
    float slow_velocity = 0.0f;        ///< m/s of the handle: with 8 V the back-EMF is then below half of it
    float current_square_step = 0.0f;  ///< per look
    MotorKind kind = MotorKind::dc;
  };

  /// What the board measured in this tick.
  struct Measured {
    bool present = false;                      ///< false: no currents are measured, and none are controlled
    float supply_voltage = 0.0f;               ///< V
    float current_b = 0.0f, current_c = 0.0f;  ///< A, positive into the motor
  };

  /// Of this tick: currents as sampled, voltages as asked of the bridge after their limits (active half a
  /// tick later). The frame is the rotor's; with the excitation's kinds voltage and current its own, where
  /// `current` and `voltage` are along and `_d` across.
  ///
  /// The part that the main loop gets, in whole words so that it is copied fast.
  struct Report {
    float current_reference = 0.0f;    ///< A, torque-making (along)
    float current = 0.0f;              ///< A, measured, torque-making (along)
    float force_made = 0.0f;           ///< N at the handle that the measured current makes
    float current_square = 0.0f;       ///< A^2, of both components, low-passed over current_square_time
    bool saturated = false;            ///< by the supply or by current.limit: less than asked for
    bool excitation_started = false;   ///< this is the first tick of a run
    bool excitation_finished = false;  ///< see Excitation::Output
    Fault fault = Fault::none;
  };
  struct Output : Report {
    float current_d = 0.0f;                      ///< A, measured, the other component; 0 for a DC motor
    float voltage = 0.0f;                        ///< V, like current
    float voltage_d = 0.0f;                      ///< V, like current_d
    control::TurnFraction electrical_angle = 0;  ///< of the frame; 0 for a DC motor
    float duty_a = 0.5f, duty_b = 0.5f, duty_c = 0.5f;
    float fault_value = 0.0f;
  };

  /// Outside the interrupt.
  static Coefficients prepare(const MotorControlConfig& config);

  /// `force`: N at the handle. `position`: counts, low 32 bits, direction and offset applied. `velocity`: m/s
  /// of the handle. Not driving: no reference, controllers wound back, the measured current still reported.
  /// `tick`: its number, by which what is slow takes turns: phases that are open or leak are looked for in
  /// one of phase_look ticks, and the square of the current is taken in one of square_look.
  void update(const Coefficients& c, const Measured& measured, float force, std::uint32_t position,
              float velocity, bool driving, std::uint32_t tick, Output& out);
  static constexpr std::uint32_t phase_look = 4, square_look = 8;  ///< powers of two

  /// Instead of update(), in a tick in which an excited axis is driven. Gives the force asked for, N at the
  /// handle, as far as it is known: 0 for a voltage, and for a current in the stator's frame.
  /// Instead of update(): no voltage between the phases, so that the bridge shorts the motor. Its back-EMF
  /// then drives a current that brakes it, with torque_constant^2 / resistance per shaft speed: passive
  /// whatever the encoder says, and without a joule from or to the supply. What the winding makes of that is
  /// watched for over-current as ever. Gives 0: no force is asked for. Without measured currents nothing
  /// brakes.
  [[gnu::cold]] float brake(const Coefficients& c, const Measured& measured, std::uint32_t tick,
                            Output& out) {
    Excitation::Output shorted{};
    shorted.kind = ExcitationKind::voltage;
    return excite(c, measured, shorted, 0, 0.0f, tick, out);
  }

  [[gnu::cold]] float excite(const Coefficients& c, const Measured& measured, const Excitation::Output& asked,
                             std::uint32_t position, float velocity, std::uint32_t tick, Output& out);

 private:
  using FieldOriented = control::FieldOrientedController<float>;
  using Dc = control::DcCurrentController<float>;
  using Phases = control::PhaseCurrents<float>;
  using Watch = control::PhaseWatch<float>;

  static Phases of_dc(const Measured& measured) { return {0.0f, measured.current_b, measured.current_c}; }
  static Phases of_pmsm(const Measured& measured) {
    return {-(measured.current_b + measured.current_c), measured.current_b, measured.current_c};
  }

  /// Who follows a force or drives the motor: the tick, in whose one function all is inline, or
  /// identification, whose kinds share the current controller's code.
  enum class By : std::uint8_t { tick, identification };
  template <By by>
  void follow_force(const Coefficients& c, const Measured& measured, float force, std::uint32_t position,
                    float velocity, std::uint32_t tick, Output& out);
  control::PhaseCondition drive_dc(const Coefficients& c, const Measured& measured, float velocity,
                                   bool steady, std::uint32_t tick, Output& out);
  template <By by>
  control::PhaseCondition drive_pmsm(const Coefficients& c, const Measured& measured, std::uint32_t angle,
                                     float velocity, bool steady, std::uint32_t tick, Output& out);
  control::PhaseCondition excite_dc(const Coefficients& c, const Measured& measured,
                                    const Excitation::Output& asked, float velocity, std::uint32_t tick,
                                    Output& out);
  [[gnu::cold, gnu::noinline]] FieldOriented::Output identify_pmsm(const Coefficients& c,
                                                                   const FieldOriented::Input& in);
  // For identification only: small code rather than fast code.
  [[gnu::cold, gnu::noinline]] control::PhaseCondition excite_stator(
      const Coefficients& c, const Measured& measured, const Excitation::Output& asked,
      std::uint32_t rotor_angle, float velocity, std::uint32_t tick, Output& out);
  static void take(const Dc::Output& made, Output& out);
  static void take(const FieldOriented::Output& made, Output& out);
  [[gnu::noinline, gnu::cold]] void report_fault(control::PhaseCondition condition, const Coefficients& c,
                                                 const Measured& measured, Output& out);
  /// Ticks 2 and 7 of eight, in which there is neither a report nor a look at the motion. Not a whole number
  /// of quarters of eight apart: of a current that alternates in step with the looks, both would find the
  /// zero on its way to the other side.
  static constexpr bool looks_at_phases(std::uint32_t tick) { return tick % 8 == 2 || tick % 8 == 7; }
  /// Not always the same tick of eight: a current that alternates from tick to tick would be seen at one of
  /// its values alone. Over 64 ticks each of the eight has its turn.
  static constexpr bool looks_at_square(std::uint32_t tick) {
    return (tick ^ tick / square_look) % square_look == 0;
  }
  /// `squares`: gives A^2 of both components, asked for where it is taken.
  template <typename Squares>
  void settle(const Coefficients& c, float torque_current, std::uint32_t tick, Squares&& squares,
              Output& out);

  control::DcCurrentController<float> dc_;
  control::FieldOrientedController<float> pmsm_;
  Watch watch_;
  float current_square_ = 0.0f;
  ExcitationKind excited_ = ExcitationKind::off;
};

// Here and not in a file of its own, so that the tick becomes one function without calls.

inline void MotorControl::update(const Coefficients& c, const Measured& measured, float force,
                                 std::uint32_t position, float velocity, bool driving, std::uint32_t tick,
                                 Output& out) {
  if (!driving) {
    out = {};
    dc_.reset();
    pmsm_.reset();
    watch_.reset();
    excited_ = ExcitationKind::off;
    settle(
        c, 0.0f, tick, [] { return 0.0f; }, out);
    if (measured.present && c.kind == MotorKind::dc)
      out.current = 0.5f * (measured.current_b - measured.current_c);
    return;
  }
  follow_force<By::tick>(c, measured, force, position, velocity, tick, out);
}

template <MotorControl::By by>
inline void MotorControl::follow_force(const Coefficients& c, const Measured& measured, float force,
                                       std::uint32_t position, float velocity, std::uint32_t tick,
                                       Output& out) {
  const auto wanted = control::MotorTransmission<float>::update(c.transmission, force);
  out.current_reference = wanted.current;
  out.saturated = wanted.limited;
  out.fault = wanted.not_finite ? Fault::not_finite : Fault::none;
  if (!measured.present) {
    out.force_made = wanted.force;
    return;
  }
  const auto condition = c.kind == MotorKind::dc
                             ? drive_dc(c, measured, velocity, true, tick, out)
                             : drive_pmsm<by>(c, measured, position * c.angle_per_count + c.angle_offset,
                                              velocity, true, tick, out);
  if (condition != control::PhaseCondition::good) [[unlikely]]
    report_fault(condition, c, measured, out);
}

/// `steady`: the reference is one that the current can follow.
inline control::PhaseCondition MotorControl::drive_dc(const Coefficients& c, const Measured& measured,
                                                      float velocity, bool steady, std::uint32_t tick,
                                                      Output& out) {
  out.current = 0.5f * (measured.current_b - measured.current_c);
  const float speed = control::MotorTransmission<float>::motor_speed(c.transmission, velocity);
  take(dc_.update(c.dc, out.current_reference, out.current, speed, measured.supply_voltage), out);
  settle(
      c, out.current, tick, [&out] { return out.current * out.current; }, out);
  const Phases phases = of_dc(measured);
  if (Watch::over_current(c.watch, phases)) [[unlikely]]
    return control::PhaseCondition::over_current;
  if (!looks_at_phases(tick)) return control::PhaseCondition::good;
  const float expected = steady ? out.current_reference : 0.0f;
  return watch_.update(c.watch, phases, {0.0f, expected, -expected},
                       control::magnitude(velocity) < c.slow_velocity);
}

template <MotorControl::By by>
inline control::PhaseCondition MotorControl::drive_pmsm(const Coefficients& c, const Measured& measured,
                                                        std::uint32_t angle, float velocity, bool steady,
                                                        std::uint32_t tick, Output& out) {
  FieldOriented::Input in;
  in.angle = angle;
  in.current_b = measured.current_b;
  in.current_c = measured.current_c;
  in.electrical_speed = velocity * c.electrical_speed_per_velocity;
  in.reference_q = out.current_reference;
  in.supply = measured.supply_voltage;
  const auto made = by == By::tick ? pmsm_.update(c.pmsm, in) : identify_pmsm(c, in);
  take(made, out);
  out.current = made.current_q;
  out.current_d = made.current_d;
  out.voltage = made.voltage_q;
  out.voltage_d = made.voltage_d;
  out.electrical_angle = angle;
  settle(
      c, made.current_q, tick,
      [&made] { return made.current_q * made.current_q + made.current_d * made.current_d; }, out);
  const Phases phases = of_pmsm(measured);
  if (Watch::over_current(c.watch, phases)) [[unlikely]]
    return control::PhaseCondition::over_current;
  if (!looks_at_phases(tick)) return control::PhaseCondition::good;
  return watch_.update<control::PhaseSum::implied>(c.watch, phases, FieldOriented::phase_references(in),
                                                   steady && control::magnitude(velocity) < c.slow_velocity);
}

inline void MotorControl::take(const Dc::Output& made, Output& out) {
  out.voltage = made.voltage;
  out.duty_b = made.duty_b;
  out.duty_c = made.duty_c;
  if (made.saturated) out.saturated = true;
  if (made.not_finite) out.fault = Fault::not_finite;
}

inline void MotorControl::take(const FieldOriented::Output& made, Output& out) {
  out.duty_a = made.duty_a;
  out.duty_b = made.duty_b;
  out.duty_c = made.duty_c;
  if (made.saturated) out.saturated = true;
  if (made.not_finite) out.fault = Fault::not_finite;
}

template <typename Squares>
inline void MotorControl::settle(const Coefficients& c, float torque_current, std::uint32_t tick,
                                 Squares&& squares, Output& out) {
  if (looks_at_square(tick)) current_square_ += c.current_square_step * (squares() - current_square_);
  out.current_square = current_square_;
  out.force_made = control::MotorTransmission<float>::force(c.transmission, torque_current);
}

}  // namespace kmax::firmware
