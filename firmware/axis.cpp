#include "firmware/axis.hpp"

namespace kmax::firmware {

// Flattened: the calls between its parts cost a tenth of the tick.
[[gnu::flatten]] const Axis::Output& Axis::ISR_tick(const AxisSetting& setting, const Input& input,
                                                    bool enable, float external_force, std::uint32_t tick) {
  if (!enable) trip_ = Fault::none;
  if (input.count_valid && !started_) {
    // What the counter held before its first valid count means nothing, and neither does the jump to it.
    extender_.reset(input.count);
    loop_.reset();
    started_ = true;
  }
  if (input.count_valid) counted_ = extender_.update(input.count);
  bool changed = false;
  if (generation_ != setting.generation) {
    generation_ = setting.generation;
    loop_.reset();
    changed = true;
  }
  Fault condition = input.condition;
  if (condition == Fault::none && input.motor.present) {
    if (!(input.motor.supply_voltage >= setting.supply_voltage_min)) condition = Fault::under_voltage;
    if (!(input.motor.supply_voltage <= setting.supply_voltage_max)) condition = Fault::over_voltage;
  }
  const bool was_enabled = enable && trip_ == Fault::none;
  const std::int64_t position = position_of(counted_, setting);
  const auto& out = loop_.tick(setting.haptic, position, was_enabled && input.count_valid, external_force);
  if (was_enabled) {
    if (condition != Fault::none) {
      const bool of_supply = condition == Fault::under_voltage || condition == Fault::over_voltage;
      trip(condition, of_supply ? input.motor.supply_voltage : 0.0f);
    } else if (!input.count_valid) {
      trip(Fault::encoder, 0.0f);
    } else if (out.not_finite) {
      trip(Fault::not_finite, out.velocity);
    } else if (out.over_speed) {
      trip(Fault::over_speed, out.velocity);
    }
  }
  bool driving = was_enabled && trip_ == Fault::none;
  motor_.update(setting.motor, input.motor, out.force, static_cast<std::uint32_t>(position), out.velocity,
                driving, output_.motor);
  if (driving && output_.motor.fault != Fault::none) {
    trip(output_.motor.fault, output_.motor.fault_value);
    output_.motor.duty_a = output_.motor.duty_b = output_.motor.duty_c = 0.5f;
    driving = false;
  }
  count_samples(out, enable);
  tick_ = tick;
  const std::uint32_t state = state_word(trip_, condition, enable, input.count_valid);
  changed_ = changed || state != state_;
  state_ = state;

  output_.enabled = driving;
  output_.force = driving ? out.force : 0.0f;
  output_.tangential_force = driving ? out.tangential_force : 0.0f;
  output_.background_force = driving ? out.magnetic_force : 0.0f;
  return output_;
}

void Axis::ISR_fill(AxisReport& report) const {
  report.haptic = loop_.output();
  report.motor = output_.motor;
  report.counted = counted_;
  report.tick = tick_;
  report.generation = generation_;
  report.armed_samples = armed_samples_;
  report.limited_samples = limited_samples_;
  report.fault = trip_;
  report.condition = static_cast<Fault>(state_ >> 8 & 0xFFU);
  report.fault_value = trip_value_;
  report.enabled = (state_ & enabled_bit) != 0;
  report.count_valid = (state_ & count_valid_bit) != 0;
}

void Axis::count_samples(const control::HapticLoop<float>::Output& out, bool enable) {
  if (!enable) {
    was_counting_ = false;
    return;
  }
  if (!was_counting_) {
    armed_samples_ = limited_samples_ = 0;
    was_counting_ = true;
  }
  if (!out.new_sample) return;
  ++armed_samples_;
  if (out.limited) ++limited_samples_;
}

}  // namespace kmax::firmware
