#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/can_frame.hpp"
#include "drivers/register_field.hpp"
#include "drivers/stm32f4/can_bit_timing.hpp"
#include "drivers/stm32f4/can_bus_off.hpp"
#include "drivers/stm32f4/can_filter.hpp"
#include "drivers/stm32f4/can_transmitter.hpp"
#include "drivers/stm32f4/registers/can.hpp"

// Controller area network on bxCAN: RM0090 chapter on bxCAN.
//
// Sending is can_transmitter.hpp's business: priority by identifier, and frames of one identifier never
// change places. Receiving hands each frame to a function of the caller in the interrupt; a FIFO that
// overflows replaces its newest frame (RFLM = 0) and counts.
//
// Bus-off is left by this software alone (ABOM = 0), later each time it happens: see can_bus_off.hpp.
// Entering bus-off throws all waiting frames away: what was meant for then is not sent a second later.
//
// An emulator without this peripheral reads zeros: `configure` then says no_initialization_mode instead of
// hanging.
//
// Contexts: `configure` with the four interrupts off; `send`, `poll`, `errors` from the main loop;
// ISR_serve_transmit, ISR_receive and ISR_serve_status from their interrupts, which share one priority. The
// constructor takes a function that pends the transmit interrupt: mailboxes are written there and nowhere
// else.

namespace kmax::drivers::stm32f4 {

enum class CanConfigureResult : std::uint8_t {
  ok,
  bad_timing,
  too_many_filters,        ///< more than 14
  no_initialization_mode,  ///< INAK does not rise: no clock, or no such peripheral. Nothing works
  waiting_for_idle_bus,    ///< set up, but INAK has not fallen yet: the bus is busy, stuck dominant or not
                           ///< connected; `poll` says when it has joined
};

struct CanConfig {
  CanBitTiming timing{};  ///< of the board's clock; none is refused
  /// Talks to itself and to nobody else (LBKM with SILM): for the self-test, with the bus untouched.
  bool self_test = false;
  /// Reads of MSR that `configure` waits for each acknowledgement. Leaving initialization takes 11 recessive
  /// bits, 88 us at 125 kbit/s, or 3000 reads.
  std::uint32_t polls = 10'000;
};

/// LEC: how the last frame failed.
enum class CanLastError : std::uint8_t {
  none,
  stuff,
  form,
  acknowledgement,
  recessive_bit,
  dominant_bit,
  crc,
  unchanged
};

struct CanErrors {
  std::uint8_t transmit = 0;  ///< TEC
  std::uint8_t receive = 0;   ///< REC
  CanLastError last =
      CanLastError::none;  ///< since the last call; unchanged: nothing has failed or succeeded since
  bool warning = false;    ///< a counter has reached 96
  bool passive = false;    ///< a counter has reached 128
  bool bus_off = false;
};

struct CanReceiveCounters {
  std::uint32_t received = 0;
  std::uint32_t overruns = 0;  ///< times that at least one frame was lost because the FIFO was full
};

enum class CanSendResult : std::uint8_t {
  queued,
  queue_full,
  bad_frame,
  not_on_the_bus,  ///< not configured, bus-off or recovering
};

template <std::invocable PendTransmit, std::size_t capacity = 16, typename Registers = CanRegisters>
class Can {
 public:
  static constexpr std::size_t slots = capacity;

  constexpr Can(Registers& registers, PendTransmit pend_transmit)
      : registers_(registers), transmitter_(registers), pend_transmit_(pend_transmit) {}

