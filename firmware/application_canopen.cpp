// What the application does for its CANopen node.
#include "firmware/application.hpp"
#include "firmware/drive/cyclic_torque.hpp"

namespace kmax::firmware {

namespace {

constexpr std::size_t first_communication_slot = slot_count - communication_entries.size();

/// Bits of object 0x1001 by the group of error codes (CiA 301, table of emergency error codes).
std::uint8_t register_bits_of(std::uint16_t code) {
  namespace bits = canopen::error_register;
  switch (code >> 12) {
    case 0x2:
      return bits::current;
    case 0x3:
      return bits::voltage;
    case 0x4:
      return bits::temperature;
    case 0x8:
      return code == 0x8480 ? bits::device_profile : bits::communication;
    case 0xF:
      return bits::manufacturer;
    default:
      return bits::device_profile;
  }
}

std::array<std::uint8_t, 5> bytes_of(std::uint8_t source, float value) {
  const auto word = std::bit_cast<std::uint32_t>(value);
  return {source, static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8),
          static_cast<std::uint8_t>(word >> 16), static_cast<std::uint8_t>(word >> 24)};
}

constexpr int frames_per_poll = 16;
/// What lies behind us for so long is over.
constexpr std::uint32_t overrun_over_us = 1'000'000, conflict_over_us = 5'000'000;

}  // namespace

/// At a start, and when a host resets the communication, which then has the settings of the last start again.
void Application::start_communication(bool power_on) {
  ParameterValues& values = parameters_.values();
  for (std::size_t i = 0; i < power_on_communication_.size(); ++i) {
    const std::size_t slot = first_communication_slot + i;
    if (power_on)
      power_on_communication_[i] = values.raw(slot);
    else
      values.set_raw(slot, power_on_communication_[i]);
  }
  configured_communication_ = parameters_.communication_changes();
  if (power_on) {
    node_.power_on(values, now_us_);
  } else {
    node_.start(values, now_us_);
  }
}

void Application::poll_can() {
  // A flood of frames must not keep the main loop from all else that it watches.
  drivers::CanFrame frame;
  for (int i = 0; i < frames_per_poll && can_queue_.pop(frame); ++i)
    act_on(node_.receive(frame, parameters_.values(), now_us_));
  if (parameters_.communication_changes() != configured_communication_) {
    configured_communication_ = parameters_.communication_changes();
    node_.configure(parameters_.values(), now_us_);
  }
  act_on(node_.poll(now_us_));
  if (round_has_begun()) node_.poll_pdos(round_clock_us_);
  if (can_.state != told_can_state_) {
    if (can_.state == CanState::bus_off) act_on(node_.bus_off());
    canopen::Emergency& emergency = node_.emergency();
    const bool passive = can_.state == CanState::error_passive;
    if (passive)
      emergency.raise({0x8120, canopen::error_register::communication, {canopen::bus_source}});
    else
      emergency.clear(0x8120, canopen::bus_source);
    // It can be told only when it is over.
    if (told_can_state_ == CanState::bus_off)
      emergency.raise({0x8140, canopen::error_register::communication, {canopen::bus_source}});
    told_can_state_ = can_.state;
  } else if (can_.state == CanState::active) {
    node_.emergency().clear(0x8140, canopen::bus_source);
  }
  tell_emergencies();
  restart_wanted_ = restarting_ && !any_armed() && !keeper_.busy();
}

void Application::act_on(const canopen::NodeEvents& events) {
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    if (!machines_[axis].armed() || commander_[axis] != Link::can) continue;
    if (events.heartbeat_lost) trip(axis, Fault::heartbeat_lost, 0.0f, 0.0f);
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
  if (events.start_node) node_.start(parameters_.values(), now_us_);
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
         keeper_.save(parameters_.values(), any_armed()) == Refusal::none;
}

/// The communication's part of a set that is being saved.
void Application::note_saving(const ParameterValues& values) {
  saving_communication_.emplace();
  for (std::size_t i = 0; i < saving_communication_->size(); ++i)
    (*saving_communication_)[i] = values.raw(first_communication_slot + i);
}

/// After the keeper's step: what waits for the end of a save.
void Application::finish_saves() {
  if (keeper_.busy()) return;
  const bool saved = keeper_.state() == StoreState::saved;
  if (identity_saving_) node_.lss().finish(saved ? canopen::LssStore::stored : canopen::LssStore::failed);
  identity_saving_ = false;
  if (saving_communication_ && saved) power_on_communication_ = *saving_communication_;
  saving_communication_.reset();
}

/// At once, and without a controlword.
void Application::disarm(std::size_t axis) {
  command_pending_[axis] = false;
  machines_[axis].disable();
  tick_.enable(axis, machines_[axis].armed());
}

/// Every fault of an axis, when it comes and when it goes.
void Application::tell_emergencies() {
  canopen::Emergency& emergency = node_.emergency();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const Fault fault = machines_[axis].fault();
    if (fault == told_fault_[axis]) continue;
    const auto source = static_cast<std::uint8_t>(axis);
    if (told_fault_[axis] != Fault::none) emergency.clear(error_code_of(told_fault_[axis]), source);
    told_fault_[axis] = fault;
    if (fault == Fault::none) continue;
    const std::uint16_t code = error_code_of(fault);
    emergency.raise({code, register_bits_of(code), bytes_of(source, fault_value_[axis])});
  }
  if (node_.identity_conflicts() != told_conflicts_) {
    told_conflicts_ = node_.identity_conflicts();
    conflict_us_ = now_us_;
    emergency.raise({0x8100, canopen::error_register::communication, {canopen::bus_source}});
  } else if (now_us_ - conflict_us_ > conflict_over_us) {
    emergency.clear(0x8100, canopen::bus_source);
  }
  if (can_.overruns + can_queue_.overflows() != told_overruns_) {
    told_overruns_ = can_.overruns + can_queue_.overflows();
    overrun_us_ = now_us_;
    emergency.raise({0x8110, canopen::error_register::communication, {canopen::bus_source}});
  } else if (now_us_ - overrun_us_ > overrun_over_us) {
    emergency.clear(0x8110, canopen::bus_source);
  }
}

bool Application::next_can_frame(drivers::CanFrame& frame) {
  return !restarting_ && node_.next_frame(frame, now_us_);
}

std::optional<std::uint32_t> Application::last_heard_us(std::size_t axis) const {
  return commander_[axis] == Link::can ? node_.heard_us() : port_.last_valid_request_time();
}

void Application::publish_torques() {
  ParameterValues& values = parameters_.values();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const bool armed = machines_[axis].armed();
    // What was asked for while nothing could follow must not act later.
    if (!armed) {
      values.set_whole<"profile.target_torque">(0, axis);
      values.set_real<"profile.target_force">(0.0f, axis);
    }
    tick_.command_force(axis, commanded_force(values, axis, armed, halted_[axis]));
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
  v.set_whole<"can.emergencies_lost">(node_.emergency().counters().overflows);
  v.set_whole<"can.heartbeats_lost">(node_.heartbeat_counters().lost);
  v.set_whole<"can.identity_conflicts">(node_.identity_conflicts());
  v.set_whole<"can.bit_rate_in_use">(node_.settings().bit_rate);
}

}  // namespace kmax::firmware
