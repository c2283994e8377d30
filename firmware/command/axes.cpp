#include "firmware/command/axes.hpp"

#include <algorithm>

#include "firmware/drive/axis_configuration.hpp"
#include "firmware/drive/cyclic_torque.hpp"

namespace kmax::firmware {

Axes::Axes(ParameterAccess& parameters, const StoreCommands& store, const LinkStates& links, FaultLog& log,
           std::span<std::uint32_t> capture_memory)
    : parameters_(parameters),
      store_(store),
      links_(links),
      log_(log),
      settings_(parameters.values()),
      tick_(settings_.all(), capture_memory),
      situations_(situations(std::make_index_sequence<axis_count>{})) {
  configure_thermal();
}

ArmedAxes Axes::armed() const {
  ArmedAxes armed;
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    armed.axis[axis] = supervisors_[axis].makes_force();
    armed.commander[axis] = supervisors_[axis].commander();
    armed.fades[axis] = armed.axis[axis] && !supervisors_[axis].armed();
  }
  return armed;
}

void Axes::offer_settings_if_changed() {
  AxesSettings::AllCircumstances now;
  for (std::size_t axis = 0; axis < axis_count; ++axis) now[axis] = circumstances_of(axis);
  if (parameters_.changes() == offered_changes_ && now == settings_.circumstances()) return;
  if (parameters_.changes() != offered_changes_) configure_thermal();
  offered_changes_ = parameters_.changes();
  settings_.make(parameters_.values(), parameters_.restarting_changes(), now, report_);
  tick_.offer(settings_.all());
  tick_.trace_axis(static_cast<std::size_t>(parameters_.values().whole<"trace.axis">()),
                   static_cast<std::uint32_t>(parameters_.values().whole<"trace.interval">()));
}

/// So that readings and arming never go by an older set, and nothing is worked out twice.
void Axes::judge_if_changed() {
  if (parameters_.changes() == judged_changes_) return;
  judged_changes_ = parameters_.changes();
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    guard_[axis] = guard_finding(parameters_.values(), axis);
}

/// The tick works by the present settings, and knows of the axis' last disarming.
bool Axes::settled(std::size_t of_axis) const {
  if (!tick_.settings_taken() || report_[of_axis].enabled) return false;
  return std::ranges::all_of(
      report_, [this](const AxisReport& axis) { return axis.generation == settings_.generation(); });
}

/// What the hand does on this axis would be felt on one that another link has armed.
bool Axes::pushes_anothers_axis(std::size_t axis) const {
  const ArmedAxes now = armed();
  for (std::size_t other = 0; other < axis_count; ++other) {
    const bool coupled = other != axis && DeviceLaw<axis_count>::couples(parameters_.values(), axis, other);
    if (coupled && now.is_anothers(other, supervisors_[axis].commander())) return true;
  }
  return false;
}

AxesSettings::Circumstances Axes::circumstances_of(std::size_t axis) const {
  return {thermal_[axis].allowance(), thermal_[axis].resistance_temperature(), commutation_known(axis),
          readings_.modulation_limit};
}

void Axes::configure_thermal() {
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    thermal_[axis].configure(thermal_configuration(parameters_.values(), axis));
}

void Axes::poll_temperatures() {
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    thermal_[axis].poll(now_us_, report_[axis].motor.current_square, readings_.power_stage_temperature[axis]);
}

bool Axes::commutation_known(std::size_t axis) const {
  return !readings_.has_power_stage ||
         Commutation::known(parameters_.values(), axis, report_[axis].referenced);
}

Supervisor::Situation Axes::situation(std::size_t axis) {
  return {.values = parameters_.values(),
          .commutation = commutation_[axis],
          .thermal = thermal_[axis],
          .report = report_[axis],
          .setting = settings_.of(axis),
          .readings = readings_,
          .links = links_,
          .now_us = now_us_};
}

Supervisor::Readiness Axes::readiness(std::size_t axis) const {
  return {.settled = settled(axis),
          .commutation_known = commutation_known(axis),
          .guard_failed = guard_[axis].verdict == GuardFinding::Verdict::fail,
          .store_busy = store_.keeper().busy(),
          .restarting = links_[Link::can].restart_asked,
          .absent = readings_.presence(axis, parameters_.values().whole<"drive.declared_absent">(axis) !=
                                                 0) != AxisPresence::present,
          .pushes_anothers_axis = pushes_anothers_axis(axis)};
}

