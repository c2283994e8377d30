#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/cortex_m/interrupt_controller.hpp"
#include "drivers/periodic_timer.hpp"
#include "drivers/stm32f4/can.hpp"
#include "drivers/stm32f4/clock_tree.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "firmware/links/canopen_edge.hpp"

namespace kmax::board::odrive_v3 {

/// CAN1 on connector J2, between its interrupts and the link behind it.
///
/// Follows the link's wish for a bit rate and for the identifiers to receive. All CAN interrupts have
/// the serial line's priority: they and the main loop never wait for each other.
class CanLine {
 public:
  /// `peripheral_clock_hz`: 0 where the clock is not good enough; the node stays off the bus.
  CanLine(drivers::cortex_m::InterruptController<>& interrupts, std::uint32_t peripheral_clock_hz)
      : interrupts_(interrupts),
        peripheral_clock_hz_(peripheral_clock_hz),
        can_(drivers::stm32f4::can1(), PendTransmit{interrupts}) {}

  /// Main loop, before the link's poll().
  void poll(firmware::CanopenEdge& link, std::uint32_t now_us) {
    if (status_timer_.due(now_us)) {
      looked_us_ = now_us;
      static_cast<void>(can_.poll(now_us));
      const drivers::stm32f4::CanErrors errors = can_.errors();
      readings_.transmit_errors = errors.transmit;
      readings_.receive_errors = errors.receive;
      readings_.state = state_of(errors);
      readings_.received = can_.receive_counters().received;
      readings_.overruns = can_.receive_counters().overruns;
      readings_.sent = can_.transmit_counters().sent;
      readings_.discarded = can_.transmit_counters().discarded;
      readings_.bus_offs = can_.bus_off_counters().bus_offs;
      link.set_readings(readings_);
    }
  }

  /// Main loop, after the link's poll().
  void send(firmware::CanopenEdge& link) {
    const bool again = !configured_ && looked_us_ - tried_us_ >= retry_interval_us;
    if (again || followed_changes_ != link.settings_changes()) {
      followed_changes_ = link.settings_changes();
      const firmware::CanSettings& wanted = link.settings();
      if (again || !(wanted == settings_)) {
        tried_us_ = looked_us_;
        configure(wanted);
      }
    }
    if (!configured_) return;
    // As many as there is room for; a frame that is taken out of the link is on its way.
    if (fed_by_adapter_) return;
    while (can_.has_room() && link.next_frame(frame_)) static_cast<void>(can_.send(frame_));
  }

  /// Main loop, for who shares the bus with the node over USB, in each turn: the bus takes what is sent at
  /// its own pace. Not one that is off, or where nobody acknowledges, or that others fill with what is more
  /// urgent.
  bool keeps_pace(std::uint32_t now_us) {
    const std::uint32_t sent = can_.transmit_counters().sent;
    if (sent != paced_sent_ || can_.room() == slots) {
      paced_sent_ = sent;
      paced_us_ = now_us;
    }
    return configured_ && now_us - paced_us_ < patience_us &&
           (readings_.state == firmware::CanState::active ||
            readings_.state == firmware::CanState::error_passive);
  }
  bool has_room() const { return configured_ && can_.has_room(); }
  /// Half of the room is the node's.
  bool has_room_for_guests() const { return configured_ && can_.room() > frames_of_node; }
  /// False: it had no room, or the node is not on the bus.
  bool put(const drivers::CanFrame& frame) {
    return has_room() && can_.send(frame) == drivers::stm32f4::CanSendResult::queued;
  }
  /// Whether put() brings the node's frames as well: then send() takes none from the link.
  void set_fed_by_adapter(bool fed) { fed_by_adapter_ = fed; }
  /// Whether all frames of the bus are received, and not the node's alone.
  void set_listening_to_all(bool all) {
    if (all == listens_to_all_) return;
    listens_to_all_ = all;
    if (configured_) can_.set_filters(filters_of(settings_).span());
  }

  /// These two leave something for the main loop. `tap` sees every frame.
  void ISR_serve_transmit() { can_.ISR_serve_transmit(); }
  template <typename Tap>
  void ISR_receive(unsigned fifo, firmware::CanopenEdge& link, Tap tap) {
    can_.ISR_receive(fifo, [&](const drivers::CanFrame& frame, std::uint8_t) {
      if (fifo == node_fifo) link.ISR_frame(frame);
      tap(frame);
    });
  }
  void ISR_serve_status() { static_cast<void>(can_.ISR_serve_status()); }

