#include "firmware/links/canopen_edge.hpp"

#include "firmware/object_dictionary/firmware_version.hpp"

namespace kmax::firmware {

CanopenEdge::CanopenEdge(const LinkSources& sources)
    : parameters_(sources.parameters),
      store_(sources.store),
      writes_(sources.writes),
      axes_(sources.axes),
      links_(sources.links),
      state_(links_[Link::can]),
      objects_(sources, node_),
      node_(objects_,
            {.vendor = vendor_id,
             .product = product_code,
             .revision = firmware_version,
             .serial = sources.board.serial_number},
            Axes::round_interval_us) {
  power_on();
  state_.is_off = true;  // until the board has said what its controller is at
}

void CanopenEdge::power_on() {
  store_.power_on_communication().take(parameters_.values());
  configured_communication_ = parameters_.communication_changes();
  node_.power_on(parameters_.values(), axes_.now_us());
}

/// A host resets the communication, which then has the settings of the last start again.
void CanopenEdge::reset_communication() {
  for (const Link link : can_links) parameters_.drop(link, axes_.now_us());
  store_.power_on_communication().put_back(parameters_.values());
  configured_communication_ = parameters_.communication_changes();
  start_node();
}

void CanopenEdge::start_node() {
  node_.start(parameters_.values(), axes_.now_us());
}

void CanopenEdge::set_readings(const CanReadings& readings) {
  readings_ = readings;
  state_.is_off = readings.state == CanState::bus_off || readings.state == CanState::stopped ||
                  readings.state == CanState::absent;
}

void CanopenEdge::set_reached_over_usb(bool reached) {
  if (reached == reached_over_usb_) return;
  reached_over_usb_ = reached;
  if (reached) return;
  for (const Link link : can_links) links_[link].heard_over_usb.fill(false);
}

void CanopenEdge::poll() {
  const std::uint32_t now_us = axes_.now_us();
  // What goes by time is looked at once a millisecond: the times are much longer.
  bool serve = service_.due(now_us) || fault_changes_ != axes_.fault_changes();
  if (!queue_.empty()) {
    receive(now_us);
    serve = true;
  }
  if (parameters_.communication_changes() != configured_communication_) {
    configured_communication_ = parameters_.communication_changes();
    node_.configure(parameters_.values(), now_us);
    serve = true;
  }
  if (serve) {
    fault_changes_ = axes_.fault_changes();
    node_.lss().hold(axes_.any_armed(), parameters_.locked());
    act_on(node_.poll(parameters_.values(), now_us));
  }
  if (const auto round_us = rounds_.poll(axes_, now_us)) node_.poll_pdos(*round_us, now_us);
  if (serve) watch_bus();
}

void CanopenEdge::receive(std::uint32_t now_us) {
  constexpr int frames_per_poll = 16;
  // A flood of frames must not keep the main loop from all else that it watches.
  drivers::CanFrame frame;
  for (int i = 0; i < frames_per_poll && queue_.pop(frame); ++i) {
    node_.lss().hold(axes_.any_armed(), parameters_.locked());
    act_on(node_.receive(frame, parameters_.values(), now_us));
  }
}

void CanopenEdge::take(const drivers::CanFrame& frame) {
  node_.lss().hold(axes_.any_armed(), parameters_.locked());
  // No command is as short as a SYNC, and what a SYNC applies may have come from the bus.
  objects_.set_over_usb(reached_over_usb_ && frame.length > 1);
  act_on(node_.receive(frame, parameters_.values(), axes_.now_us()));
  objects_.set_over_usb(false);
}

void CanopenEdge::watch_bus() {
  const bool bus_off = readings_.state == CanState::bus_off && !reached_over_usb_;
  if (bus_off && !was_bus_off_) act_on(node_.bus_off());
  was_bus_off_ = bus_off;
  report_emergencies();
  restart_wanted_ = state_.restart_asked && !axes_.any_armed() && !store_.keeper().busy();
}

void CanopenEdge::act_on(const canopen::NodeEvents& events) {
  state_.heartbeat_lost = node_.any_heartbeat_lost();
  if (!events.any()) [[likely]]
    return;
  for (const Link link : can_links) {
    if (events.heartbeat) links_[link].heard_us = axes_.now_us();
    if (events.heartbeat_lost) axes_.trip_all_of(link, Fault::heartbeat_lost);
  }
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    // Nobody can change the target any more.
    const bool without_target =
        events.pdos_ended && axes_.supervisor(axis).armed() && is_can(axes_.supervisor(axis).commander()) &&
        parameters_.values().choice<DriveMode, "drive.mode">(axis) == DriveMode::torque;
    if (events.remove_force || without_target) axes_.disarm(axis);
  }
  if (events.store_identity) {
    identity_saving_ = save_identity();
    if (!identity_saving_) node_.lss().finish(canopen::LssStore::failed);
  }
  if (events.start_node) start_node();
  if (events.reset_communication) reset_communication();
  if (events.reset_node) state_.restart_asked = true;
}

