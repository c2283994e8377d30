// The rare parts of the motor's tick: excitation, and what is reported of a fault. The usual one is inline in
// the header.
#include "firmware/drive/motor_control.hpp"

namespace kmax::firmware {

namespace {

/// The part of `along` and `across` that is within the limit, `along` first. True: something was taken away.
bool bound(float limit, float& along, float& across) {
  const float first = control::clamp_magnitude(along, limit);
  const float rest = limit * limit - first * first;
  const float second = control::clamp_magnitude(across, rest > 0.0f ? __builtin_sqrtf(rest) : 0.0f);
  const bool bounded = first != along || second != across;
  along = first;
  across = second;
  return bounded;
}

}  // namespace

// Kept out of the tick's one function: it is for identification, and would take its registers.
[[gnu::noinline]] float MotorControl::excite(const Coefficients& c, const Measured& measured,
                                             const Excitation::Output& asked, std::uint32_t position,
                                             float velocity, std::uint32_t tick, Output& out) {
  using Transmission = control::MotorTransmission<float>;
  if (excited_ != asked.kind) {
    // What the integrators hold belongs to another frame, or to nothing.
    excited_ = asked.kind;
    dc_.reset();
    pmsm_.reset();
    watch_.reset();
  }
  out.excitation_started = asked.started;
  out.excitation_finished = asked.finished;
  out.current_d = out.voltage_d = 0.0f;
  if (asked.kind == ExcitationKind::position) {
    follow_force<By::identification>(c, measured, asked.force, position, velocity, tick, out);
    return Transmission::force(c.transmission, out.current_reference);
  }
  const bool by_voltage = asked.kind == ExcitationKind::voltage;
  out.fault = Fault::none;
  out.saturated = false;
  float along = by_voltage ? 0.0f : asked.along;
  float none_across = 0.0f;
  out.saturated = bound(c.transmission.current_limit, along, none_across);
  out.current_reference = along;
  const bool of_rotor = c.kind == MotorKind::dc || asked.kind == ExcitationKind::torque;
  const float force = of_rotor ? Transmission::force(c.transmission, along) : 0.0f;
  if (!measured.present) {
    out.force_made = force;
    return force;
  }
  const std::uint32_t rotor_angle = position * c.angle_per_count + c.angle_offset;
  const auto condition = c.kind == MotorKind::dc ? excite_dc(c, measured, asked, velocity, tick, out)
                         : of_rotor ? drive_pmsm<By::identification>(c, measured, rotor_angle, velocity,
                                                                     !asked.alternating, tick, out)
                                    : excite_stator(c, measured, asked, rotor_angle, velocity, tick, out);
  if (condition != control::PhaseCondition::good) report_fault(condition, c, measured, out);
  return force;
}

control::PhaseCondition MotorControl::excite_dc(const Coefficients& c, const Measured& measured,
                                                const Excitation::Output& asked, float velocity,
                                                std::uint32_t tick, Output& out) {
  if (asked.kind != ExcitationKind::voltage) {
    return drive_dc(c, measured, velocity, !asked.alternating, tick, out);
  }
  out.current = 0.5f * (measured.current_b - measured.current_c);
  take(Dc::voltage(c.dc, asked.along, measured.supply_voltage), out);
  settle(
      c, out.current, tick, [&out] { return out.current * out.current; }, out);
  const Phases phases = of_dc(measured);
  if (Watch::over_current(c.watch, phases)) return control::PhaseCondition::over_current;
  return looks_at_phases(tick) ? watch_.update(c.watch, phases, {}, false) : control::PhaseCondition::good;
}

MotorControl::FieldOriented::Output MotorControl::identify_pmsm(const Coefficients& c,
                                                                const FieldOriented::Input& in) {
  return pmsm_.update(c.pmsm, in);
}

control::PhaseCondition MotorControl::excite_stator(const Coefficients& c, const Measured& measured,
                                                    const Excitation::Output& asked,
                                                    std::uint32_t rotor_angle, float velocity,
                                                    std::uint32_t tick, Output& out) {
  const bool by_voltage = asked.kind == ExcitationKind::voltage;
  FieldOriented::Input in;
  in.angle = asked.angle;
  in.current_b = measured.current_b;
  in.current_c = measured.current_c;
  in.electrical_speed = asked.electrical_speed;
  in.supply = measured.supply_voltage;
  if (!by_voltage) {
    in.reference_d = asked.along;
    in.reference_q = asked.across;
    if (bound(c.transmission.current_limit, in.reference_d, in.reference_q)) out.saturated = true;
  }
  const auto made =
      by_voltage ? FieldOriented::voltage(c.pmsm, in, asked.along, asked.across) : identify_pmsm(c, in);
  take(made, out);
  out.current = made.current_d;
  out.current_d = made.current_q;
  out.voltage = made.voltage_d;
  out.voltage_d = made.voltage_q;
  out.electrical_angle = asked.angle;
  const bool steady = !by_voltage && !asked.alternating;
  // What the vector makes along the rotor's q axis, as far as the rotor's angle is known.
  const auto [sine, cosine] = control::sine_cosine<float>(asked.angle - rotor_angle);
  settle(
      c, made.current_d * sine + made.current_q * cosine, tick,
      [&made] { return made.current_d * made.current_d + made.current_q * made.current_q; }, out);
  const Phases phases = of_pmsm(measured);
  if (Watch::over_current(c.watch, phases)) return control::PhaseCondition::over_current;
  if (!looks_at_phases(tick)) return control::PhaseCondition::good;
  return watch_.update<control::PhaseSum::implied>(c.watch, phases, FieldOriented::phase_references(in),
                                                   steady && control::magnitude(velocity) < c.slow_velocity);
}

void MotorControl::report_fault(control::PhaseCondition condition, const Coefficients& c,
                                const Measured& measured, Output& out) {
  const Phases phases = c.kind == MotorKind::dc ? of_dc(measured) : of_pmsm(measured);
  const float of_a = control::magnitude(phases.a), of_b = control::magnitude(phases.b);
  const float of_c = control::magnitude(phases.c);
  const float most = of_a > of_b ? of_a : of_b;
  out.fault_value = most > of_c ? most : of_c;
  // A current that is not finite would stay in the low-pass for ever. It is over-current, so it comes by
  // here.
  if (!control::is_finite(current_square_))
    out.current_square = current_square_ = c.watch.over_current * c.watch.over_current;
  switch (condition) {
    case control::PhaseCondition::open:
      out.fault = Fault::phase_open;
      break;
    case control::PhaseCondition::sum:
      out.fault = Fault::current_sum;
      out.fault_value = control::magnitude(phases.a + phases.b + phases.c);
      break;
    default:
      out.fault = Fault::over_current;
  }
}

}  // namespace kmax::firmware
