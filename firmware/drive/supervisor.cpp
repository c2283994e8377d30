#include "firmware/drive/supervisor.hpp"

#include "firmware/drive/axis_configuration.hpp"
#include "firmware/drive/stability_guard.hpp"
#include "firmware/modbus/rtu_timing.hpp"

namespace kmax::firmware {

namespace {
/// Why an axis cannot be armed while the board is in this condition.
Refusal refusal_for(Fault condition) {
  switch (condition) {
    case Fault::emergency_stop:
      return Refusal::emergency_stop;
    case Fault::gate_driver:
      return Refusal::gate_driver_fault;
    case Fault::under_voltage:
    case Fault::over_voltage:
      return Refusal::supply_out_of_range;
    case Fault::current_sense:
      return Refusal::current_sense_invalid;
    default:
      return Refusal::power_stage_not_ready;
  }
}

DriveMode mode_of(const ParameterValues& values, std::size_t axis) {
  return values.choice<DriveMode, "drive.mode">(axis);
}

float bound_of(Fault fault, const Supervisor::Situation& now, std::size_t axis) {
  const ParameterValues& values = now.values;
  switch (fault) {
    case Fault::over_speed:
      return values.real<"velocity.limit">(axis);
    case Fault::under_voltage:
      return values.real<"supply.voltage_min">();
    case Fault::over_voltage:
      return now.setting.supply.high();
    case Fault::over_current:
      return over_current_factor * values.real<"current.limit">(axis);
    case Fault::current_sum:
      return now.setting.motor.watch.unbalanced;
    case Fault::spin_out:
      return plausibility_configuration(values, axis).tolerance;
    case Fault::excitation_travel:
      return values.real<"excitation.travel">(axis);
    case Fault::unstable_wall:
      return values.real<"instability.force">(axis);
    default:
      return 0.0f;
  }
}

constexpr bool is_loss_of_commander(Fault fault) {
  return fault == Fault::link_silent || fault == Fault::bus_off || fault == Fault::heartbeat_lost;
}

// The power stage is off then in any case.
constexpr std::uint32_t longest_reaction = 2 * tick_rate_hz;
// The handle stands: for so long it has not been faster than this.
constexpr float standstill = 1e-3f;  // m/s
constexpr std::uint32_t standing = tick_rate_hz / 20;
}  // namespace

Refusal Supervisor::obstacle_to_arming(const Situation& now, const Readiness& readiness,
                                       std::size_t axis) const {
  if (readiness.store_busy) return Refusal::store_busy;  // an erase stops the tick
  if (readiness.restarting) return Refusal::restarting;
  if (readiness.absent) return Refusal::axis_absent;
  if (readiness.pushes_anothers_axis) return Refusal::other_commander;
  if (is_can(commander_) && now.links[Link::can].heartbeat_lost) return Refusal::heartbeat_missing;
  if (now.report.condition != Fault::none) return refusal_for(now.report.condition);
  if (now.thermal.power_stage_too_hot()) return Refusal::too_hot;
  if (now.thermal.motor_too_hot()) return Refusal::motor_too_hot;
  if (!now.report.count_valid) return Refusal::encoder_invalid;
  // Excitation begins without knowing anything of the rotor; what needs its angle is bounded in travel.
  if (mode_of(now.values, axis) == DriveMode::excitation) return Refusal::none;
  if (!readiness.commutation_known) return Refusal::commutation_unknown;
  if (readiness.guard_failed && now.values.choice<GuardMode, "guard.mode">(axis) == GuardMode::refuse)
    return Refusal::guard_refused;
  const auto& haptic = now.setting.haptic;
  const bool makes_force = mode_of(now.values, axis) == DriveMode::haptic &&
                           (haptic.wall.kind != control::WallKind::none ||
                            haptic.interference.mode != control::InterferenceMode::none);
  return makes_force && now.report.haptic.inside ? Refusal::handle_inside_wall : Refusal::none;
}

void Supervisor::trip(const Situation& now, std::size_t axis, Fault fault, float value, float bound) {
  machine_.trip(fault);
  if (machine_.fault() != fault || machine_.state() != DriveState::fault_reaction_active) return;
  if (is_loss_of_commander(fault)) begin_reaction(now, axis);
  // Counts were lost, and with them the rotor's angle.
  if (fault == Fault::encoder || fault == Fault::spin_out) now.commutation.forget(now.values, axis);
  const AxisReport& report = now.report;
  trip_ = {.record = report.trip,
           .value = value,
           .bound = bound,
           .power_stage_temperature = now.readings.power_stage_temperature[axis],
           .winding_temperature = now.thermal.winding_temperature()};
  if (report.trip.fault == fault && report.fault == fault) return;
  // Found here and not in the tick: as the last report says.
  trip_.record = {.position = Axis::position_of(report.counted, now.setting),
                  .tick = report.tick,
                  .velocity = report.haptic.velocity,
                  .force = report.force,
                  .current = report.motor.current,
                  .current_reference = report.motor.current_reference,
                  .supply = now.readings.supply_voltage,
                  .value = value,
                  .fault = fault};
}

void Supervisor::begin_reaction(const Situation& now, std::size_t axis) {
  const auto kind = now.values.choice<LinkLoss, "link.loss">();
  if (kind == LinkLoss::limp || mode_of(now.values, axis) == DriveMode::excitation) return;
  const float ramp = now.values.real<"force.ramp_time">(axis) * static_cast<float>(tick_rate_hz);
  reaction_ = Reaction{kind, now.report.tick, now.report.tick, ramp};
  go_on_with_reaction(now);
}

void Supervisor::go_on_with_reaction(const Situation& now) {
  Reaction& reaction = *reaction_;
  const std::uint32_t now_tick = now.report.tick, elapsed = now_tick - reaction.began;
  bool over =
      now.report.fault != Fault::none || now.readings.ticks_have_stopped || elapsed > longest_reaction;
  if (reaction.kind == LinkLoss::ramp) {
    const auto gone = static_cast<float>(elapsed);
    over = over || !(gone < reaction.ramp);
    reaction.share = over ? 0.0f : 1.0f - gone / reaction.ramp;
  } else {
    const float velocity = now.report.haptic.velocity;
    if (!(velocity < standstill && velocity > -standstill)) reaction.moved_last = now_tick;
    over = over || now_tick - reaction.moved_last > standing;
    reaction.share = Axis::Command::brakes;
  }
  if (over) reaction_.reset();
}

void Supervisor::watch(const Situation& now, std::size_t axis) {
  const ParameterValues& values = now.values;
  const AxisReport& report = now.report;
  if (report.fault != Fault::none)
    trip(now, axis, report.fault, report.fault_value, bound_of(report.fault, now, axis));
  if (now.thermal.power_stage_too_hot())
    trip(now, axis, Fault::over_temperature, now.readings.power_stage_temperature[axis],
         values.real<"temperature.limit">(axis));
  if (now.thermal.motor_too_hot())
    trip(now, axis, Fault::motor_too_hot, now.thermal.winding_temperature(),
         values.real<"temperature.motor_limit">(axis));
  if (now.readings.ticks_have_stopped) trip(now, axis, Fault::tick_missed, 0.0f, 0.0f);
  const float timeout = values.real<"link.timeout">();
  const auto heard_us = number_ != 0 ? std::optional(signed_us_) : now.links[commander_].heard_us;
  if (timeout > 0.0f && heard_us) {
    const auto silent_us = static_cast<float>(modbus::elapsed_us(now.now_us, *heard_us));
    if (silent_us > timeout * 1e6f) trip(now, axis, Fault::link_silent, silent_us * 1e-6f, timeout);
  }
  if (is_can(commander_) && now.links[Link::can].is_off && !now.links[commander_].heard_over_usb[axis])
    trip(now, axis, Fault::bus_off, 0.0f, 0.0f);
}

bool Supervisor::cause_remains(const Situation& now) const {
  switch (machine_.fault()) {
    case Fault::none:
      return false;
    case Fault::encoder:
      if (!now.report.count_valid) return true;
      break;
    case Fault::over_temperature:
      if (now.thermal.power_stage_too_hot()) return true;
      break;
    case Fault::tick_missed:
      if (now.readings.ticks_have_stopped) return true;
      break;
    case Fault::motor_too_hot:
      if (now.thermal.motor_too_hot()) return true;
      break;
    case Fault::heartbeat_lost:
      if (now.links[Link::can].heartbeat_lost) return true;
      break;
    default:
      break;
  }
  return machine_.fault() == now.report.condition;
}

void Supervisor::obey(const Situation& now, const Readiness& readiness, std::size_t axis) {
  const auto [word, by] = *waiting_;
  if (!asks_for_operation(word)) reaction_.reset();
  const bool arms = machine_.asks_to_enable(word, by);
  if (arms && !readiness.settled) return;
  const bool stays = now.values.whole<"profile.quick_stop_option">(axis) == 6;
  halted_ = halted(word) || (halted_ && makes_force() && (by != commander_ || reaction_));
  machine_.command(word, by, obstacle_to_arming(now, readiness, axis), cause_remains(now),
                   {.stay_in_quick_stop = stays});
  waiting_.reset();
  if (arms) claimed_ = true;
}

/// The next commander's number is another.
void Supervisor::give_back(ParameterValues& values, std::size_t axis) {
  claimed_ = false;
  number_ = 0;
  set_next_number(commander_, 0);
  values.set_whole<"drive.commander">(0, axis);
}

}  // namespace kmax::firmware
