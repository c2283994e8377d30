#include "firmware/motor_control.hpp"

#include "control/sine_cosine.hpp"

namespace kmax::firmware {

namespace {
/// A fraction of a turn from radians, wrapped. Outside the interrupt.
std::uint32_t turn_fraction(float radians) {
  const double turns = static_cast<double>(radians) / 6.283185307179586476925;
  const double fraction = turns - static_cast<double>(static_cast<std::int32_t>(turns));
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(fraction * 4294967296.0));
}
}  // namespace

MotorControl::Coefficients MotorControl::prepare(const MotorControlConfig& config) {
  const float period = 1.0f / config.tick_rate;
  Coefficients c;
  c.kind = config.kind;
  c.transmission = control::MotorTransmission<float>::prepare(
      {config.transmission, config.torque_constant, config.current_limit});
  control::DcCurrentControllerConfig<float> dc;
  dc.resistance = config.resistance;
  dc.inductance = config.inductance;
  dc.torque_constant = config.torque_constant;
  dc.bandwidth = config.bandwidth;
  dc.modulation_limit = config.modulation_limit;
  c.dc = control::DcCurrentController<float>::prepare(dc, period);
  control::FieldOrientedControllerConfig<float> pmsm;
  pmsm.resistance = config.resistance;
  pmsm.inductance_d = pmsm.inductance_q = config.inductance;
  pmsm.torque_constant = config.torque_constant;
  pmsm.pole_pairs = config.pole_pairs;
  pmsm.bandwidth = config.bandwidth;
  pmsm.modulation_limit = config.modulation_limit;
  c.pmsm = control::FieldOrientedController<float>::prepare(pmsm, period);
  control::PhaseWatchConfig<float> watch;
  watch.current_limit = config.current_limit;
  watch.over_current_factor = over_current_factor;
  watch.bandwidth = config.bandwidth;
  watch.rate = config.tick_rate;
  c.watch = control::PhaseWatch<float>::prepare(watch);
  // Rounded to the nearest: at 8 million counts from zero the error is a thousandth of a turn at most.
  c.angle_per_count = static_cast<std::uint32_t>(
      ((static_cast<std::uint64_t>(config.pole_pairs) << 32) + config.counts_per_turn / 2) /
      config.counts_per_turn);
  c.angle_offset = turn_fraction(config.electrical_offset);
  c.electrical_speed_per_velocity = static_cast<float>(config.pole_pairs) / config.transmission;
  c.slow_speed = 4.0f / config.torque_constant;
  return c;
}

}  // namespace kmax::firmware
