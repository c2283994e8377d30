#include "firmware/links/readings.hpp"

#include "firmware/drive/axis_configuration.hpp"
#include "firmware/drive/profile_readings.hpp"
#include "firmware/drive/statusword.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"

namespace kmax::firmware {

void Readings::refresh() {
  for (std::size_t axis = 0; axis < axis_count; ++axis) refresh_axis(axis);
  refresh_device();
  of_.store.keeper().publish(of_.parameters.values());
}

void Readings::refresh(std::size_t slot) {
  const auto [entry, axis] = owner_of(slot);
  if (descriptors[entry].per_axis) return refresh_axis(axis);
  // Apart, since it compares every parameter with what is kept.
  if (entry >= entry_of<"store.state">() && entry <= entry_of<"store.defaulted_3">())
    return of_.store.keeper().publish(of_.parameters.values());
  refresh_device();
}

bool Readings::saturated(std::size_t axis) const {
  // A force source without a motor has no limits of one.
  return of_.axes.report(axis).motor.saturated && of_.axes.readings().has_power_stage;
}

std::uint32_t Readings::flags_of(std::size_t axis) const {
  const auto& haptic = of_.axes.report(axis).haptic;
  return (haptic.inside ? 1u : 0u) | (haptic.limited ? 2u : 0u) | (haptic.slew_limited ? 4u : 0u) |
         (haptic.ramping ? 8u : 0u) | (of_.axes.supervisor(axis).armed() ? 16u : 0u) |
         (saturated(axis) ? 32u : 0u) | (haptic.unstable ? 64u : 0u) |
         (of_.axes.report(axis).softening < 1.0f ? 128u : 0u);
}

void Readings::refresh_axis(std::size_t axis) {
  ParameterValues& v = of_.parameters.values();
  const AxisReport& report = of_.axes.report(axis);
  const auto& haptic = report.haptic;
  const GuardFinding& guard = of_.axes.guard(axis);
  const bool guard_warns = guard.verdict == GuardFinding::Verdict::fail &&
                           v.choice<GuardMode, "guard.mode">(axis) == GuardMode::warn;
  const Supervisor& supervisor = of_.axes.supervisor(axis);
  const AxisStateMachine& machine = supervisor.machine();
  const ThermalSupervisor& thermal = of_.axes.thermal(axis);
  const bool supply_fault =
      report.condition == Fault::under_voltage || report.condition == Fault::over_voltage;
  const DriveStatus status{
      .state = machine.state(),
      .mode = v.choice<DriveMode, "drive.mode">(axis),
      .supplied = !supply_fault,
      .power_stage_on = of_.axes.supervisor(axis).makes_force(),
      .warning = thermal.allowance() < 1.0f || guard_warns || haptic.unstable || report.softening < 1.0f,
      .limited = haptic.limited || haptic.slew_limited || saturated(axis),
      .halted = supervisor.is_halted(),
      .force_is_zero = report.force == 0.0f,
      .excitation_finished = report.motor.excitation_finished};
  v.set_whole<"drive.statusword">(statusword_of(status), axis);
  v.set_whole<"drive.error_code">(error_code_of(machine.fault()), axis);
  v.set_whole<"drive.refusal">(static_cast<std::uint32_t>(machine.refusal()), axis);
  const AxisPresence presence =
      of_.axes.readings().presence(axis, v.whole<"drive.declared_absent">(axis) != 0);
  v.set_whole<"drive.presence">(static_cast<std::uint32_t>(presence), axis);
  v.set_whole<"drive.gate_driver_faults">(of_.axes.readings().gate_driver_faults[axis], axis);
  const bool faulty = machine.fault() != Fault::none;

  const double length = of_.axes.scale(axis).count_length;
  const Supervisor::Trip& trip = supervisor.last_trip();
  const TripRecord& record = trip.record;
  v.set_whole<"trip.tick">(faulty ? record.tick : 0U, axis);
  const auto of_trip = [faulty](float value) { return faulty ? value : 0.0f; };
  v.set_real<"drive.fault_value">(of_trip(trip.value), axis);
  v.set_real<"drive.fault_bound">(of_trip(trip.bound), axis);
  v.set_real<"trip.position">(of_trip(static_cast<float>(static_cast<double>(record.position) * length)),
                              axis);
  v.set_real<"trip.velocity">(of_trip(record.velocity), axis);
  v.set_real<"trip.force">(of_trip(record.force), axis);
  v.set_real<"trip.current">(of_trip(record.current), axis);
  v.set_real<"trip.current_reference">(of_trip(record.current_reference), axis);
  v.set_real<"trip.supply">(of_trip(record.supply), axis);
  v.set_real<"trip.temperature">(of_trip(trip.power_stage_temperature), axis);
  v.set_real<"trip.winding_temperature">(of_trip(trip.winding_temperature), axis);

  v.set_whole<"measured.tick">(report.tick, axis);
  v.set_real<"measured.position">(static_cast<float>(static_cast<double>(haptic.position) * length), axis);
  v.set_real<"measured.velocity">(haptic.velocity, axis);
  v.set_real<"measured.force">(report.force, axis);
  v.set_real<"measured.distance">(haptic.outside_distance, axis);
  v.set_real<"measured.magnetic_force">(haptic.magnetic_force, axis);
  v.set_real<"measured.magnetic_coefficient">(haptic.magnetic_coefficient, axis);
  v.set_whole<"measured.count">(static_cast<std::uint32_t>(haptic.position), axis);
  v.set_whole<"measured.flags">(flags_of(axis), axis);
  publish_profile(v, axis, report);
  v.set_real<"measured.count_length">(static_cast<float>(length), axis);
  v.set_real<"measured.resolution">(of_.axes.scale(axis).resolution, axis);
  v.set_whole<"measured.limited_samples">(report.limited_samples, axis);
  v.set_whole<"measured.armed_samples">(report.armed_samples, axis);
  v.set_real<"measured.current">(report.motor.current, axis);
  v.set_real<"measured.current_reference">(report.motor.current_reference, axis);
  v.set_real<"measured.temperature">(of_.axes.readings().power_stage_temperature[axis], axis);
  v.set_real<"measured.offset_b">(of_.axes.readings().offset_b[axis], axis);
  v.set_real<"measured.offset_c">(of_.axes.readings().offset_c[axis], axis);
  v.set_real<"measured.winding_temperature">(thermal.winding_temperature(), axis);
  v.set_real<"measured.current_limit">(v.real<"current.limit">(axis) * thermal.allowance(), axis);
  v.set_real<"measured.force_made">(report.motor.force_made, axis);
  v.set_whole<"measured.commutation_known">(of_.axes.commutation_known(axis) ? 1U : 0U, axis);
  v.set_whole<"measured.excitation_finished">(report.motor.excitation_finished ? 1U : 0U, axis);

  v.set_whole<"guard.verdict">(static_cast<std::uint32_t>(guard.verdict), axis);
  v.set_whole<"guard.failed">(guard.failed, axis);
  v.set_whole<"guard.criterion">(static_cast<std::uint32_t>(guard.criterion), axis);
  v.set_real<"guard.value">(guard.value, axis);
  v.set_real<"guard.bound">(guard.bound, axis);

  v.set_whole<"instability.alarms">(report.alarms, axis);
  const auto alarm = report.alarms != 0 ? report.last_alarm : decltype(report.last_alarm){};
  v.set_real<"instability.last_force">(alarm.force, axis);
  v.set_real<"instability.last_amplitude">(alarm.displacement, axis);
  v.set_real<"instability.last_frequency">(alarm.frequency, axis);
  v.set_real<"instability.softening">(report.softening, axis);
}

void Readings::publish_crash() {
  ParameterValues& v = of_.parameters.values();
  v.set_whole<"info.reset_cause">(static_cast<std::uint32_t>(of_.board.reset_cause));
  const CrashRecord& crash = of_.board.crash;
  v.set_whole<"info.crash_count">(crash.count);
  v.set_whole<"info.crash_cause">(static_cast<std::uint32_t>(crash.cause));
  v.set_whole<"info.crash_exception">(crash.exception_number);
  v.set_whole<"info.crash_program_counter">(crash.program_counter);
  v.set_whole<"info.crash_link_register">(crash.link_register);
  v.set_whole<"info.crash_status">(crash.status);
  v.set_whole<"info.crash_hard_fault_status">(crash.hard_fault_status);
  v.set_whole<"info.crash_address">(crash.address);
}

void Readings::publish_capture() {
  ParameterValues& v = of_.parameters.values();
  const CaptureReadings readings = of_.axes.tick().capture().readings();
  v.set_whole<"capture.state">(static_cast<std::uint32_t>(readings.state));
  v.set_whole<"capture.taken">(readings.taken);
  v.set_whole<"capture.trigger_sample">(readings.trigger_sample);
  v.set_whole<"capture.first_tick">(readings.first_tick);
  v.set_whole<"capture.channels">(readings.channels);
}

void Readings::refresh_device() {
  ParameterValues& v = of_.parameters.values();
  std::array<std::uint32_t, axis_count> flags{};
  for (std::size_t axis = 0; axis < axis_count; ++axis) flags[axis] = flags_of(axis);
  publish_telemetry(v, flags, of_.axes.report(0).tick);
  v.set_whole<"info.vendor_id">(vendor_id);
  v.set_whole<"info.product_code">(product_code);
  v.set_whole<"info.firmware_version">(firmware_version);
  v.set_whole<"info.serial_number">(of_.board.serial_number);
  v.set_whole<"info.dictionary_checksum">(dictionary_checksum);
  v.set_whole<"info.tick_rate">(tick_rate_hz);
  v.set_whole<"info.core_clock">(of_.board.core_clock_hz);
  v.set_whole<"info.clock_source">(of_.board.clock_source);
  v.set_whole<"info.brown_out_level">(of_.board.brown_out_level);
  v.set_real<"supply.ceiling">(of_.board.supply_ceiling);
  v.set_whole<"info.uptime">(of_.axes.log().uptime_s());
  v.set_whole<"info.tick">(of_.axes.report(0).tick);

  v.set_whole<"counters.missed_ticks">(of_.axes.readings().missed_ticks);
  v.set_whole<"counters.longest_tick">(of_.axes.readings().longest_tick);
  v.set_whole<"counters.interference_forgiven">(of_.axes.readings().interference_forgiven);
  v.set_real<"supply.voltage">(of_.axes.readings().supply_voltage);

  publish_crash();
  publish_capture();
  of_.lock.publish(v);
  for (const LinkReadings& link : of_.links) link.publish(v);
  v.set_whole<"refusal.reason">(static_cast<std::uint32_t>(of_.parameters.last_refusal().refusal));
  v.set_whole<"refusal.register">(of_.parameters.last_refusal().address);
  v.set_whole<"log.newest">(of_.axes.log().newest());
  v.set_whole<"log.start">(of_.axes.log().start());
  v.set_whole<"trace.next">(of_.axes.tick().trace().next());
}

}  // namespace kmax::firmware
