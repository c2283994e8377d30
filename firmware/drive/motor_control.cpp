#include "firmware/drive/motor_control.hpp"

#include "control/current_loop_gains.hpp"
#include "control/winding_temperature.hpp"

namespace kmax::firmware {

namespace {

/// A fraction of a turn from radians, wrapped. Outside the interrupt.
std::uint32_t turn_fraction(float radians) {
  const double turns = static_cast<double>(radians) / 6.283185307179586476925;
  const double fraction = turns - static_cast<double>(static_cast<std::int32_t>(turns));
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(fraction * 4294967296.0));
}

/// Rounded to the nearest: at 8 million counts from zero the error is a thousandth of a turn at most.
std::uint32_t turn_fraction_per_count(std::int32_t turns, std::uint32_t counts) {
  return static_cast<std::uint32_t>(((static_cast<std::uint64_t>(turns) << 32) + counts / 2) / counts);
}

/// What the winding has at its present temperature; a temperature that is not a number is none to go by.
float warm_resistance(const MotorControlConfig& config) {
  const float warmer = config.winding_temperature - config.reference_temperature;
  if (!control::is_finite(warmer)) return config.resistance;
  const float factor = 1.0f + control::copper_temperature_coefficient<float> * warmer;
  return factor > 0.0f ? config.resistance * factor : 0.0f;
}

}  // namespace

MotorControl::Coefficients MotorControl::prepare(const MotorControlConfig& config) {
  const float period = 1.0f / config.tick_rate;
  const float resistance = warm_resistance(config);
  Coefficients c;
  c.kind = config.kind;
  // A share that is not a number would let everything pass.
  const float share = config.current_share >= 0.0f ? control::bounded_share(config.current_share) : 0.0f;
  c.transmission = control::MotorTransmission<float>::prepare(
      {config.transmission, config.torque_constant, config.current_limit * share});
  control::DcCurrentControllerConfig<float> dc;
  dc.resistance = resistance;
  dc.inductance = config.inductance;
  dc.torque_constant = config.torque_constant;
  dc.bandwidth = config.bandwidth;
  dc.modulation_limit = config.modulation_limit;
  dc.dead_time = config.dead_time;
  dc.dead_time_current = config.dead_time_current;
  dc.pwm_frequency = config.tick_rate;
  c.dc = control::DcCurrentController<float>::prepare(dc, period);
  control::FieldOrientedControllerConfig<float> pmsm;
  pmsm.resistance = resistance;
  pmsm.inductance_d = config.inductance;
  pmsm.inductance_q = config.inductance_q > 0.0f ? config.inductance_q : config.inductance;
  pmsm.torque_constant = config.torque_constant;
  pmsm.pole_pairs = config.pole_pairs;
  pmsm.bandwidth = config.bandwidth;
  pmsm.modulation_limit = config.modulation_limit;
  pmsm.dead_time = config.dead_time;
  pmsm.dead_time_current = config.dead_time_current;
  pmsm.pwm_frequency = config.tick_rate;
  c.pmsm = control::FieldOrientedController<float>::prepare(pmsm, period);
  control::PhaseWatchConfig<float> watch;
  watch.current_limit = config.current_limit;
  watch.over_current_factor = over_current_factor;
  watch.bandwidth = config.bandwidth;
  watch.rate = config.tick_rate / static_cast<float>(phase_look);
  c.watch = control::PhaseWatch<float>::prepare(watch);
  c.angle_per_count = turn_fraction_per_count(config.pole_pairs, config.counts_per_turn);
  c.angle_offset = turn_fraction(config.electrical_offset);
  c.shaft_angle_per_count = turn_fraction_per_count(1, config.counts_per_turn);
  c.electrical_speed_per_velocity = static_cast<float>(config.pole_pairs) / config.transmission;
  c.slow_velocity = control::magnitude(4.0f / config.torque_constant * config.transmission);
  c.current_square_step =
      control::one_minus_exponential(static_cast<float>(square_look) * period / current_square_time);
  return c;
}

}  // namespace kmax::firmware