 private:
  struct PendTransmit {
    drivers::cortex_m::InterruptController<>& interrupts;
    void operator()() const { interrupts.pend(drivers::stm32f4::Interrupt::can1_tx); }
  };
  static constexpr std::array all_interrupts = {
      drivers::stm32f4::Interrupt::can1_tx, drivers::stm32f4::Interrupt::can1_rx0,
      drivers::stm32f4::Interrupt::can1_rx1, drivers::stm32f4::Interrupt::can1_sce};
  /// Initialization waits for the end of the frame that is on the bus, 1.2 ms at 125 kbit/s.
  static constexpr std::uint32_t initialization_polls = 100'000;
  static constexpr std::uint32_t retry_interval_us = 100'000;
  static constexpr std::size_t slots = 16, frames_of_node = slots / 2;
  static constexpr std::uint32_t patience_us = 10'000;  ///< a frame takes 1 ms at 125 kbit/s
  /// What the node wants and what only the others want wait in FIFOs of their own: a FIFO has three places,
  /// and one that is full loses its newest frame. Across the two, order is lost. While a save erases, the
  /// core fetches nothing for 250 ms.
  static constexpr std::uint8_t node_fifo = 0, others_fifo = 1;

  firmware::CanState state_of(const drivers::stm32f4::CanErrors& errors) const {
    using drivers::stm32f4::CanBusState;
    if (!configured_) return absent_ ? firmware::CanState::absent : firmware::CanState::stopped;
    switch (can_.state()) {
      case CanBusState::off:
        return firmware::CanState::stopped;
      case CanBusState::joining:
        return firmware::CanState::joining;
      case CanBusState::on_bus:
        return errors.passive ? firmware::CanState::error_passive : firmware::CanState::active;
      default:
        return firmware::CanState::bus_off;
    }
  }

  struct Filters {
    std::array<drivers::stm32f4::CanFilter, firmware::CanSettings::identifiers_max / 2 + 1> bank{};
    std::size_t count = 0;
    std::span<const drivers::stm32f4::CanFilter> span() const { return std::span(bank).first(count); }
  };
  Filters filters_of(const firmware::CanSettings& wanted) const {
    Filters filters;
    for (std::size_t i = 0; i < wanted.identifier_count; i += 2) {
      const std::size_t second = i + 1 < wanted.identifier_count ? i + 1 : i;
      filters.bank[filters.count++] =
          drivers::stm32f4::can_filter_standard_list(wanted.identifiers[i], wanted.identifiers[second]);
    }
    // What a list accepts as well goes where the list says (RM0090, filter priority rules).
    if (listens_to_all_) filters.bank[filters.count++] = drivers::stm32f4::CanFilter{.fifo = others_fifo};
    return filters;
  }

  /// A bit rate that this clock cannot make, or a controller that does not answer, leaves the node off the
  /// bus. Other identifiers alone do not interrupt what is under way.
  void configure(const firmware::CanSettings& wanted) {
    using namespace drivers::cortex_m;
    using namespace drivers::stm32f4;
    const bool same_rate = configured_ && wanted.bit_rate == settings_.bit_rate;
    settings_ = wanted;
    const Filters filters = filters_of(wanted);
    if (same_rate) {
      can_.set_filters(filters.span());
      return;
    }
    const CanBitTimingSolution solution = solve_can_bit_timing(peripheral_clock_hz_, wanted.bit_rate);
    for (const auto interrupt : all_interrupts) interrupts_.disable(interrupt);
    configured_ = false;
    if (!solution.usable) return;
    CanConfig config;
    config.timing = solution.timing;
    config.polls = initialization_polls;
    const CanConfigureResult result = can_.configure(config, filters.span());
    absent_ = result == CanConfigureResult::no_initialization_mode;
    configured_ = result == CanConfigureResult::ok || result == CanConfigureResult::waiting_for_idle_bus;
    if (!configured_) return;
    for (const auto interrupt : all_interrupts) interrupts_.enable(interrupt);
  }

  drivers::cortex_m::InterruptController<>& interrupts_;
  std::uint32_t peripheral_clock_hz_;
  drivers::stm32f4::Can<PendTransmit, slots> can_;
  firmware::CanSettings settings_{.bit_rate = 0};
  firmware::CanReadings readings_{};
  drivers::CanFrame frame_;  ///< the one being sent: kept, since to make an empty one takes 38 instructions
  std::uint32_t followed_changes_ = ~0U;  ///< of the link's settings; none so far, and compared in every turn
  drivers::PeriodicTimer status_timer_{1'000};
  std::uint32_t looked_us_ = 0, tried_us_ = 0;
  std::uint32_t paced_us_ = 0,
                paced_sent_ = 0;  ///< when the bus took something last, or was asked for nothing
  bool configured_ = false, absent_ = false, listens_to_all_ = false, fed_by_adapter_ = false;
};

}  // namespace kmax::board::odrive_v3