  /// Drops what is waiting, sets everything up and joins the bus.
  [[nodiscard]] CanConfigureResult configure(const CanConfig& config, std::span<const CanFilter> filters) {
    if (!config.timing.valid()) return CanConfigureResult::bad_timing;
    if (filters.size() > can1_filter_banks) return CanConfigureResult::too_many_filters;
    bus_off_.stop();
    registers_.ier = 0;
    registers_.mcr = mode | can_mcr::InitializationRequest::mask;
    constexpr std::uint32_t acknowledges = can_msr::Initialization::mask | can_msr::Sleeping::mask;
    if (!wait_until(registers_.msr, acknowledges, can_msr::Initialization::mask, config.polls)) {
      return CanConfigureResult::no_initialization_mode;
    }
    constexpr std::uint32_t self_test = can_btr::LoopBack::mask | can_btr::Silent::mask;
    registers_.btr = config.timing.btr() | (config.self_test ? self_test : 0U);
    set_filters(filters);
    clear();
    registers_.ier = can_ier::TransmitMailboxEmpty::mask | can_ier::Fifo0Pending::mask |
                     can_ier::Fifo0Overrun::mask | can_ier::Fifo1Pending::mask | can_ier::Fifo1Overrun::mask |
                     can_ier::ErrorPassive::mask | can_ier::BusOff::mask | can_ier::Error::mask;
    registers_.mcr = mode;
    bus_off_.start();
    return wait_until(registers_.msr, can_msr::Initialization::mask, 0, config.polls)
               ? CanConfigureResult::ok
               : CanConfigureResult::waiting_for_idle_bus;
  }

  /// Other filters without leaving the bus; what arrives in the same moment may be lost. At most
  /// can1_filter_banks.
  void set_filters(std::span<const CanFilter> filters) {
    can_fmr::FilterInitialization::set(registers_.fmr);
    std::uint32_t lists = 0;
    std::uint32_t second_fifo = 0;
    const std::uint32_t active = (1U << filters.size()) - 1;
    registers_.fa1r = 0;
    for (std::size_t i = 0; i < filters.size(); ++i) {
      registers_.bank[i].fr1 = filters[i].first;
      registers_.bank[i].fr2 = filters[i].second;
      if (filters[i].list) lists |= 1U << i;
      if (filters[i].fifo != 0) second_fifo |= 1U << i;
    }
    registers_.fm1r = lists;
    registers_.fs1r = active;
    registers_.ffa1r = second_fifo;
    registers_.fa1r = active;
    can_fmr::FilterInitialization::clear(registers_.fmr);
  }

  /// Main loop: send() would find a free slot.
  bool has_room() const { return !transmitter_.halted() && bus_off_.may_send() && transmitter_.has_room(); }

  /// Main loop: so many frames would find a free slot.
  std::size_t room() const { return transmitter_.halted() || !bus_off_.may_send() ? 0 : transmitter_.room(); }

  /// Main loop.
  [[nodiscard]] CanSendResult send(const CanFrame& frame) {
    if (!frame.valid()) return CanSendResult::bad_frame;
    if (transmitter_.halted() || !bus_off_.may_send()) return CanSendResult::not_on_the_bus;
    if (!transmitter_.send(frame)) return CanSendResult::queue_full;
    pend_transmit_();
    return CanSendResult::queued;
  }

  /// Main loop, every few milliseconds: joining, bus-off and the way back.
  CanBusState poll(std::uint32_t now_us) {
    const CanBusOffAction action = bus_off_.poll(now_us, can_esr::BusOff::read(registers_.esr) != 0,
                                                 can_msr::Initialization::read(registers_.msr) != 0);
    switch (action) {
      case CanBusOffAction::none:
        break;
      case CanBusOffAction::drop_frames:
        transmitter_.set_halted(true);
        registers_.tsr = can_tsr::abort_all;  // bits that are written 0 stay as they are
        pend_transmit_();
        break;
      case CanBusOffAction::request_initialization:
        registers_.mcr = mode | can_mcr::InitializationRequest::mask;
        break;
      case CanBusOffAction::leave_initialization:
        registers_.mcr = mode;
        break;
      case CanBusOffAction::resume:
        transmitter_.set_halted(false);
        break;
    }
    return bus_off_.state();
  }

  CanBusState state() const { return bus_off_.state(); }

  /// CAN1_TX.
  void ISR_serve_transmit() { transmitter_.ISR_serve(); }

  /// CAN1_RX0 (fifo 0) and CAN1_RX1 (fifo 1): calls `sink(const CanFrame&, std::uint8_t filter_index)` for
  /// each frame, at most as many as a FIFO holds.
  template <typename Sink>
  void ISR_receive(unsigned fifo, Sink&& sink) {
    auto& status = registers_.rfr[fifo];
    auto& front = registers_.fifo[fifo];
    for (unsigned i = 0; i < can_fifo_depth; ++i) {
      const auto word = static_cast<std::uint32_t>(status);
      if (can_rfr::Overrun::of(word) != 0) {
        ++receive_counters_.overruns;
        status = can_rfr::Overrun::mask | can_rfr::Full::mask;
      }
      if (can_rfr::Pending::of(word) == 0) return;
      std::uint8_t filter = 0;
      const CanFrame frame = ISR_read(front, filter);
      status = can_rfr::Release::mask;
      ++receive_counters_.received;
      sink(frame, filter);
      // Before the next frame is in front. Takes a few cycles; if not, the interrupt comes again.
      if (!wait_until(status, can_rfr::Release::mask, 0, release_polls)) return;
    }
  }

