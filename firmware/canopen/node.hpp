#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "drivers/can_frame.hpp"
#include "firmware/board_interface/can_port.hpp"
#include "firmware/canopen/emergency.hpp"
#include "firmware/canopen/heartbeat_consumer.hpp"
#include "firmware/canopen/lss_slave.hpp"
#include "firmware/canopen/nmt.hpp"
#include "firmware/canopen/rpdo.hpp"
#include "firmware/canopen/sdo_server.hpp"
#include "firmware/canopen/sync.hpp"
#include "firmware/canopen/tpdo.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware::canopen {

/// What the owner of a node has to do; several at a time.
struct NodeEvents {
  bool remove_force = false;         ///< NMT stop or a reset: no axis may be driven
  bool reset_node = false;           ///< restart the whole device
  bool reset_communication = false;  ///< put the settings back, then call start()
  bool start_node = false;           ///< the first node ID has been given: call start()
  bool store_identity = false;       ///< keep the pending node ID and bit rate, then call lss().finish()
  bool heartbeat = false;            ///< of a watched node
  bool heartbeat_lost = false;       ///< of a watched node
  bool pdos_ended = false;           ///< operational was left: what PDOs asked for is no longer wanted
  /// In almost every poll there is none: looked for in two words.
  constexpr bool any() const { return std::bit_cast<std::uint64_t>(*this) != 0; }
};

