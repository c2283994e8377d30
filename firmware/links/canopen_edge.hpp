#pragma once

#include <cstdint>
#include <optional>

#include "drivers/can_frame.hpp"
#include "drivers/periodic_timer.hpp"
#include "firmware/board_interface/board_identity.hpp"
#include "firmware/board_interface/can_port.hpp"
#include "firmware/canopen/node.hpp"
#include "firmware/command/axes.hpp"
#include "firmware/command/host_writes.hpp"
#include "firmware/command/store_commands.hpp"
#include "firmware/drive/link_states.hpp"
#include "firmware/exchange/interrupt_queue.hpp"
#include "firmware/links/canopen_objects.hpp"
#include "firmware/links/emergency_reports.hpp"
#include "firmware/links/readings.hpp"

namespace kmax::firmware {

/// A clock of the tick's rounds, for what is sent regularly: frames and the main loop's polls come at any
/// time, rounds do not.
class RoundClock {
 public:
  /// us, wraps at 2^32, when a round has begun since the last call; where no ticks come, every millisecond.
  std::optional<std::uint32_t> poll(const Axes& axes, std::uint32_t now_us);

 private:
  std::uint32_t round_{}, began_us_{}, clock_us_{};  ///< from wherever: only differences count
};

/// The CAN link: frames in and out, behind which the device is a CANopen node. What happens on the bus acts
/// on the axes from here.
///
/// The receive interrupt calls ISR_frame(), which the tick may preempt; all else is the main loop's.
class CanopenEdge {
 public:
  explicit CanopenEdge(const LinkSources& sources);
  CanopenEdge(const CanopenEdge&) = delete;
  CanopenEdge& operator=(const CanopenEdge&) = delete;

  /// A data frame with an 11-bit identifier.
  void ISR_frame(const drivers::CanFrame& frame) { queue_.ISR_push(frame); }
  /// Before poll(), as often as they change.
  void set_readings(const CanReadings& readings);
  /// The node starts with the settings as they are now: again, when kept ones have been taken over.
  void power_on();
  /// After Axes::begin_poll().
  void poll();
  /// Main loop, after poll(): a frame that has come over USB, as if it had come from the bus.
  [[gnu::cold]] void take(const drivers::CanFrame& frame);
  /// Whether a host has the node for itself over USB. While it has, a bus that goes off neither stops the
  /// node nor trips an axis whose last command came that way; it trips all others that were armed over CAN.
  /// What a SYNC applies counts as the bus's.
  void set_reached_over_usb(bool reached);
  /// After the store's step: what waits for the end of a save.
  void finish_saves();
  /// The next frame to send; called while there is room for it, after poll(). A frame that is taken counts as
  /// sent.
  bool next_frame(drivers::CanFrame& frame);
  /// What the controller must be set to; a bit rate changes only when the communication is reset.
  const CanSettings& settings() const { return node_.settings(); }
  /// Rises when they may have changed.
  std::uint32_t settings_changes() const { return node_.settings_changes(); }
  /// A host has asked for a restart (NMT reset node), and no axis is driven any more.
  bool restart_wanted() const { return restart_wanted_; }

  /// Writes the readings can.* into `values`.
  void publish(ParameterValues& values) const;

 private:
  void receive(std::uint32_t now_us);
  void watch_bus();
  void act_on(const canopen::NodeEvents& events);
  void start_node();
  void reset_communication();
  bool save_identity();
  void report_emergencies();

  ParameterAccess& parameters_;
  StoreCommands& store_;
  HostWrites& writes_;
  Axes& axes_;
  LinkStates& links_;
  LinkState& state_;  ///< of the bus, whichever server is asked
  CanReadings readings_;
  EmergencyReports emergencies_;
  RoundClock rounds_;
  std::uint32_t configured_communication_{}, fault_changes_{};
  drivers::PeriodicTimer service_{1'000};
  bool was_bus_off_ = false, identity_saving_ = false, restart_wanted_ = false, reached_over_usb_ = false;
  CanopenObjects objects_;
  canopen::Node<CanopenObjects> node_;
  InterruptQueue<drivers::CanFrame, 64> queue_;
};

}  // namespace kmax::firmware
