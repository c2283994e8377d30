// What a host can read and write: the bank behind the Modbus server.
#include "firmware/application.hpp"
#include "firmware/haptic_configuration.hpp"

namespace kmax::firmware {

using modbus::Exception;

namespace {
Exception exception_for(Refusal refusal) {
  switch (refusal) {
    case Refusal::none:
      return Exception::none;
    case Refusal::unknown_register:
    case Refusal::read_only:
    case Refusal::value_cut_in_two:
      return Exception::illegal_data_address;
    case Refusal::while_armed:
    case Refusal::no_transaction:
    case Refusal::store_missing:
    case Refusal::capture_missing:
      return Exception::server_device_failure;
    case Refusal::transaction_open:
    case Refusal::store_busy:
      return Exception::server_device_busy;
    default:
      return Exception::illegal_data_value;
  }
}
}  // namespace

bool Application::Bank::has_holding(std::uint16_t address, std::uint16_t count) const {
  return app_.registers_.readable(true, address, count);
}

Exception Application::Bank::read_holding(std::uint16_t address, std::span<std::uint16_t> out) {
  if (!app_.registers_.readable(true, address, out.size())) return Exception::illegal_data_address;
  app_.registers_.read(true, address, out);
  return Exception::none;
}

Exception Application::Bank::read_input(std::uint16_t address, std::span<std::uint16_t> out) {
  const auto last = static_cast<std::uint32_t>(address + out.size() - 1);
  if (Trace::contains(address) && Trace::contains(last)) {
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = app_.trace_.word_at(static_cast<std::uint16_t>(address + i));
    return Exception::none;
  }
  if (Capture::contains(address) && Capture::contains(last)) {
    // Zeros must not be taken for data.
    if (!app_.capture_.readable()) return Exception::server_device_busy;
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = app_.capture_.word_at(static_cast<std::uint16_t>(address + i));
    return Exception::none;
  }
  if (!app_.registers_.readable(false, address, out.size())) return Exception::illegal_data_address;
  app_.refresh_readings();
  app_.registers_.read(false, address, out);
  return Exception::none;
}

Exception Application::Bank::write_holding(std::uint16_t address, std::span<const std::uint16_t> in) {
  const auto is_command = [&](std::size_t entry) {
    return in.size() == 1 && address == register_address(entry, 0);
  };
  const auto result = is_command(entry_of<"store.command">()) ? app_.command_store(in[0])
                      : is_command(entry_of<"capture.command">())
                          ? app_.command_capture(in[0])
                          : app_.registers_.write(address, in, app_.any_armed(), app_.now_us_);
  // At once: a poll that comes late finds several requests, and each must act as if it had come alone.
  app_.act();
  return exception_for(result.refusal);
}

std::string_view Application::Bank::identification(std::uint8_t object_id) const {
  switch (object_id) {
    case 0:
      return "Kmax";
    case 1:
      return "kmax-haptic-controller";
    case 2:
      return firmware_version_text;
    case 4:
      return "Kmax haptic device controller";
    case 5:
      return app_.board_.board_name;
    default:
      return {};
  }
}

void Application::refresh_readings() {
  ParameterValues& v = registers_.values();
  take_reports();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const AxisReport& report = report_[axis];
    const auto& haptic = report.haptic;
    const AxisStateMachine& machine = machines_[axis];
    std::uint16_t status = statusword::base_of(machine.state()) | statusword::remote;
    if (machine.armed()) status |= statusword::voltage_enabled;
    // A force source without a motor has no limits of one.
    const bool saturated = report.motor.saturated && readings_.has_power_stage;
    if (haptic.limited || haptic.slew_limited || saturated)
      status |= statusword::internal_limit_active;
    v.set_whole<"drive.statusword">(status, axis);
    v.set_whole<"drive.error_code">(text_of(machine.fault()).error_code, axis);
    v.set_whole<"drive.refusal">(static_cast<std::uint32_t>(machine.refusal()), axis);
    const bool faulty = machine.fault() != Fault::none;
    v.set_real<"drive.fault_value">(faulty ? fault_value_[axis] : 0.0f, axis);
    v.set_real<"drive.fault_bound">(faulty ? fault_bound_[axis] : 0.0f, axis);

    const double length = count_length(v, axis);
    const TripRecord& record = trip_record_[axis];
    v.set_whole<"trip.tick">(faulty ? record.tick : 0U, axis);
    const auto of_trip = [faulty](float value) { return faulty ? value : 0.0f; };
    v.set_real<"trip.position">(of_trip(static_cast<float>(static_cast<double>(record.position) * length)),
                                axis);
    v.set_real<"trip.velocity">(of_trip(record.velocity), axis);
    v.set_real<"trip.force">(of_trip(record.force), axis);
    v.set_real<"trip.current">(of_trip(record.current), axis);
    v.set_real<"trip.current_reference">(of_trip(record.current_reference), axis);
    v.set_real<"trip.supply">(of_trip(record.supply), axis);
    v.set_real<"trip.temperature">(of_trip(fault_temperatures_[axis][0]), axis);
    v.set_real<"trip.winding_temperature">(of_trip(fault_temperatures_[axis][1]), axis);

    v.set_whole<"measured.tick">(report.tick, axis);
    v.set_real<"measured.position">(static_cast<float>(static_cast<double>(haptic.position) * length), axis);
    v.set_real<"measured.velocity">(haptic.velocity, axis);
    v.set_real<"measured.force">(report.force, axis);
    v.set_real<"measured.distance">(haptic.outside_distance, axis);
    v.set_real<"measured.magnetic_force">(haptic.magnetic_force, axis);
    v.set_real<"measured.magnetic_coefficient">(haptic.magnetic_coefficient, axis);
    v.set_whole<"measured.count">(static_cast<std::uint32_t>(haptic.position), axis);
    const unsigned flags = (haptic.inside ? 1u : 0u) | (haptic.limited ? 2u : 0u) |
                           (haptic.slew_limited ? 4u : 0u) | (haptic.ramping ? 8u : 0u) |
                           (machine.armed() ? 16u : 0u) | (saturated ? 32u : 0u);
    v.set_whole<"measured.flags">(flags, axis);
    v.set_real<"measured.count_length">(static_cast<float>(length), axis);
    const double step =
        control::resampler_step(static_cast<double>(v.real<"position.resolution">(axis)), length);
    v.set_real<"measured.resolution">(static_cast<float>(step * length), axis);
    v.set_whole<"measured.limited_samples">(report.limited_samples, axis);
    v.set_whole<"measured.armed_samples">(report.armed_samples, axis);
    v.set_real<"measured.current">(report.motor.current, axis);
    v.set_real<"measured.current_reference">(report.motor.current_reference, axis);
    v.set_real<"measured.temperature">(readings_.power_stage_temperature[axis], axis);
    v.set_real<"measured.winding_temperature">(thermal_[axis].winding_temperature(), axis);
    v.set_real<"measured.current_limit">(v.real<"current.limit">(axis) * thermal_[axis].allowance(), axis);
    v.set_real<"measured.force_made">(report.motor.force_made, axis);
    v.set_whole<"measured.commutation_known">(commutation_known(axis) ? 1U : 0U, axis);
    v.set_whole<"measured.excitation_finished">(report.motor.excitation_finished ? 1U : 0U, axis);
  }
  v.set_whole<"info.vendor_id">(0);
  v.set_whole<"info.product_code">(product_code);
  v.set_whole<"info.firmware_version">(firmware_version);
  v.set_whole<"info.serial_number">(board_.serial_number);
  v.set_whole<"info.dictionary_checksum">(dictionary_checksum);
  v.set_whole<"info.tick_rate">(tick_rate_hz);
  v.set_whole<"info.core_clock">(board_.core_clock_hz);
  v.set_whole<"info.clock_source">(board_.clock_source);
  v.set_whole<"info.uptime">(uptime_s_);
  v.set_whole<"info.tick">(report_[0].tick);

  const modbus::RtuPortCounters& port = port_.counters();
  const modbus::RtuReceiverCounters& line = port_.receiver_counters();
  v.set_whole<"counters.frames_received">(line.frames_received);
  v.set_whole<"counters.replies_sent">(port.replies);
  v.set_whole<"counters.exceptions_sent">(port.exceptions);
  v.set_whole<"counters.crc_errors">(line.crc_errors);
  v.set_whole<"counters.line_errors">(line.line_errors);
  v.set_whole<"counters.gap_errors">(line.gap_errors);
  v.set_whole<"counters.length_errors">(line.undersize + line.oversize);
  v.set_whole<"counters.other_units">(port.other_units);
  v.set_whole<"counters.queue_overflows">(serial_queue_.overflows());
  v.set_whole<"counters.missed_ticks">(readings_.missed_ticks);
  v.set_real<"supply.voltage">(readings_.supply_voltage);

  refresh_store_readings();
  refresh_capture_readings();
  v.set_whole<"refusal.reason">(static_cast<std::uint32_t>(registers_.last_refusal().refusal));
  v.set_whole<"refusal.register">(registers_.last_refusal().address);
  v.set_whole<"trace.next">(trace_.next());
}

}  // namespace kmax::firmware
