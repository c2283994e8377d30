// What the application does for its CANopen node.
#include "firmware/application.hpp"
#include "firmware/drive/cyclic_torque.hpp"

namespace kmax::firmware {

namespace {

constexpr int frames_per_poll = 16;

canopen::NodeSettings node_settings(const ParameterValues& values) {
  const auto number = [&values](std::size_t entry) { return values.raw(slot_of(entry, 0)); };
  canopen::NodeSettings settings{
      .node_id = static_cast<std::uint8_t>(number(entry_of<"node.id">())),
      .bit_rate = number(entry_of<"can.bit_rate">()),
      .sync_cob_id = number(entry_of<"canopen.sync_cob_id">()),
      .emergency_cob_id = number(entry_of<"canopen.emergency_cob_id">()),
      .emergency_inhibit_time =
          static_cast<std::uint16_t>(number(entry_of<"canopen.emergency_inhibit_time">())),
      .heartbeat_ms = static_cast<std::uint16_t>(number(entry_of<"canopen.heartbeat_time">())),
      .error_behaviour = static_cast<std::uint8_t>(number(entry_of<"canopen.error_behaviour">())),
      .watched = {}};
  for (std::size_t i = 0; i < settings.watched.size(); ++i)
    settings.watched[i] = number(entry_of<"heartbeat_consumer.node_1">() + i);
  return settings;
}

}  // namespace

/// At a start, and when a host resets the communication, which then has the settings of the last start again.
void Application::start_communication(bool power_on) {
  ParameterValues& values = parameters_.values();
  if (power_on) {
    store_.power_on_communication().take(values);
  } else {
    store_.power_on_communication().put_back(values);
  }
  configured_communication_ = parameters_.communication_changes();
  if (power_on) {
    node_.power_on(node_settings(values), values, now_us_);
  } else {
    node_.start(node_settings(values), values, now_us_);
  }
}

void Application::poll_can() {
  // A flood of frames must not keep the main loop from all else that it watches.
  drivers::CanFrame frame;
  for (int i = 0; i < frames_per_poll && can_queue_.pop(frame); ++i) {
    node_.lss().hold_bit_rate(any_armed());
    act_on(node_.receive(frame, parameters_.values(), now_us_));
  }
  node_.lss().hold_bit_rate(any_armed());
  if (parameters_.communication_changes() != configured_communication_) {
    configured_communication_ = parameters_.communication_changes();
    node_.configure(node_settings(parameters_.values()), parameters_.values(), now_us_);
  }
  act_on(node_.poll(parameters_.values(), now_us_));
  if (round_has_begun()) node_.poll_pdos(round_clock_us_);
  const bool bus_off = can_.state == CanState::bus_off;
  if (bus_off && !was_bus_off_) act_on(node_.bus_off());
  was_bus_off_ = bus_off;
  report_emergencies();
  restart_wanted_ = restarting_ && !any_armed() && !store_busy();
}

void Application::act_on(const canopen::NodeEvents& events) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    if (!supervisors_[axis].armed() || supervisors_[axis].commander() != Link::can) continue;
    if (events.heartbeat_lost)
      supervisors_[axis].trip(situation(axis), axis, Fault::heartbeat_lost, 0.0f, 0.0f);
    // Nobody can change the target any more.
    if (events.pdos_ended && mode(axis) == DriveMode::torque) disarm(axis);
  }
  if (events.remove_force) {
    for (std::size_t axis = 0; axis < axis_count; ++axis) disarm(axis);
  }
  if (events.store_identity) {
    identity_saving_ = save_identity();
    if (!identity_saving_) node_.lss().finish(canopen::LssStore::failed);
  }
  if (events.start_node) node_.start(node_settings(parameters_.values()), parameters_.values(), now_us_);
  if (events.reset_communication) {
    parameters_.drop(Link::can, now_us_);
    start_communication(false);
  }
  if (events.reset_node) restarting_ = true;
}