bool CanopenEdge::save_identity() {
  if (parameters_.transaction_open() || axes_.any_armed()) return false;
  const auto set = [this](std::size_t entry, std::uint32_t raw) {
    const SlotValue one{slot_of(entry, 0), raw};
    return writes_.write({&one, 1}, Link::local).refusal == Refusal::none;
  };
  return set(entry_of<"node.id">(), node_.lss().pending_node_id()) &&
         set(entry_of<"can.bit_rate">(), node_.lss().pending_bit_rate()) &&
         store_.save(axes_.any_armed()).refusal == Refusal::none;
}

void CanopenEdge::finish_saves() {
  if (!identity_saving_ || store_.keeper().busy()) return;
  const bool saved = store_.keeper().state() == StoreState::saved;
  node_.lss().finish(saved ? canopen::LssStore::stored : canopen::LssStore::failed);
  identity_saving_ = false;
}

void CanopenEdge::report_emergencies() {
  EmergencyCauses now{.can_state = readings_.state,
                      .identity_conflicts = node_.identity_conflicts(),
                      .frames_lost = readings_.overruns + queue_.overflows()};
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    now.faults[axis] = axes_.supervisor(axis).machine().fault();
    now.fault_values[axis] = axes_.supervisor(axis).last_trip().value;
  }
  emergencies_.poll(now, node_.emergency(), axes_.now_us());
}

bool CanopenEdge::next_frame(drivers::CanFrame& frame) {
  return !state_.restart_asked && node_.next_frame(frame, axes_.now_us());
}

std::optional<std::uint32_t> RoundClock::poll(const Axes& axes, std::uint32_t now_us) {
  constexpr std::uint32_t without_ticks_us = 1'000;  // where none come, or none any more
  const std::uint32_t round = axes.report(axis_count - 1).tick / Axes::round_ticks;
  const std::uint32_t waited_us = now_us - began_us_;
  // So late that the first axis has reported of the next round: a moment more, and the last will have too.
  const bool complete = round != round_ && axes.report(0).tick / Axes::round_ticks == round;
  if (!complete && waited_us < without_ticks_us) return std::nullopt;
  clock_us_ += round == round_ ? waited_us : (round - round_) * Axes::round_interval_us;
  round_ = round;
  began_us_ = now_us;
  return clock_us_;
}

void CanopenEdge::publish(ParameterValues& values) const {
  values.set_whole<"can.state">(static_cast<std::uint32_t>(readings_.state));
  values.set_whole<"can.node_state">(static_cast<std::uint32_t>(node_.state()));
  values.set_whole<"can.node_in_use">(node_.node_id());
  values.set_whole<"can.transmit_errors">(readings_.transmit_errors);
  values.set_whole<"can.receive_errors">(readings_.receive_errors);
  values.set_whole<"can.received">(readings_.received);
  values.set_whole<"can.sent">(readings_.sent);
  values.set_whole<"can.overruns">(readings_.overruns);
  values.set_whole<"can.queue_overflows">(queue_.overflows());
  values.set_whole<"can.bus_offs">(readings_.bus_offs);
  values.set_whole<"can.discarded">(readings_.discarded);
  const auto &first = node_.sdo_counters(0), &second = node_.sdo_counters(1);
  values.set_whole<"can.sdo_aborts">(first.aborts_sent + second.aborts_sent);
  values.set_whole<"can.sdo_timeouts">(first.timeouts + second.timeouts);
  values.set_whole<"can.rpdo_refused">(node_.rpdo_counters().refused);
  values.set_whole<"can.pdo_length_errors">(node_.rpdo_counters().too_short);
  values.set_whole<"can.tpdo_held_back">(node_.tpdo_counters().held_back);
  values.set_whole<"can.emergencies_lost">(node_.emergency().overflows());
  values.set_whole<"can.heartbeats_lost">(node_.heartbeat_counters().lost);
  values.set_whole<"can.identity_conflicts">(node_.identity_conflicts());
  values.set_whole<"can.bit_rate_in_use">(node_.settings().bit_rate);
}

}  // namespace kmax::firmware