  /// CAN1_SCE: true when the controller is bus-off now, for whoever has to act before the next `poll`.
  bool ISR_serve_status() {
    registers_.msr = can_msr::ErrorInterrupt::mask;
    return can_esr::BusOff::read(registers_.esr) != 0;
  }

  /// Main loop: takes the last error code back.
  CanErrors errors() {
    const auto word = static_cast<std::uint32_t>(registers_.esr);
    registers_.esr = can_esr::LastErrorCode::bits(static_cast<std::uint32_t>(CanLastError::unchanged));
    return {static_cast<std::uint8_t>(can_esr::TransmitErrors::of(word)),
            static_cast<std::uint8_t>(can_esr::ReceiveErrors::of(word)),
            static_cast<CanLastError>(can_esr::LastErrorCode::of(word)),
            can_esr::Warning::of(word) != 0,
            can_esr::Passive::of(word) != 0,
            can_esr::BusOff::of(word) != 0};
  }

  const CanTransmitCounters& transmit_counters() const { return transmitter_.counters(); }
  const CanReceiveCounters& receive_counters() const { return receive_counters_; }
  const CanBusOffCounters& bus_off_counters() const { return bus_off_.counters(); }

 private:
  /// Not asleep, priority by identifier, retransmission, bus-off left by software; stops with the core in a
  /// debugger if DBGMCU says so too.
  static constexpr std::uint32_t mode = can_mcr::DebugFreeze::mask;
  static constexpr std::uint32_t release_polls = 8;

  /// What an earlier life has left.
  void clear() {
    registers_.tsr = can_tsr::abort_all;
    registers_.tsr = can_tsr::completed_all;
    for (unsigned fifo = 0; fifo < can_fifos; ++fifo) {
      for (unsigned i = 0; i < can_fifo_depth; ++i) {
        registers_.rfr[fifo] = can_rfr::Release::mask | can_rfr::Full::mask | can_rfr::Overrun::mask;
        static_cast<void>(wait_until(registers_.rfr[fifo], can_rfr::Release::mask, 0, release_polls));
      }
    }
    registers_.msr = can_msr::ErrorInterrupt::mask;
    transmitter_.reset();
  }

  static CanFrame ISR_read(const auto& front, std::uint8_t& filter) {
    CanFrame frame;
    const auto identifier = static_cast<std::uint32_t>(front.rir);
    frame.extended = can_identifier::Extended::of(identifier) != 0;
    frame.remote = can_identifier::Remote::of(identifier) != 0;
    frame.identifier = frame.extended ? can_identifier::ExtendedId::of(identifier)
                                      : can_identifier::StandardId::of(identifier);
    const auto length = static_cast<std::uint32_t>(front.rdtr);
    filter = static_cast<std::uint8_t>(can_data_length::FilterIndex::of(length));
    // A code of 9 to 15 is allowed on the bus and means 8.
    const std::uint32_t code = can_data_length::Length::of(length);
    frame.length = static_cast<std::uint8_t>(code > 8 ? 8 : code);
    const auto low = static_cast<std::uint32_t>(front.rdlr);
    const auto high = static_cast<std::uint32_t>(front.rdhr);
    for (unsigned i = 0; i < 4; ++i) {
      frame.data[i] = static_cast<std::uint8_t>(low >> (8 * i) & 0xFF);
      frame.data[i + 4] = static_cast<std::uint8_t>(high >> (8 * i) & 0xFF);
    }
    return frame;
  }

  Registers& registers_;
  CanTransmitter<Registers, capacity> transmitter_;
  PendTransmit pend_transmit_;
  CanBusOff bus_off_{};
  CanReceiveCounters receive_counters_{};
};

}  // namespace kmax::drivers::stm32f4
