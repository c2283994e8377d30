#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "drivers/can_frame.hpp"
#include "drivers/stm32f4/can_filter.hpp"
#include "drivers/stm32f4/registers/can.hpp"

// Frames from the main loop to the three transmit mailboxes of bxCAN, most urgent identifier first. RM0090
// chapter on bxCAN, sections Transmission handling, Transmit priority, Abort.
//
// Order. TXFP = 0: of the mailboxes the lowest identifier is sent first, and among equal ones the lowest
// mailbox number, which says nothing about which is older. So
//   - no two mailboxes ever hold the same identifier; the younger frame waits in its slot. Frames of one
//     identifier leave in the order in which they were sent;
//   - of the waiting frames the one with the lowest identifier goes to the next free mailbox;
//   - when all three are taken and a more urgent frame waits, the least urgent mailbox is aborted (a frame
//     that is on the bus already is finished by the hardware first) and its frame waits again at its old
//     place. Otherwise three frames that lose every arbitration would block an alarm.
//
// A frame keeps its slot until the hardware reports that it was sent, so that an aborted one is not copied or
// overtaken.
//
// Contexts: `send` in one context that does not outrank the transmit interrupt; everything else in that
// interrupt, except `set_halted`. Hand-over is one atomic byte per slot.
//
// Cost of ISR_serve: at most four passes over the slots.

namespace kmax::drivers::stm32f4 {

struct CanTransmitCounters {
  std::uint32_t sent = 0;
  std::uint32_t aborted = 0;           ///< taken back from a mailbox for a more urgent one, and sent later
  std::uint32_t discarded = 0;         ///< thrown away when halted
  std::uint32_t arbitration_lost = 0;  ///< frames that lost at least once before they left or were aborted
};

template <typename Registers, std::size_t capacity>
class CanTransmitter {
  static_assert(capacity >= can_transmit_mailboxes && capacity < 255);

 public:
  explicit constexpr CanTransmitter(Registers& registers) : registers_(registers) {}

  /// Forgets everything. With the interrupt disabled and the mailboxes empty.
  void reset() {
    for (Slot& slot : slots_) slot.state.store(State::free, std::memory_order_relaxed);
    in_mailbox_.fill(none);
    aborting_ = none;
    halted_.store(false, std::memory_order_relaxed);
  }

  bool has_room() const {
    for (const Slot& slot : slots_) {
      if (slot.state.load(std::memory_order_acquire) == State::free) return true;
    }
    return false;
  }

  std::size_t room() const {
    std::size_t free = 0;
    for (const Slot& slot : slots_) free += slot.state.load(std::memory_order_acquire) == State::free ? 1 : 0;
    return free;
  }

  /// False: all slots are taken, or the frame is not valid. The caller pends the interrupt afterwards.
  [[nodiscard]] bool send(const CanFrame& frame) {
    if (!frame.valid()) return false;
    for (Slot& slot : slots_) {
      if (slot.state.load(std::memory_order_acquire) != State::free) continue;
      slot.frame = frame;
      slot.arbitration = can_arbitration(frame);
      slot.identifier = can_identifier_word(frame) & ~can_identifier::Remote::mask;
      slot.sequence = next_sequence_++;
      slot.state.store(State::waiting, std::memory_order_release);
      return true;
    }
    return false;
  }

  /// While halted all frames are thrown away, those in mailboxes as soon as the hardware gives them back.
  void set_halted(bool halted) { halted_.store(halted, std::memory_order_release); }
  bool halted() const { return halted_.load(std::memory_order_acquire); }

  void ISR_serve() {
    ISR_take_back();
    if (halted()) {
      for (Slot& slot : slots_) {
        if (slot.state.load(std::memory_order_acquire) == State::waiting) ISR_discard(slot);
      }
      return;
    }
    for (unsigned mailbox = 0; mailbox < can_transmit_mailboxes; ++mailbox) {
      if (!ISR_empty(mailbox)) continue;
      const std::uint8_t next = ISR_most_urgent();
      if (next == none) return;
      ISR_load(mailbox, next);
    }
    ISR_make_room();
  }

  const CanTransmitCounters& counters() const { return counters_; }

 private:
  static constexpr std::uint8_t none = 0xFF;
  enum class State : std::uint8_t { free, waiting, in_mailbox };
  struct Slot {
    CanFrame frame{};
    std::uint32_t arbitration = 0;
    std::uint32_t identifier = 0;  ///< without the remote bit: what may be in one mailbox only
    std::uint32_t sequence = 0;
    std::atomic<State> state{State::free};
  };

  void ISR_discard(Slot& slot) {
    ++counters_.discarded;
    slot.state.store(State::free, std::memory_order_release);
  }