bool Application::save_identity() {
  if (parameters_.transaction_open() || any_armed()) return false;
  const auto set = [this](std::size_t entry, std::uint32_t raw) {
    return preset(entry, 0, raw).refusal == Refusal::none;
  };
  return set(entry_of<"node.id">(), node_.lss().pending_node_id()) &&
         set(entry_of<"can.bit_rate">(), node_.lss().pending_bit_rate()) &&
         store_.save(any_armed()).refusal == Refusal::none;
}

/// After the store's step: what waits for the end of a save.
void Application::finish_saves() {
  if (!identity_saving_ || store_busy()) return;
  const bool saved = store_.keeper().state() == StoreState::saved;
  node_.lss().finish(saved ? canopen::LssStore::stored : canopen::LssStore::failed);
  identity_saving_ = false;
}

void Application::disarm(std::size_t axis) {
  supervisors_[axis].disarm();
  tick_.enable(axis, supervisors_[axis].armed());
}

void Application::report_emergencies() {
  EmergencyCauses now{.can_state = can_.state,
                      .identity_conflicts = node_.identity_conflicts(),
                      .frames_lost = can_.overruns + can_queue_.overflows()};
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    now.faults[axis] = fault(axis);
    now.fault_values[axis] = supervisors_[axis].last_trip().value;
  }
  emergencies_.poll(now, node_.emergency(), now_us_);
}

bool Application::next_can_frame(drivers::CanFrame& frame) {
  return !restarting_ && node_.next_frame(frame, now_us_);
}

std::optional<std::uint32_t> Application::last_heard_us(std::size_t axis) const {
  if (const auto signed_us = supervisors_[axis].signed_us()) return signed_us;
  return supervisors_[axis].commander() == Link::can ? node_.heard_us() : port_.last_valid_request_time();
}

void Application::publish_torques() {
  ParameterValues& values = parameters_.values();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const bool armed = supervisors_[axis].armed();
    // What was asked for while nothing could follow must not act later.
    if (!armed) {
      values.set_whole<"profile.target_torque">(0, axis);
      values.set_real<"profile.target_force">(0.0f, axis);
    }
    tick_.command_force(axis, commanded_force(values, axis, armed, supervisors_[axis].is_halted()));
  }
}

void Application::refresh_can_readings() {
  ParameterValues& v = parameters_.values();
  v.set_whole<"can.state">(static_cast<std::uint32_t>(can_.state));
  v.set_whole<"can.node_state">(static_cast<std::uint32_t>(node_.state()));
  v.set_whole<"can.node_in_use">(node_.node_id());
  v.set_whole<"can.transmit_errors">(can_.transmit_errors);
  v.set_whole<"can.receive_errors">(can_.receive_errors);
  v.set_whole<"can.received">(can_.received);
  v.set_whole<"can.sent">(can_.sent);
  v.set_whole<"can.overruns">(can_.overruns);
  v.set_whole<"can.queue_overflows">(can_queue_.overflows());
  v.set_whole<"can.bus_offs">(can_.bus_offs);
  v.set_whole<"can.discarded">(can_.discarded);
  v.set_whole<"can.sdo_aborts">(node_.sdo_counters().aborts_sent);
  v.set_whole<"can.sdo_timeouts">(node_.sdo_counters().timeouts);
  v.set_whole<"can.rpdo_refused">(node_.rpdo_counters().refused);
  v.set_whole<"can.pdo_length_errors">(node_.rpdo_counters().too_short);
  v.set_whole<"can.tpdo_held_back">(node_.tpdo_counters().held_back);
  v.set_whole<"can.emergencies_lost">(node_.emergency().overflows());
  v.set_whole<"can.heartbeats_lost">(node_.heartbeat_counters().lost);
  v.set_whole<"can.identity_conflicts">(node_.identity_conflicts());
  v.set_whole<"can.bit_rate_in_use">(node_.settings().bit_rate);
}

}  // namespace kmax::firmware
