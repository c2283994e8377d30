#include "firmware/drive/axis.hpp"

#include <bit>
#include <cstddef>
#include <cstring>
#include <type_traits>

namespace kmax::firmware {

namespace {

std::uint32_t low_word(std::int64_t count) {
  return static_cast<std::uint32_t>(count);
}

/// What was summed between two looks at the motion, times this, is the mean of a tick.
constexpr float per_look_tick = 1.0f / static_cast<float>(Axis::motion_look);

/// An assignment would go around the padding byte by byte; this copies whole words.
[[gnu::always_inline]] inline void copy_words(void* to, const void* from, std::size_t size) {
  std::memcpy(__builtin_assume_aligned(to, alignof(std::uint32_t)),
              __builtin_assume_aligned(from, alignof(std::uint32_t)), size);
}

/// Validity, condition and reference, in the order of the state's bytes.
std::uint32_t first_word_of_flags(const Axis::Input& input) {
  static_assert(offsetof(Axis::Input, count_valid) == 4 && offsetof(Axis::Input, condition) == 5 &&
                offsetof(Axis::Input, referenced) == 6);
  std::uint32_t word = 0;
  std::memcpy(&word, reinterpret_cast<const std::byte*>(&input) + offsetof(Axis::Input, count_valid),
              sizeof word);
  return word;
}

/// value < 0, by its bits.
constexpr bool is_negative(float value) {
  return std::bit_cast<std::int32_t>(value) < 0;
}

/// value > 0, by its bits: shorter than a comparison of floats.
constexpr bool is_positive(float value) {
  return std::bit_cast<std::int32_t>(value) > 0;
}

}  // namespace

// Flattened: the calls between its parts cost a tenth of the tick.
[[gnu::flatten]] const Axis::Output& Axis::ISR_tick(const AxisSetting& setting, const Input& input,
                                                    const Command& command, std::uint32_t tick) {
  const bool enable = command.enable;
  if (!enable) [[unlikely]]
    trip_ = Fault::none;
  tick_ = tick;
  if (generation_ != setting.generation) [[unlikely]] {
    generation_ = setting.generation;
    start_afresh();
  }
  std::uint32_t state = first_word_of_flags(input);
  if ((state & count_valid_bit) != 0) [[likely]] {
    if (reference_generation_ != input.reference_generation) [[unlikely]]
      take_reference(input, enable);
    extender_.update(input.count);
  }
  const std::int64_t position = position_of(extender_.count(), setting);
  if (input.motor.present && !setting.supply.contains(input.motor.supply_voltage)) [[unlikely]]
    state = with_supply_fault(state, setting, input);
  state |= (enable ? enabled_bit : 0U) | trip_bits(trip_);
  const bool sound = (state & ~referenced_bit) == (enabled_bit | count_valid_bit);
  const bool brakes = is_negative(command.share);
  const bool by_force = sound && setting.mode != DriveMode::excitation && !brakes;
  if (setting.mode == DriveMode::torque) [[unlikely]] {
    loop_.follow(setting.haptic, position, by_force, command.from_host);
  } else {
    loop_.tick(setting.haptic, position, by_force, command.from_axes);
  }
  if (by_force && loop_.output().fault == control::HapticFault::none) [[likely]] {
    output_.enabled = drive(setting, input, low_word(position), command.share);
  } else {
    output_.enabled = excite_or_release(setting, input, state, brakes);
  }
  if (!output_.enabled) [[unlikely]]
    state |= trip_bits(trip_);
  changes_ = state ^ state_;
  if (changes_ != 0) [[unlikely]]
    take_change(state);
  if (loop_.output().limited) [[unlikely]] {
    if (loop_.output().new_sample) ++limited_samples_;
  }
  return output_;
}

/// What the last tick has changed. Samples are counted while the axis is enabled, the one that armed it
/// included.
void Axis::take_change(std::uint32_t state) {
  const bool enabled = (state & enabled_bit) != 0;
  if ((changes_ & enabled_bit) != 0) {
    const std::uint32_t samples = loop_.samples();
    if (enabled) {
      limited_samples_ = 0;
      armed_from_ = loop_.output().new_sample ? samples - 1 : samples;
      loop_.forget_alarms();
    } else {
      armed_samples_ = (loop_.output().new_sample ? samples - 1 : samples) - armed_from_;
    }
  }
  state_ = state;
}

/// As after power-up, for the estimators and for what the main loop has heard.
void Axis::start_afresh() {
  // In step with the ticks: of a loop that computes in each of them FOAW takes the even ones, and what is
  // slow lies in odd ones.
  const std::uint32_t counted = loop_.samples();
  loop_.reset(tick_ - 1);
  armed_from_ += loop_.samples() - counted;
  plausibility_.reset();
  looked_from_ = low_word(extender_.count());
  state_ |= unreported_bit;
}

/// The counts mean something else from now on.
void Axis::take_reference(const Input& input, bool enable) {
  // A force that jumps with the position must never be.
  if (reference_generation_ != no_reference && enable && trip_ == Fault::none)
    trip(Fault::encoder, 0.0f, loop_.output().position, input);
  // What the counter held before its first valid count means nothing, and neither does the jump to it.
  extender_.reset(input.count);
  start_afresh();
  reference_generation_ = input.reference_generation;
}

/// What the board has found comes first.
std::uint32_t Axis::with_supply_fault(std::uint32_t status, const AxisSetting& setting, const Input& input) {
  if (condition_in(status) != Fault::none) return status;
  const bool over = setting.supply.is_below(input.motor.supply_voltage);
  return status | static_cast<std::uint32_t>(over ? Fault::over_voltage : Fault::under_voltage)
                      << condition_shift;
}

namespace {
/// m along +x. A trip's value: what a handle moves in a tick is far within 32 bits.
float travel_of(const AxisSetting& setting, std::int64_t moved) {
  const auto counts = static_cast<float>(static_cast<std::int32_t>(moved));
  return (setting.encoder_direction < 0 ? -counts : counts) * setting.excitation.count_length;
}
}  // namespace

/// Where it is enabled and has not tripped yet.
void Axis::find_trips(const AxisSetting& setting, const Input& input, Fault condition) {
  const std::int64_t here = position_of(extender_.count(), setting);
  const auto& out = loop_.output();
  if (condition != Fault::none) {
    const bool of_supply = condition == Fault::under_voltage || condition == Fault::over_voltage;
    trip(condition, of_supply ? input.motor.supply_voltage : 0.0f, here, input);
  } else if (!input.count_valid) {
    trip(Fault::encoder, 0.0f, here, input);
  } else if (out.fault == control::HapticFault::not_finite) {
    trip(Fault::not_finite, out.velocity, here, input);
  } else if (out.fault == control::HapticFault::over_speed) {
    trip(Fault::over_speed, out.velocity, here, input);
  } else if (out.fault == control::HapticFault::unstable) {
    trip(Fault::unstable_wall, loop_.detector().last_alarm().force, here, input);
  } else if (setting.mode == DriveMode::excitation) {
    const std::int64_t moved = extender_.count() - armed_at_;
    if (static_cast<std::uint64_t>(moved < 0 ? -moved : moved) > setting.excitation.travel_counts)
      trip(Fault::excitation_travel, travel_of(setting, moved), here, input);
  }
}

/// From the loop's force to duty. False: it has tripped, and there is neither.
bool Axis::drive(const AxisSetting& setting, const Input& input, std::uint32_t position, float share) {
  const auto& out = loop_.output();
  float force = out.force;
  if (is_positive(setting.compensation.limit)) [[unlikely]]
    force = compensated(setting, position);
  force = share * force;
  output_.force = force;
  motor_.update(setting.motor, input.motor, force, position, out.velocity, true, tick_, output_.motor);
  if (output_.motor.fault != Fault::none) [[unlikely]]
    return trip_in_drive(output_.motor.fault, output_.motor.fault_value, setting, input);
  forces_made_ += output_.motor.force_made;
  if (!looks_at_motion(tick_)) return true;
  const float velocity = velocity_since_look(setting), forces = forces_made_;
  forces_made_ = 0.0f;
  // A force source without a power stage commutates nothing that could run away.
  if (!setting.watch_motion || !input.motor.present) return true;
  if (plausibility_.update(setting.plausibility, per_look_tick * forces, velocity)) [[unlikely]]
    return trip_in_drive(Fault::spin_out, -plausibility_.reserve(setting.plausibility), setting, input);
  return true;
}

/// The plain difference of counts: the watch over the motion smooths by itself, and a velocity that lags
/// behind the force, as the haptic loop's estimate does, would look like unexplained energy.
float Axis::velocity_since_look(const AxisSetting& setting) {
  const std::uint32_t here = low_word(extender_.count());
  const std::uint32_t moved = (here - looked_from_) * static_cast<std::uint32_t>(setting.encoder_direction);
  looked_from_ = here;
  return static_cast<float>(static_cast<std::int32_t>(moved)) *
         (per_look_tick * setting.haptic.velocity_per_count);
}

/// Excitation, braking, a trip, or nothing at all. True: the axis is driven.
bool Axis::excite_or_release(const AxisSetting& setting, const Input& input, std::uint32_t state,
                             bool brakes) {
  const bool enable = (state & enabled_bit) != 0;
  if (looks_at_motion(tick_)) plausibility_.follow(setting.plausibility, velocity_since_look(setting));
  forces_made_ = 0.0f;
  if (enable && (state_ & enabled_bit) == 0) {
    armed_at_ = extender_.count();
    excitation_.stand_by(setting.excitation);
  }
  if (enable && trip_ == Fault::none) {
    find_trips(setting, input, condition_in(state));
    if (trip_ == Fault::none) {
      output_.force =
          brakes ? motor_.brake(setting.motor, input.motor, tick_, output_.motor) : excite(setting, input);
      return output_.motor.fault == Fault::none ||
             trip_in_drive(output_.motor.fault, output_.motor.fault_value, setting, input);
    }
  }
  output_.force = 0.0f;
  excitation_.stand_by(setting.excitation);
  motor_.update(setting.motor, input.motor, 0.0f, 0, 0.0f, false, tick_, output_.motor);
  return false;
}

/// What was measured stays to be seen; duty and force must never reach the bridge. Always false.
bool Axis::trip_in_drive(Fault fault, float value, const AxisSetting& setting, const Input& input) {
  trip(fault, value, position_of(extender_.count(), setting), input);
  output_.motor.duty_a = output_.motor.duty_b = output_.motor.duty_c = 0.5f;
  output_.force = 0.0f;
  return false;
}

float Axis::excite(const AxisSetting& setting, const Input& input) {
  const std::int64_t position = position_of(extender_.count(), setting);
  const float velocity = loop_.output().velocity;
  Excitation::Output asked = excitation_.update(setting.excitation, position, velocity);
  const bool blind = setting.motor.kind == MotorKind::pmsm && !setting.commutated;
  if (blind && (asked.kind == ExcitationKind::torque || asked.kind == ExcitationKind::position)) {
    // No current, in the stator's frame. What would begin in the midst of a run when the angle is found is
    // over.
    excitation_.end();
    asked = {};
    asked.finished = true;
  }
  return motor_.excite(setting.motor, input.motor, asked, low_word(position), velocity, tick_, output_.motor);
}

/// The loop's force with what makes the handle lighter, which comes with the soft start like the loop's does;
/// the sum keeps to the same limit.
float Axis::compensated(const AxisSetting& setting, std::uint32_t position) const {
  const auto& out = loop_.output();
  const float added = control::ForceCompensation<float>::update(
      setting.compensation, position * setting.motor.shaft_angle_per_count, out.velocity);
  return control::clamp_magnitude(out.force + loop_.ramp() * added, setting.haptic.force.limit);
}

void Axis::trip(Fault fault, float value, std::int64_t position, const Input& input) {
  trip_ = fault;
  record_.position = position;
  record_.tick = tick_;
  record_.velocity = loop_.output().velocity;
  record_.force = output_.force;
  record_.current = output_.motor.current;
  record_.current_reference = output_.motor.current_reference;
  record_.supply = input.motor.supply_voltage;
  record_.value = value;
  record_.fault = fault;
}

void Axis::ISR_fill(AxisReport& report) const {
  const control::HapticLoop<float>::Output& haptic = loop_.output();
  const MotorControl::Report& motor = output_.motor;
  static_assert(std::is_trivially_copyable_v<control::HapticLoop<float>::Output>);
  static_assert(std::is_trivially_copyable_v<MotorControl::Report> && sizeof motor == 20);
  copy_words(&report.haptic, &haptic, sizeof haptic);
  copy_words(&report.motor, &motor, sizeof motor);
  report.counted = extender_.count();
  report.tick = tick_;
  report.generation = generation_;
  report.reference_generation = reference_generation_;
  report.armed_samples = (state_ & enabled_bit) != 0 ? loop_.samples() - armed_from_ : armed_samples_;
  report.limited_samples = limited_samples_;
  report.force = output_.force;
  report.fault = trip_;
  report.condition = condition_in(state_);
  report.enabled = (state_ & enabled_bit) != 0;
  report.count_valid = (state_ & count_valid_bit) != 0;
  report.referenced = (state_ & referenced_bit) != 0;
  report.alarms = loop_.detector().alarms();
  report.softening = loop_.softening();
  if (report.alarms != 0) [[unlikely]]
    report.last_alarm = loop_.detector().last_alarm();
  if (trip_ != Fault::none) [[unlikely]] {
    report.trip = record_;
    report.fault_value = record_.value;
  }
}

}  // namespace kmax::firmware