  /// Mailboxes whose request the hardware has completed.
  void ISR_take_back() {
    const auto status = static_cast<std::uint32_t>(registers_.tsr);
    for (unsigned mailbox = 0; mailbox < can_transmit_mailboxes; ++mailbox) {
      const std::uint32_t byte = status >> can_tsr::position(mailbox);
      if (can_tsr::RequestCompleted::of(byte) == 0) continue;
      // One bit alone: it clears its companions, and leaves a mailbox that completes just now to the next
      // round.
      registers_.tsr = can_tsr::RequestCompleted::mask << can_tsr::position(mailbox);
      const std::uint8_t index = in_mailbox_[mailbox];
      in_mailbox_[mailbox] = none;
      if (mailbox == aborting_) aborting_ = none;
      if (index == none) continue;
      if (can_tsr::ArbitrationLost::of(byte) != 0) ++counters_.arbitration_lost;
      Slot& slot = slots_[index];
      if (can_tsr::TransmitOk::of(byte) != 0) {
        ++counters_.sent;
        slot.state.store(State::free, std::memory_order_release);
      } else if (halted()) {
        ISR_discard(slot);
      } else {
        ++counters_.aborted;
        slot.state.store(State::waiting, std::memory_order_release);
      }
    }
  }

  bool ISR_empty(unsigned mailbox) const {
    return in_mailbox_[mailbox] == none && (can_tsr::Empty::read(registers_.tsr) >> mailbox & 1U) != 0;
  }

  bool ISR_is_in_a_mailbox(std::uint32_t identifier) const {
    for (const std::uint8_t index : in_mailbox_) {
      if (index != none && slots_[index].identifier == identifier) return true;
    }
    return false;
  }

  /// Of the waiting slots that may go to a mailbox: lowest arbitration field, then oldest.
  std::uint8_t ISR_most_urgent() const {
    std::uint8_t best = none;
    for (std::uint8_t i = 0; i < capacity; ++i) {
      const Slot& slot = slots_[i];
      if (slot.state.load(std::memory_order_acquire) != State::waiting) continue;
      if (best != none && !ISR_before(slot, slots_[best])) continue;
      if (ISR_is_in_a_mailbox(slot.identifier)) continue;
      best = i;
    }
    return best;
  }

  static bool ISR_before(const Slot& a, const Slot& b) {
    // Data and remote frame of one identifier: by age alone, or the younger data frame would overtake.
    if (a.identifier == b.identifier || a.arbitration == b.arbitration) {
      return static_cast<std::int32_t>(a.sequence - b.sequence) < 0;
    }
    return a.arbitration < b.arbitration;
  }

  void ISR_load(unsigned mailbox, std::uint8_t index) {
    Slot& slot = slots_[index];
    const CanFrame& frame = slot.frame;
    auto& target = registers_.mailbox[mailbox];
    target.tdtr = can_data_length::Length::bits(frame.length);
    target.tdlr = word(frame, 0);
    target.tdhr = word(frame, 4);
    slot.state.store(State::in_mailbox, std::memory_order_relaxed);
    in_mailbox_[mailbox] = index;
    target.tir = can_identifier_word(frame) | can_identifier::TransmitRequest::mask;
  }

  static std::uint32_t word(const CanFrame& frame, unsigned first) {
    std::uint32_t value = 0;
    for (unsigned i = 0; i < 4; ++i) value |= std::uint32_t{frame.data[first + i]} << (8 * i);
    return value;
  }

  /// All mailboxes are taken: is there a frame that should not wait for them?
  void ISR_make_room() {
    if (aborting_ != none) return;
    unsigned least_urgent = 0;
    for (unsigned mailbox = 0; mailbox < can_transmit_mailboxes; ++mailbox) {
      if (in_mailbox_[mailbox] == none) return;
      if (slots_[in_mailbox_[mailbox]].arbitration > slots_[in_mailbox_[least_urgent]].arbitration)
        least_urgent = mailbox;
    }
    const std::uint8_t next = ISR_most_urgent();
    if (next == none || slots_[next].arbitration >= slots_[in_mailbox_[least_urgent]].arbitration) return;
    aborting_ = static_cast<std::uint8_t>(least_urgent);
    registers_.tsr = can_tsr::AbortRequest::mask << can_tsr::position(least_urgent);
  }

  Registers& registers_;
  std::array<Slot, capacity> slots_{};
  std::array<std::uint8_t, can_transmit_mailboxes> in_mailbox_{none, none, none};
  std::uint8_t aborting_ = none;  ///< mailbox
  std::atomic<bool> halted_{false};
  std::uint32_t next_sequence_ = 0;
  CanTransmitCounters counters_{};
};

}  // namespace kmax::drivers::stm32f4
