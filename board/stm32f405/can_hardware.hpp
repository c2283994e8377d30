#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/cortex_m/interrupt_controller.hpp"
#include "drivers/stm32f4/can.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "firmware/links/canopen_edge.hpp"

namespace kmax::board {

namespace detail {
struct PendTransmit {
  drivers::cortex_m::InterruptController<>& interrupts;
  void operator()() const { interrupts.pend(drivers::stm32f4::Interrupt::can1_tx); }
};
}  // namespace detail

/// CAN1 and its interrupts, behind a CanLink: what the node wants of a bus, in clocks and filters.
class CanHardware : public drivers::stm32f4::Can<detail::PendTransmit> {
 public:
  /// `peripheral_clock_hz`: 0 where the clock is not good enough; the node stays off the bus.
  CanHardware(drivers::cortex_m::InterruptController<>& interrupts, std::uint32_t peripheral_clock_hz)
      : Can(drivers::stm32f4::can1(), detail::PendTransmit{interrupts}),
        interrupts_(interrupts),
        peripheral_clock_hz_(peripheral_clock_hz) {}

  bool configured() const { return configured_; }

  firmware::CanState state_of(const drivers::stm32f4::CanErrors& errors) const {
    using drivers::stm32f4::CanBusState;
    if (!configured_) return absent_ ? firmware::CanState::absent : firmware::CanState::stopped;
    switch (state()) {
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

  /// A bit rate that this clock cannot make, or a controller that does not answer, leaves the node off the
  /// bus. Other identifiers alone do not interrupt what is under way.
  void configure(const firmware::CanSettings& wanted, bool listens_to_all, bool same_rate) {
    using namespace drivers::stm32f4;
    const Filters filters = filters_of(wanted, listens_to_all);
    if (same_rate) {
      set_filters(filters.span());
      return;
    }
    const CanBitTimingSolution solution = solve_can_bit_timing(peripheral_clock_hz_, wanted.bit_rate);
    for (const auto interrupt : all_interrupts) interrupts_.disable(interrupt);
    configured_ = false;
    if (!solution.usable) return;
    CanConfig config;
    config.timing = solution.timing;
    config.polls = initialization_polls;
    const CanConfigureResult result = Can::configure(config, filters.span());
    absent_ = result == CanConfigureResult::no_initialization_mode;
    configured_ = result == CanConfigureResult::ok || result == CanConfigureResult::waiting_for_idle_bus;
    if (!configured_) return;
    for (const auto interrupt : all_interrupts) interrupts_.enable(interrupt);
  }
  /// False: there was no room.
  [[nodiscard]] bool send(const drivers::CanFrame& frame) {
    return Can::send(frame) == drivers::stm32f4::CanSendResult::queued;
  }

  /// Calls `sink(frame, is_for_node)` for each frame.
  template <typename Sink>
  void ISR_receive(unsigned fifo, Sink sink) {
    Can::ISR_receive(fifo,
                     [&](const drivers::CanFrame& frame, std::uint8_t) { sink(frame, fifo == node_fifo); });
  }

 private:
  static constexpr std::array all_interrupts = {
      drivers::stm32f4::Interrupt::can1_tx, drivers::stm32f4::Interrupt::can1_rx0,
      drivers::stm32f4::Interrupt::can1_rx1, drivers::stm32f4::Interrupt::can1_sce};
  /// Initialization waits for the end of the frame that is on the bus, 1.2 ms at 125 kbit/s.
  static constexpr std::uint32_t initialization_polls = 100'000;
  /// What the node wants and what only the others want wait in FIFOs of their own: a FIFO has three places,
  /// and one that is full loses its newest frame. Across the two, order is lost. While a save erases, the
  /// core fetches nothing for 250 ms.
  static constexpr std::uint8_t node_fifo = 0, others_fifo = 1;

  struct Filters {
    std::array<drivers::stm32f4::CanFilter, firmware::CanSettings::identifiers_max / 2 + 1> bank{};
    std::size_t count = 0;
    std::span<const drivers::stm32f4::CanFilter> span() const { return std::span(bank).first(count); }
  };
  static Filters filters_of(const firmware::CanSettings& wanted, bool listens_to_all) {
    Filters filters;
    for (std::size_t i = 0; i < wanted.identifier_count; i += 2) {
      const std::size_t second = i + 1 < wanted.identifier_count ? i + 1 : i;
      filters.bank[filters.count++] =
          drivers::stm32f4::can_filter_standard_list(wanted.identifiers[i], wanted.identifiers[second]);
    }
    // What a list accepts as well goes where the list says (RM0090, filter priority rules).
    if (listens_to_all) filters.bank[filters.count++] = drivers::stm32f4::CanFilter{.fifo = others_fifo};
    return filters;
  }

  drivers::cortex_m::InterruptController<>& interrupts_;
  std::uint32_t peripheral_clock_hz_;
  bool configured_ = false, absent_ = false;
};

}  // namespace kmax::board
