#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "drivers/can_frame.hpp"
#include "drivers/periodic_timer.hpp"
#include "firmware/links/canopen_edge.hpp"

namespace kmax::board {

/// A CAN controller (stm32f405/can_hardware.hpp is one), between its interrupts and the node behind it.
///
/// Follows the node's wish for a bit rate and for the identifiers to receive. All CAN interrupts have
/// the serial link's priority: they and the main loop never wait for each other.
template <typename Hardware>
class CanLink {
 public:
  /// With what the hardware is made of.
  template <typename... Facts>
  explicit CanLink(Facts&&... facts) : hardware_(std::forward<Facts>(facts)...) {}

  /// Main loop, before the node's poll().
  void poll(firmware::CanopenEdge& node, std::uint32_t now_us) {
    if (status_timer_.due(now_us)) {
      looked_us_ = now_us;
      static_cast<void>(hardware_.poll(now_us));
      const auto errors = hardware_.errors();
      readings_.transmit_errors = errors.transmit;
      readings_.receive_errors = errors.receive;
      readings_.state = hardware_.state_of(errors);
      readings_.received = hardware_.receive_counters().received;
      readings_.overruns = hardware_.receive_counters().overruns;
      readings_.sent = hardware_.transmit_counters().sent;
      readings_.discarded = hardware_.transmit_counters().discarded;
      readings_.bus_offs = hardware_.bus_off_counters().bus_offs;
      node.set_readings(readings_);
    }
  }

  /// Main loop, after the node's poll().
  void send(firmware::CanopenEdge& node) {
    const bool again = !hardware_.configured() && looked_us_ - tried_us_ >= retry_interval_us;
    if (again || followed_changes_ != node.settings_changes()) {
      followed_changes_ = node.settings_changes();
      const firmware::CanSettings& wanted = node.settings();
      if (again || !(wanted == settings_)) {
        tried_us_ = looked_us_;
        configure(wanted);
      }
    }
    if (!hardware_.configured()) return;
    // As many as there is room for; a frame that is taken out of the node is on its way.
    if (fed_by_adapter_) return;
    while (hardware_.has_room() && node.next_frame(frame_)) static_cast<void>(hardware_.send(frame_));
  }

  /// Main loop, for who shares the bus with the node over USB, in each turn: the bus takes what is sent at
  /// its own pace. Not one that is off, or where nobody acknowledges, or that others fill with what is more
  /// urgent.
  bool keeps_pace(std::uint32_t now_us) {
    const std::uint32_t sent = hardware_.transmit_counters().sent;
    if (sent != paced_sent_ || hardware_.room() == Hardware::slots) {
      paced_sent_ = sent;
      paced_us_ = now_us;
    }
    return hardware_.configured() && now_us - paced_us_ < patience_us &&
           (readings_.state == firmware::CanState::active ||
            readings_.state == firmware::CanState::error_passive);
  }
  bool has_room() const { return hardware_.configured() && hardware_.has_room(); }
  /// Half of the room is the node's.
  bool has_room_for_guests() const { return hardware_.configured() && hardware_.room() > frames_of_node; }
  /// False: it had no room, or the node is not on the bus.
  bool put(const drivers::CanFrame& frame) { return has_room() && hardware_.send(frame); }
  /// Whether put() brings the node's frames as well: then send() takes none from the node.
  void set_fed_by_adapter(bool fed) { fed_by_adapter_ = fed; }
  /// Whether all frames of the bus are received, and not the node's alone.
  void set_listening_to_all(bool all) {
    if (all == listens_to_all_) return;
    listens_to_all_ = all;
    if (hardware_.configured()) hardware_.configure(settings_, all, true);
  }

  /// These two leave something for the main loop. `tap` sees every frame.
  void ISR_serve_transmit() { hardware_.ISR_serve_transmit(); }
  template <typename Tap>
  void ISR_receive(unsigned fifo, firmware::CanopenEdge& node, Tap tap) {
    hardware_.ISR_receive(fifo, [&](const drivers::CanFrame& frame, bool is_for_node) {
      if (is_for_node) node.ISR_frame(frame);
      tap(frame);
    });
  }
  void ISR_serve_status() { static_cast<void>(hardware_.ISR_serve_status()); }

 private:
  static constexpr std::uint32_t retry_interval_us = 100'000;
  static constexpr std::size_t frames_of_node = Hardware::slots / 2;
  static constexpr std::uint32_t patience_us = 10'000;  ///< a frame takes 1 ms at 125 kbit/s

  void configure(const firmware::CanSettings& wanted) {
    const bool same_rate = hardware_.configured() && wanted.bit_rate == settings_.bit_rate;
    settings_ = wanted;
    hardware_.configure(wanted, listens_to_all_, same_rate);
  }

  Hardware hardware_;
  firmware::CanSettings settings_{.bit_rate = 0};
  firmware::CanReadings readings_{};
  drivers::CanFrame frame_;  ///< the one being sent: kept, since to make an empty one takes 38 instructions
  std::uint32_t followed_changes_ = ~0U;  ///< of the node's settings; none so far, and compared in every turn
  drivers::PeriodicTimer status_timer_{1'000};
  std::uint32_t looked_us_ = 0, tried_us_ = 0;
  std::uint32_t paced_us_ = 0,
                paced_sent_ = 0;  ///< when the bus took something last, or was asked for nothing
  bool listens_to_all_ = false, fed_by_adapter_ = false;
};

}  // namespace kmax::board