/// A CANopen node (CiA 301): all services of one device on one bus, behind one function for frames in and one
/// for frames out.
///
///   states and services     initialising   pre-operational   operational   stopped
///   NMT, heartbeat, LSS          (LSS)             x               x           x
///   SDO, SYNC, emergency                           x               x
///   PDO                                                            x
///
/// `Objects`: SharedObjectAccess, PdoSource, and `bool take(slot, raw)` for what PDOs bring. Frames are sent
/// in the order boot-up and heartbeat, SYNC, emergency, PDO, SDO, LSS; the controller sorts them by
/// identifier.
///
/// There are two SDO servers, the second one where object 0x1201 says. Each has its own transfer; if both
/// have something to send, they take turns. One whose channel has changed ends what it has under way first.
///
/// After bus-off a transfer under way is dropped and the state follows canopen.error_behaviour.
///
/// Time: microseconds, wraps at 2^32; poll() at least every 100 ms. Main loop only.
template <typename Objects>
class Node {
 public:
  /// `pdo_interval_us`: of poll_pdos().
  Node(Objects& objects, const LssIdentity& identity, std::uint32_t pdo_interval_us)
      : objects_(objects), lss_(identity), pdo_interval_us_(pdo_interval_us) {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Power-on and after a reset of the node: node ID and bit rate are those of the settings. `values` here
  /// and below: those among which are CANopen's own settings.
  void power_on(const ParameterValues& values, std::uint32_t now_us) {
    identity_ = identity_in(values);
    lss_.start(identity_.node_id, identity_.bit_rate);
    start(values, now_us);
  }

  /// NMT's initialising: ends with the boot-up message. Node ID and bit rate are those that LSS was told, or
  /// those of the settings if these have changed since.
  void start(const ParameterValues& values, std::uint32_t now_us) {
    const Identity now = identity_in(values);
    if (now != identity_) lss_.start(now.node_id, now.bit_rate);
    identity_ = now;
    lss_.reset_communication();
    heartbeat_ms_ = heartbeat_time_in(values);
    nmt_.start(lss_.active_node_id(), heartbeat_ms_, now_us);
    emergency_.start();
    heartbeats_.start();
    stop_pdos();
    configure(values, now_us);
    stop_sdo();
    if (nmt_.configured()) start_if_silent();
  }

  /// CANopen's own settings have changed.
  void configure(const ParameterValues& values, std::uint32_t now_us) {
    const std::uint8_t id = nmt_.configured() ? node_id() : std::uint8_t{0};
    configure_sync(values);
    emergency_.configure(resolved_cob_id(stored<"canopen.emergency_cob_id">(values), cob_id::emergency, id),
                         static_cast<std::uint16_t>(stored<"canopen.emergency_inhibit_time">(values)));
    const std::uint16_t heartbeat_ms = heartbeat_time_in(values);
    if (heartbeat_ms != heartbeat_ms_) nmt_.set_heartbeat(heartbeat_ms, now_us);
    heartbeat_ms_ = heartbeat_ms;
    for (std::size_t i = 0; i < watched_node_count; ++i) {
      const std::uint32_t watched = values.raw(slot_of(entry_of<"heartbeat_consumer.node_1">() + i, 0));
      if (watched == watched_[i]) continue;
      watched_[i] = watched;
      if (const auto forgotten = heartbeats_.configure(i, watched))
        emergency_.clear(0x8130, source_of(*forgotten));
    }
    error_behaviour_ = stored<"canopen.error_behaviour">(values);
    second_channel_ = second_channel_in(values);
    rpdos_.configure(values, id);
    if (nmt_.state() == NmtState::operational) configure_tpdos(values);
    list_identifiers(id);
  }

  [[nodiscard]] NodeEvents receive(const drivers::CanFrame& frame, const ParameterValues& values,
                                   std::uint32_t now_us) {
    NodeEvents events;
    if (frame.extended || frame.remote) return events;
    follow_second_channel();
    const std::uint32_t id = frame.identifier;
    if (id == cob_id::nmt) {
      follow(nmt_.receive(frame), values, events);
    } else if (id == cob_id::lss_request) {
      act_on(lss_.receive(frame, now_us), values, events);
    } else if (auto* const server = server_of(id)) {
      if (speaks()) server->receive(frame, now_us);
    } else if (nmt_.configured() && only_ours(id)) {
      ++identity_conflicts_;
    } else {
      receive_data(frame, now_us, events);
    }
    return events;
  }

  [[nodiscard]] NodeEvents poll(const ParameterValues& values, std::uint32_t now_us) {
    NodeEvents events;
    while (const auto lost = heartbeats_.poll(now_us)) {
      emergency_.raise({0x8130, error_register::communication, {source_of(*lost)}});
      events.heartbeat_lost = true;
    }
    if (events.heartbeat_lost) communication_error(events);
    act_on(lss_.poll(now_us), values, events);
    for (auto& server : sdo_) server.poll(now_us);
    follow_second_channel();
    return events;
  }

  /// For PDOs that go by time and own SYNCs, which have a clock of their own: `pdo_us` goes on by the
  /// interval from call to call, also if a call is late. So a PDO goes with the same one of so many calls,
  /// and with values at the same distance, however long the calls before took and whatever comes between
  /// them.
  void poll_pdos(std::uint32_t pdo_us, std::uint32_t now_us) {
    pdo_us_ = pdo_us;
    if (speaks() && sync_.poll(pdo_us_)) act_on_sync(now_us);
    if (nmt_.state() != NmtState::operational) return;
    tpdos_.poll(pdo_us_);
    tpdos_.read_due(objects_);
  }

  /// The next frame to send, if there is one; it counts as sent.
  [[nodiscard]] bool next_frame(drivers::CanFrame& out, std::uint32_t now_us) {
    if (lss_.quiet()) return false;
    if (nmt_.next_frame(out, now_us)) return true;
    const bool speaking = speaks();
    return (speaking && sync_.next_frame(out)) || emergency_.next_frame(out, nmt_.state(), now_us) ||
           (speaking &&
            ((nmt_.state() == NmtState::operational && tpdos_.next_frame(out, objects_, pdo_us_)) ||
             next_answer(out, now_us))) ||
           lss_.next_frame(out);
  }

  /// The controller has gone off the bus.
  [[nodiscard]] NodeEvents bus_off() {
    NodeEvents events;
    if (nmt_.configured()) start_sdo();
    communication_error(events);
    return events;
  }

  Emergency& emergency() { return emergency_; }
  const Emergency& emergency() const { return emergency_; }
  LssSlave& lss() { return lss_; }
  NmtState state() const { return nmt_.state(); }
  /// 1 to 127, or 255 while there is none.
  std::uint8_t node_id() const { return nmt_.node_id(); }
  const CanSettings& settings() const { return settings_; }
  /// Rises when they may have changed.
  std::uint32_t settings_changes() const { return settings_changes_; }
  bool any_heartbeat_lost() const { return heartbeats_.any_lost(); }

  /// Of the server at `number`, 0 or 1.
  const SdoCounters& sdo_counters(std::size_t number) const { return sdo_[number].counters(); }
  const HeartbeatConsumerCounters& heartbeat_counters() const { return heartbeats_.counters(); }
  const TpdoCounters& tpdo_counters() const { return tpdos_.counters(); }
  const RpdoCounters& rpdo_counters() const { return rpdos_.counters(); }
  std::uint32_t identity_conflicts() const { return identity_conflicts_; }

 private:
  using Server = SdoServer<ServedObjects<Objects>, scratch_bytes>;

  /// As it was stored when the node last started: what LSS has given since may differ.
  struct Identity {
    std::uint8_t node_id = 1;
    std::uint32_t bit_rate = 1'000'000;
    friend constexpr bool operator==(const Identity&, const Identity&) = default;
  };

  /// A COB-ID without the node ID where it is the predefined one.
  template <FixedName name>
  static std::uint32_t stored(const ParameterValues& values) {
    return values.raw(slot_of(entry_of<name>(), 0));
  }
  static Identity identity_in(const ParameterValues& values) {
    return {static_cast<std::uint8_t>(stored<"node.id">(values)), stored<"can.bit_rate">(values)};
  }
  static std::uint16_t heartbeat_time_in(const ParameterValues& values) {
    return static_cast<std::uint16_t>(stored<"canopen.heartbeat_time">(values));
  }
  static constexpr std::uint8_t source_of(std::uint8_t other_node) {
    return static_cast<std::uint8_t>(watched_source + other_node);
  }

  [[gnu::always_inline]] bool speaks() const {
    return nmt_.state() == NmtState::pre_operational || nmt_.state() == NmtState::operational;
  }

  bool only_ours(std::uint32_t id) const {
    return id == cob_id::heartbeat + node_id() || id == cob_id::sdo_response + node_id();
  }

  void receive_data(const drivers::CanFrame& frame, std::uint32_t now_us, NodeEvents& events) {
    if (frame.identifier > cob_id::heartbeat && frame.identifier <= cob_id::heartbeat + highest_node_id) {
      const std::uint32_t before = heartbeats_.counters().heartbeats;
      if (const auto back = heartbeats_.receive(frame, now_us)) emergency_.clear(0x8130, source_of(*back));
      events.heartbeat = heartbeats_.counters().heartbeats != before;
    } else if (speaks() && sync_.receives(frame)) {
      report(frame.length != sync_.length(), 0x8240);
      if (frame.length <= 1) act_on_sync(now_us);
    } else if (nmt_.state() == NmtState::operational) {
      tell_pdo(rpdos_.receive(frame, take_value(), now_us));
    }
  }

  auto take_value() {
    return [this](std::size_t slot, std::uint32_t raw) { return objects_.take(slot, raw); };
  }

  /// Heard or own.
  void act_on_sync(std::uint32_t now_us) {
    if (nmt_.state() != NmtState::operational) return;
    rpdos_.on_sync(take_value(), now_us);
    tpdos_.on_sync();
  }

  void tell_pdo(RpdoResult result) {
    if (result == RpdoResult::ignored) return;
    report(result == RpdoResult::too_short, 0x8210);
    report(result == RpdoResult::too_long, 0x8220);
  }

  /// An error of the host's PDOs, until one is right again.
  void report(bool present, std::uint16_t code) {
    if (present) {
      emergency_.raise({code, error_register::communication, {bus_source}});
    } else {
      emergency_.clear(code, bus_source);
    }
  }

  void follow(NmtEvent event, const ParameterValues& values, NodeEvents& events) {
    switch (event) {
      case NmtEvent::none:
        break;
      case NmtEvent::entered_operational:
        start_if_silent();
        rpdos_.configure(values, node_id());
        configure_tpdos(values);
        break;
      case NmtEvent::entered_pre_operational:
        start_if_silent();
        stop_pdos();
        events.pdos_ended = true;
        break;
      case NmtEvent::entered_stopped:
        events.remove_force = true;
        stop_pdos();
        stop_sdo();
        break;
      case NmtEvent::reset_node:
        events.remove_force = events.reset_node = true;
        break;
      case NmtEvent::reset_communication:
        events.remove_force = events.reset_communication = true;
        break;
    }
  }

  void stop_pdos() {
    tpdos_.stop();
    rpdos_.drop_kept();
  }

  // Those that start do so at the next call of poll_pdos() but one: to start them takes so long that the next
  // may be late. Where this node makes SYNC they wait to be in step with it: a SYNC between them would come
  // sooner or later by a frame, as it meets one on the bus or not.
  void configure_tpdos(const ParameterValues& values) {
    const std::uint8_t id = nmt_.configured() ? node_id() : std::uint8_t{0};
    tpdos_.configure(values, id, lss_.active_bit_rate(), sync_.in_step(pdo_us_ + 2 * pdo_interval_us_));
  }

  /// After the start, or NMT stop.
  void start_if_silent() {
    if (!sdo_silent_) return;
    sdo_silent_ = false;
    start_sdo();
    sync_.start(pdo_us_);
  }
  void start_sdo() {
    sdo_[0].start(SdoChannel::predefined(node_id()));
    sdo_[1].start(second_channel_);
  }
  void stop_sdo() {
    for (auto& server : sdo_) server.stop();
    sdo_silent_ = true;
  }
  Server* server_of(std::uint32_t request) {
    for (auto& server : sdo_) {
      if (request == server.channel().request) return &server;
    }
    return nullptr;
  }
  /// As soon as the second server has ended what it had under way on the channel before.
  void follow_second_channel() {
    if (!sdo_silent_ && sdo_[1].channel() != second_channel_ && !sdo_[1].busy())
      sdo_[1].start(second_channel_);
  }
  bool next_answer(drivers::CanFrame& out, std::uint32_t now_us) {
    if (!sdo_[0].busy() && !sdo_[1].busy()) return false;
    const std::size_t other = 1 - answered_last_;
    if (sdo_[other].next_frame(out, now_us)) {
      answered_last_ = other;
      return true;
    }
    return sdo_[answered_last_].next_frame(out, now_us);
  }
  SdoChannel second_channel_in(const ParameterValues& values) const {
    const std::uint32_t request = stored<"sdo_server_2.request_cob_id">(values),
                        response = stored<"sdo_server_2.response_cob_id">(values);
    const auto bad = [](std::uint32_t id) { return id > cob_id::identifier || cob_id::restricted(id); };
    if (!nmt_.configured() || bad(request) || bad(response) || request == response) return {};
    return {static_cast<std::uint16_t>(request), static_cast<std::uint16_t>(response)};
  }
  void configure_sync(const ParameterValues& values) {
    sync_.configure(
        {.cob_id = stored<"canopen.sync_cob_id">(values),
         .period_us = stored<"canopen.sync_period">(values),
         .counter_overflow = static_cast<std::uint8_t>(stored<"canopen.sync_counter_overflow">(values))},
        lss_.active_bit_rate(), pdo_us_);
  }

  void act_on(LssAction action, const ParameterValues& values, NodeEvents& events) {
    if (action == LssAction::switch_bit_rate) {
      settings_.bit_rate = lss_.active_bit_rate();
      ++settings_changes_;
      configure_sync(values);
      // What went often enough at the rate before may fill the bus at this one.
      if (nmt_.state() == NmtState::operational) configure_tpdos(values);
    }
    if (action == LssAction::store) events.store_identity = true;
    if (action == LssAction::start_node) events.start_node = true;
  }

  /// Object 0x1029.
  void communication_error(NodeEvents& events) {
    if (error_behaviour_ == 0 && nmt_.state() == NmtState::operational) {
      if (nmt_.enter(NmtState::pre_operational) != NmtEvent::none) {
        stop_pdos();
        events.pdos_ended = true;
      }
    } else if (error_behaviour_ == 2 && nmt_.enter(NmtState::stopped) != NmtEvent::none) {
      stop_pdos();
      stop_sdo();
      events.remove_force = true;
    }
  }

  /// All that this node listens to.
  void list_identifiers(std::uint8_t id) {
    CanSettings settings;
    settings.bit_rate = lss_.active_bit_rate();
    const auto listen = [&settings](std::uint32_t identifier) {
      if (settings.identifier_count < CanSettings::identifiers_max)
        settings.identifiers[settings.identifier_count++] = static_cast<std::uint16_t>(identifier);
    };
    listen(cob_id::nmt);
    listen(cob_id::lss_request);
    if (id != 0) {
      listen(sync_.identifier());
      listen(cob_id::sdo_request + id);
      listen(cob_id::sdo_response + id);
      if (second_channel_ != SdoChannel{}) listen(second_channel_.request);
      listen(cob_id::heartbeat + id);
      for (std::size_t i = 0; i < rpdo_count; ++i) {
        if (const auto identifier = rpdos_.identifier(i)) listen(*identifier);
      }
      for (const std::uint32_t watched : watched_) {
        const std::uint32_t node = watched >> 16 & 0x7F;
        if (node != 0 && (watched & 0xFFFF) != 0) listen(cob_id::heartbeat + node);
      }
    }
    settings_ = settings;
    ++settings_changes_;
  }

  Objects& objects_;
  LssSlave lss_;
  Nmt nmt_;
  Emergency emergency_;
  HeartbeatConsumer heartbeats_;
  Sync sync_;
  std::array<ServedObjects<Objects>, 2> served_{ServedObjects<Objects>(objects_, 0),
                                                ServedObjects<Objects>(objects_, 1)};
  std::array<Server, 2> sdo_{Server(served_[0]), Server(served_[1])};
  std::size_t answered_last_ = 0;  // of the two
  SdoChannel second_channel_;
  std::uint32_t pdo_interval_us_, pdo_us_ = 0;
  Tpdos tpdos_;
  Rpdos rpdos_;
  CanSettings settings_;
  std::uint32_t settings_changes_ = 0;
  // As last taken over.
  Identity identity_;
  std::uint16_t heartbeat_ms_{};
  std::array<std::uint32_t, watched_node_count> watched_{};  ///< object 0x1016
  std::uint32_t error_behaviour_{};                          ///< object 0x1029
  std::uint32_t identity_conflicts_ = 0;
  bool sdo_silent_{};
};

}  // namespace kmax::firmware::canopen