void Axes::begin_poll(std::uint32_t now_us) {
  now_us_ = now_us;
  tick_.keep_alive();
  // The last axis' first: that it is of a round says that those of the others are of the same.
  for (std::size_t axis = axis_count; axis-- > 0;) tick_.report(axis, report_[axis]);
  if (temperatures_timer_.due(now_us)) poll_temperatures();
}

void Axes::log_trip(std::size_t axis) {
  const Fault fault = logged_[axis] = supervisors_[axis].machine().fault();
  ++fault_changes_;
  if (fault == Fault::none) return;
  const Supervisor::Trip& trip = supervisors_[axis].last_trip();
  const TripRecord& record = trip.record;
  const double position = static_cast<double>(record.position) * scale(axis).count_length;
  // By TripNumber.
  log_.add_trip(
      axis, error_code_of(fault), record.tick,
      {trip.value, trip.bound, static_cast<float>(position), record.velocity, record.force, record.current,
       record.current_reference, record.supply, trip.power_stage_temperature, trip.winding_temperature});
}

/// Against what follow_circumstances() keeps, field by field: a whole one to compare with would take 30
/// instructions more in every poll.
bool Axes::circumstances_have_changed() const {
  bool changed = parameters_.changes() != seen_.parameters || fault_changes_ != seen_.faults ||
                 readings_changes_ != seen_.readings;
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const SeenOfAxis& seen = seen_.axis[axis];
    changed = changed || thermal_[axis].changes() != seen.temperatures ||
              report_[axis].reference_generation != seen.reference_generation ||
              report_[axis].referenced != seen.referenced;
  }
  return changed;
}

void Axes::follow_circumstances() {
  seen_ = {.parameters = parameters_.changes(),
           .faults = fault_changes_,
           .readings = readings_changes_,
           .axis = {}};
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const AxisReport& report = report_[axis];
    seen_.axis[axis] = {thermal_[axis].changes(), report.reference_generation, report.referenced};
    commutation_[axis].follow(parameters_.values(), axis, report.reference_generation);
  }
  offer_settings_if_changed();
  judge_if_changed();
}

void Axes::act() {
  if (circumstances_have_changed()) [[unlikely]]
    follow_circumstances();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    Supervisor& supervisor = supervisors_[axis];
    if (const auto controlword = parameters_.fetch_controlword(axis))
      supervisor.request(*controlword, now_us_);
    supervisor.poll(situations_[axis], axis, [this, axis] { return readiness(axis); });
    tick_.leave_share(axis, supervisor.force_share());
    tick_.enable(axis, supervisor.makes_force());
    supervisor.finish_reaction();
    // One that goes and comes again does so in two calls: what arms an axis is not what finds its fault.
    if (supervisor.machine().fault() != logged_[axis]) log_trip(axis);
  }
  command_forces();
}

void Axes::command_forces() {
  ParameterValues& values = parameters_.values();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const bool armed = supervisors_[axis].makes_force();
    // What was asked for while nothing could follow must not act later.
    if (!armed) {
      values.set_whole<"profile.target_torque">(0, axis);
      values.set_real<"profile.target_force">(0.0f, axis);
    }
    tick_.command_force(axis, commanded_force(values, axis, armed, supervisors_[axis].is_halted()));
  }
}

void Axes::disarm(std::size_t axis) {
  supervisors_[axis].disarm();
  tick_.enable(axis, supervisors_[axis].makes_force());
}

void Axes::trip_all_of(Link link, Fault fault) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    if (supervisors_[axis].armed() && supervisors_[axis].commander() == link)
      supervisors_[axis].trip(situations_[axis], axis, fault, 0.0f, 0.0f);
  }
}

void Axes::note_commander(std::span<const SlotValue> written, Link by) {
  const auto number_of = [](std::uint32_t raw) { return static_cast<std::uint16_t>(raw); };
  for (const SlotValue& one : written) {
    const auto [entry, axis] = owner_of(one.slot);
    if (entry == entry_of<"drive.commander">()) supervisors_[axis].set_next_number(by, number_of(one.raw));
    if (entry == entry_of<"link.sign_of_life">()) {
      for (Supervisor& supervisor : supervisors_)
        supervisor.take_sign_of_life(by, number_of(one.raw), now_us_);
    }
  }
}

void Axes::pass_over(std::span<const SlotValue> refused, Link by) {
  for (const SlotValue& one : refused) {
    const auto [entry, axis] = owner_of(one.slot);
    if (entry == entry_of<"drive.controlword">())
      supervisors_[axis].pass_over(static_cast<std::uint16_t>(one.raw), by);
  }
}

}  // namespace kmax::firmware
